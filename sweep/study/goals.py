"""Objective, constraints and search of a study, checked against the quantities and spaces that it has."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from ..camera.scene import WhitePatchExposure
from ..designs.space import Space
from ..metrics.bound import Bound
from ..metrics.quantity import DN, OF_A_SHARE, WORST_CASE, Asked, Quantity
from ..metrics.registry import quantities_of
from ..search.solver import ALGORITHMS, DIRECT, GRADIENT
from .axes import Axis
from .model import Search
from .schema import StudySection
from .sources import Sources
from .yaml_tree import Key

_LEAST_ERROR = 1e-12
"""Smallest error that is stated where errors are no exact sums."""


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


def search_of(section: StudySection, spaces: Sequence[Space], sources: Sources) -> Search | None:
    """The search, or None where there is none or after adding faults."""
    asked = section.search
    if asked is None:
        return None
    boxes = {space.name: space for space in spaces if space.kind in ("sweep", "search")}
    names = [*section.sweeps, *section.boxes]
    scenarios = list(section.scenarios)
    chosen = asked.space or (names[0] if len(names) == 1 else None)
    if chosen is None:
        problem = "missing: the search needs one sweep or box"
        sources.add(("search", "space"), problem, None, ", ".join(names) or "a sweep")
    elif chosen not in names:
        sources.unknown(("search", "space"), "sweep or box", chosen, names)
    elif chosen in boxes and all(min(axis) == max(axis) for axis in boxes[chosen].axes):
        sources.add(("search", "space"), "every parameter is fixed", chosen, "one free parameter or more")
    if asked.scenario is not None and asked.scenario not in scenarios:
        sources.unknown(("search", "scenario"), "scenario", asked.scenario, scenarios)
    if asked.algorithm not in ALGORITHMS:
        what = "algorithm (it must take inequality constraints)"
        sources.unknown(("search", "algorithm"), what, asked.algorithm, list(ALGORITHMS))
    scenario = asked.scenario or scenarios[0]
    if chosen not in boxes or asked.algorithm not in ALGORITHMS or scenario not in scenarios:
        return None
    levels: tuple[float, ...] = ()
    if asked.front is not None:
        levels = Axis(min=asked.front.min, max=asked.front.max, count=asked.front.count).points()
    seen = section.scenarios[scenario]
    if seen.drive is not None and isinstance(seen.exposure, WhitePatchExposure):
        sources.add(("search", "scenario"), "a search under a pulsed light needs a fixed exposure", scenario)
    effort = asked.algorithm, asked.starts, asked.max_evaluations
    return Search(boxes[chosen], scenario, *effort, levels)


def check_searched(section: StudySection, space: Space, known: Mapping[str, Quantity], sources: Sources) -> None:
    """Check that the searched family has what is constrained, and that levels of the search go with the objective."""
    assert space.filter is not None
    assert section.search is not None
    dimensions, goals = space.filter.family.dimensions, section.objective.weights
    for name in section.constraints:
        if name in known and known[name].needs == "family" and name not in dimensions:
            problem = f"{space.filter.family.kind} has no {name}"
            sources.add(("constraints", name), problem, None, ", ".join(dimensions) or "none")
    if section.search.front is not None and any(known[name].role == "light" for name in goals if name in known):
        problem = "the front is searched at levels of sensitivity, which is in the objective"
        sources.add(("search", "front"), problem, None, "an objective of CSDs")
