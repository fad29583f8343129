"""What a study maximizes and constrains, checked against the quantities that it has."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from ..metrics.bound import Bound
from ..metrics.quantity import DN, OF_A_SHARE, WORST_CASE, Asked, Quantity
from ..metrics.registry import quantities_of
from ..search.solver import DIRECT, GRADIENT
from .schema import StudySection
from .sources import Sources
from .yaml_tree import Key

_LEAST_ERROR = 1e-12
"""Of errors that are not exact sums no smaller one is told."""


def check_goals(section: StudySection, sources: Sources, asked: Asked) -> None:
    """Add a fault for each quantity of objective and constraints that does not exist or cannot be asked for so.

    `asked`: what the study asks for, with its states.
    """
    known = quantities_of(asked)
    _check_objective(section, sources, asked, known)
    for name, bound in section.constraints.items():
        path: tuple[Key, ...] = ("constraints", name)
        if not _is_known(path, "quantity", name, section, sources, asked):
            continue
        if known[name].smooth is None and section.search is not None:
            sources.add(path, f"the search does not know {name}", None, "a study without `search`")
        _check_slopes(path, known[name], section, sources)
        _check_ends(path, known[name], bound, sources)


def _check_objective(section: StudySection, sources: Sources, asked: Asked, known: Mapping[str, Quantity]) -> None:
    given = sources.document.data.get("objective")
    rule = section.objective.rule
    for name in section.objective.weights:
        path: tuple[Key, ...] = ("objective", rule.name, name) if isinstance(given, dict) else ("objective",)
        if not _is_known(path, "objective", name, section, sources, asked):
            continue
        _check_slopes(path, known[name], section, sources)
        if known[name].wanted != rule.wanted:
            right = f"`{{least: {{{name}: 1}}}}`" if rule.wanted == "more" else "`minimum` or `sum`"
            sources.add(path, f"{known[name].wanted} of {name} is better", None, right)


def _check_slopes(path: tuple[Key, ...], quantity: Quantity, section: StudySection, sources: Sources) -> None:
    """A search by gradients needs those of all that it looks at."""
    if section.search is not None and section.search.algorithm in GRADIENT and not quantity.slopes:
        allowed = f"`search: {{algorithm: ...}}`: {', '.join(DIRECT)}"
        sources.add(path, f"{quantity.name} has no derivatives, which {section.search.algorithm} needs", None, allowed)


def _check_ends(path: tuple[Key, ...], quantity: Quantity, bound: Bound, sources: Sources) -> None:
    for end in ("min", "max"):
        value = getattr(bound, end)
        if end not in quantity.ends and value is not None:
            right = " or ".join(f"`{each}`" for each in quantity.ends)
            sources.add((*path, end), f"{quantity.name} has no `{end}`", value, right)
    if quantity.rows == "decades" and bound.max is not None and not _LEAST_ERROR <= bound.max <= 1:
        sources.add((*path, "max"), "no such error is told", bound.max, f"{_LEAST_ERROR:g} to 1")


def _is_known(
    path: tuple[Key, ...],
    what: str,
    name: str,
    section: StudySection,
    sources: Sources,
    asked: Asked,
) -> bool:
    """Return whether there is such a quantity; else add a fault, with what the study would need for it."""
    known = _names(what, asked)
    if name in known:
        return True
    shifted = quantities_of(replace(asked, edge_shift=True)).get(name)
    if shifted is not None and shifted.extreme == WORST_CASE and not section.production.tolerance:
        needed = "`production.edge_shift_nm`" + (" or `population`" if shifted.apart == DN else "")
        sources.add(path, f"{name} needs {needed}", None, "a shift above 0")
    elif name in {n for n, q in quantities_of(replace(asked, wanted_yield=1.0)).items() if q.extreme == OF_A_SHARE}:
        sources.add(path, f"{name} needs `population.wanted_yield`", None, "a share, such as 0.99")
    elif not asked.states and name in {*quantities_of(replace(asked, states=asked.classes))} - {*quantities_of(asked)}:
        sources.add(path, f"{name} needs `recognition`", None, "`recognition: {}`, and noise in every scenario")
    else:
        more = replace(asked, states=asked.classes, edge_shift=True, wanted_yield=1.0)
        sources.unknown(path, what, name, known, _names(what, more))
    return False


def _names(what: str, asked: Asked) -> list[str]:
    """Quantities that an objective or a constraint can be of."""
    return [name for name, q in quantities_of(asked).items() if (q.goal if what == "objective" else q.ends)]
