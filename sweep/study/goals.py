"""Objective, constraints and search of a study, checked against its quantities, its spaces and their limits."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from ..base.errors import Fault, InfeasibleError, ValidationIssue, unknown
from ..base.user_code import kind_in_words
from ..camera.scene import Scene, WhitePatchExposure
from ..designs.family import ChoosingFamily
from ..designs.space import Space
from ..metrics.columns.sensitivity import CFA_SENSITIVITY, SENSITIVITY
from ..metrics.objective import Objective
from ..metrics.quantity import DN, OF_A_SHARE, WORST_CASE, Quantity, RequestedQuantities
from ..metrics.registry import quantities_of
from ..metrics.separation import cfa_sensitivity
from ..search.solver import ALGORITHMS, DIRECT, GRADIENT, ONE_START
from .axes import Axis
from .model import Search, Study
from .schema import StudySection
from .sources import Sources
from .tree import KeyPath

_SLACK = 1e-9
_MOST_LIGHT = 10.0
"""Light of a modified channel over that of its base that anyone may want; larger bounds are percentages."""
_LEAST_ERROR = 1e-12
"""Smallest error that is stated where errors are no exact sums."""


def with_pairs_in_order(section: StudySection, requested: RequestedQuantities) -> StudySection:
    """Return the study with the two types in names of its goals as columns name them: a pair has no order."""
    every = replace(
        requested, states=requested.classes, any_place=True, edge_shift=True, population=True, wanted_yield=1.0
    )
    known = quantities_of(every)
    swapped = {}
    for name, quantity in known.items():
        if quantity.pair is not None:
            first, second = quantity.pair
            swapped[name.replace(f"_{first}_{second}", f"_{second}_{first}")] = name
    swapped = {name: column for name, column in swapped.items() if name not in known}
    rule, weights = section.objective.rule.name, section.objective.weights
    objective = Objective(**{rule: {swapped.get(name, name): weight for name, weight in weights.items()}})
    constraints = {swapped.get(name, name): bound for name, bound in section.constraints.items()}
    if len(constraints) < len(section.constraints):
        return section
    return section.model_copy(update={"objective": objective, "constraints": constraints})


def brightness_note(goals: Iterable[str], scenes: Iterable[Scene], requested: RequestedQuantities) -> Iterator[str]:
    """Yield a note where a goal counts how bright a lamp is, and lamps of a scene differ in photons."""
    known = quantities_of(requested)
    counted = [name for name in goals if name in known and _counts_brightness(known[name])]
    if counted and not all(scene.equal_photons for scene in scenes):
        yield (
            f"{counted[0]} counts how bright a lamp is, where signals differ in photons (`intensity_cd`, `drive`): "
            f"chromatic_{counted[0].removeprefix('worst_')} does not"
        )


def check_goals(section: StudySection, requested: RequestedQuantities, *, written_out: bool) -> Iterator[Fault]:
    """Check that objective and constraints name quantities the study has; `written_out`: with its rule as a key."""
    known, rule = quantities_of(requested), section.objective.rule
    for name in section.objective.weights:
        path: KeyPath = ("objective", rule.name, name) if written_out else ("objective",)
        if (fault := _unknown(path, "objective", name, section, requested)) is not None:
            yield fault
            continue
        yield from _check_slopes(path, known[name], section)
        if known[name].direction != rule.direction:
            right = f"`{{least: {{{name}: 1}}}}`" if rule.direction == "more" else "`minimum` or `sum`"
            yield Fault(path, f"{known[name].direction} of {name} is better", None, right)
    for name, bound in section.constraints.items():
        path = ("constraints", name)
        if (fault := _unknown(path, "quantity", name, section, requested)) is not None:
            yield fault
            continue
        if known[name].smooth is None and section.search is not None:
            yield Fault(path, f"the search does not know {name}", None, "a study without `search`")
        yield from _check_slopes(path, known[name], section)
        for end in ("min", "max"):
            value, ends = getattr(bound, end), known[name].ends
            if end not in ends and value is not None:
                right = " or ".join(f"`{other}`" for other in ends)
                yield Fault((*path, end), f"{name} has no `{end}`", value, right)
            elif value is not None:
                yield from _check_range((*path, end), known[name], value)
        if known[name].scale == "log10" and bound.max is not None and not _LEAST_ERROR <= bound.max <= 1:
            yield Fault((*path, "max"), "no such error is computed", bound.max, f"{_LEAST_ERROR:g} to 1")


def _check_range(path: KeyPath, quantity: Quantity, value: float) -> Iterator[Fault]:
    """Check that a bound is one that the quantity can have."""
    low = -math.inf if quantity.signed else 0.0
    high = _MOST_LIGHT if quantity.role == "light" else quantity.most if path[-1] == "min" else math.inf
    if not low <= value <= high:
        percent = f"; {value:g} % are {value / 100:g}" if quantity.role == "light" and 1 < value <= 100 else ""
        allowed = f"{low:g} or more" if high == math.inf else f"{low:g} to {high:g}"
        yield Fault(path, f"{quantity.name} has no such values", value, allowed + percent)


def _check_slopes(path: KeyPath, quantity: Quantity, section: StudySection) -> Iterator[Fault]:
    """Check that a search by gradients has those of all that it looks at."""
    if section.search is not None and section.search.algorithm in GRADIENT and not quantity.slopes:
        allowed = f"`search: {{algorithm: ...}}`: {', '.join(DIRECT)}"
        yield Fault(path, f"{quantity.name} has no derivatives, which {section.search.algorithm} needs", None, allowed)


def _counts_brightness(quantity: Quantity) -> bool:
    """Return whether a separation counts how bright lamps are."""
    return quantity.role == "separation" or (quantity.per_pixel and quantity.distance_kind == DN)


def _unknown(
    path: KeyPath, what: str, name: str, section: StudySection, requested: RequestedQuantities
) -> Fault | None:
    """Return the fault of a quantity that there is not, with the missing key; None if there is."""
    known = _names(what, requested)
    if name in known:
        return None
    shifted = quantities_of(replace(requested, edge_shift=True)).get(name)
    if shifted is not None and shifted.extreme == WORST_CASE and not section.production.tolerance:
        needed = "`production.edge_shift_nm`" + (" or `population`" if shifted.distance_kind == DN else "")
        return Fault(path, f"{name} needs {needed}", None, "a shift above 0")
    if name in {n for n, q in quantities_of(replace(requested, wanted_yield=1.0)).items() if q.extreme == OF_A_SHARE}:
        problem = f"{name} needs `wanted_yield` of `population` or `uncertainty`"
        return Fault(path, problem, None, "a share, such as 0.99")
    of_states = quantities_of(replace(requested, states=requested.classes))
    if not requested.states and name in of_states and name not in quantities_of(requested):
        return Fault(path, f"{name} needs `recognition`", None, "`recognition: {}`, and noise in every scenario")
    more = replace(requested, states=requested.classes, edge_shift=True, wanted_yield=1.0)
    return unknown(path, what, name, known, _names(what, more))


def _names(what: str, requested: RequestedQuantities) -> list[str]:
    """Return the quantities that an objective or a constraint can be of."""
    return [name for name, q in quantities_of(requested).items() if (q.goal if what == "objective" else q.ends)]


def search_of(section: StudySection, spaces: Sequence[Space], sources: Sources) -> Search | None:
    """Construct the search of a study.

    None if the study has no search, or after adding issues.
    """
    requested = section.search
    if requested is None:
        return None
    boxes = {space.name: space for space in spaces if space.kind in ("sweep", "search")}
    chosen, tiles = _chosen(section, boxes, sources)
    scenarios = list(section.scenarios)
    bases = {name: scene.series or name for name, scene in section.scenarios.items()}
    scenario_name = requested.scenario or scenarios[0]
    searched = (
        [scenario_name] if scenario_name in bases else [name for name, base in bases.items() if base == scenario_name]
    )
    if not searched:
        sources.refuse(
            unknown(("search", "scenario"), "scenario", scenario_name, dict.fromkeys([*bases, *bases.values()]))
        )
    if requested.algorithm not in ALGORITHMS:
        what = "algorithm (it must take inequality constraints)"
        sources.refuse(unknown(("search", "algorithm"), what, requested.algorithm, list(ALGORITHMS)))
    if chosen not in boxes or requested.algorithm not in ALGORITHMS or not searched:
        return None
    if len(searched) > 1:
        sources.refuse(*_check_series(section))
    levels: tuple[float, ...] = ()
    if requested.front is not None:
        levels = Axis(min=requested.front.min, max=requested.front.max, count=requested.front.count).points()
    for scene in (section.scenarios[name] for name in searched):
        if scene.drive is not None and isinstance(scene.exposure, WhitePatchExposure):
            sources.refuse(
                Fault(("search", "scenario"), "a search under a pulsed light needs a fixed exposure", scenario_name)
            )
            break
    space, others = boxes[chosen], {space.name for space in spaces if space.kind in ("reference", "design")}
    assert space.filter is not None
    if requested.name in others:
        sources.refuse(Fault(("search", "name"), "a CFA or design has that name", requested.name, "another name"))
    name = requested.name or f"best {kind_in_words(space.filter.family.kind)}"
    name += " (search)" if name in others else ""
    starts = 1 if requested.algorithm in ONE_START else requested.starts
    effort = requested.algorithm, starts, requested.max_evaluations
    return Search(name, space, searched[0], tuple(searched), *effort, levels, tiles)


def _chosen(
    section: StudySection, boxes: Mapping[str, Space], sources: Sources
) -> tuple[str | None, tuple[Space, ...]]:
    """Return the name of the searched space, and all spaces of a search over tiles, of which it is the first."""
    assert section.search is not None
    requested, groups = section.search, dict[str, list[Space]]()
    for name, box in section.boxes.items():
        groups.setdefault(box.group or name, []).extend([boxes[name]] if name in boxes else [])
    names = [*section.sweeps, *groups]
    chosen = requested.space or (names[0] if len(names) == 1 else None)
    if chosen is None:
        problem = "missing: the search needs one sweep or box"
        sources.refuse(Fault(("search", "space"), problem, None, ", ".join(names) or "a sweep"))
    elif chosen not in names:
        sources.refuse(unknown(("search", "space"), "sweep or box", chosen, names))
    tiles = groups.get(chosen or "", []) if chosen not in boxes else []
    if tiles:
        chosen = tiles[0].name
    if chosen is not None and chosen in boxes and not free_parameters(boxes[chosen]):
        sources.refuse(Fault(("search", "space"), "every parameter is fixed", chosen, "one free parameter or more"))
    return chosen, tuple(tiles)


def _check_series(section: StudySection) -> Iterator[Fault]:
    """Check that a search over several scenarios has an objective with a worst one, and no front."""
    assert section.search is not None
    if section.search.front is not None:
        yield Fault(("search", "front"), "of one scenario, and the search is over several", None, "one `scenario`")
    if not section.objective.rule.smallest:
        problem = f"the worst of several scenarios is not known of a {section.objective.rule.name}"
        yield Fault(("objective",), problem, None, "`minimum` or `least`")


def free_parameters(space: Space) -> list[str]:
    """Return the parameters that a search varies: neither fixed, nor numbers of a catalog."""
    assert space.filter is not None
    family = space.filter.family
    numbers = [space.parameters[number] for number, _ in family.slots] if isinstance(family, ChoosingFamily) else []
    ranges = zip(space.parameters, space.axes, strict=True)
    return [name for name, axis in ranges if name not in numbers and min(axis) < max(axis)]


def check_searched(section: StudySection, space: Space, known: Mapping[str, Quantity]) -> Iterator[Fault]:
    """Check that the searched family has the constrained quantities and suits the objective."""
    assert space.filter is not None
    assert section.search is not None
    dimensions, goals = space.filter.family.dimensions, section.objective.weights
    for name in section.constraints:
        if name in known and known[name].needs == "family" and name not in dimensions:
            problem = f"{space.filter.family.kind} has no {name}"
            yield Fault(("constraints", name), problem, None, ", ".join(dimensions) or "none")
    if section.pixel.captures and any(known[name].states for name in (*goals, *section.constraints) if name in known):
        yield from _check_merged(section)
    if section.search.front is not None and any(known[name].role == "light" for name in goals if name in known):
        problem = "the front is searched at levels of sensitivity, which is in the objective"
        yield Fault(("search", "front"), problem, None, "an objective of CSDs")


def _check_merged(section: StudySection) -> Iterator[Fault]:
    """Check that the captures of an HDR pixel that is searched under noise see the same light."""
    for number, capture in enumerate(section.pixel.captures):
        if capture.crosstalk is not None:
            path: KeyPath = ("pixel", "captures", number, "crosstalk")
            yield Fault(path, "a search under noise has captures of one crosstalk", None, "that of the pixel")
    for name, scene in section.scenarios.items():
        if scene.drive is not None:
            problem = "a search under the noise of merged captures needs steady light"
            yield Fault(("scenarios", name, "drive"), problem, None, "no `drive`")


def refuse_unreachable(study: Study) -> None:
    """Raise InfeasibleError if no filter of the searched space can meet a constraint."""
    search = study.search
    if (
        search is not None
        and not search.tiles
        and (beyond := unreachable_constraints(study, search.space, search.scenario))
    ):
        raise InfeasibleError([ValidationIssue(f"{study.name}: no design can be feasible"), *beyond])


def unreachable_constraints(study: Study, space: Space, scenario: str) -> list[ValidationIssue]:
    """Find constraints that no filter of a design space can meet.

    Bounds sensitivities by the largest curve within the parameter box, widths by the box, and CSDs by the largest
    distance
    between digital numbers. A constraint that is not listed may still be infeasible.

    Returns one per constraint.
    """
    issues = []
    most = dict(_most(study, space, scenario))
    for name, bound in study.constraints.items():
        plain = study.quantities[name].of or name
        if bound.min is not None and plain in most and bound.min > most[plain] * (1 + _SLACK):
            largest = math.ceil(most[plain] * 1e4) / 1e4
            problem = f"out of reach: {name} {bound}; no filter of {space.name} has more than {largest:g}"
            if study.quantities[name].role == "light" and 1 < bound.min <= 100:
                problem += f" ({bound.min:g} % are {bound.min / 100:g})"
            issues.append(ValidationIssue(problem, key=f"constraints.{name}"))
    return issues


def _most(study: Study, space: Space, scenario: str) -> Iterator[tuple[str, float]]:
    """Yield quantities with the largest values that they can have in a space."""
    setup = study.setup(space, scenario)
    for name, quantity in study.quantities.items():
        if quantity.distance_kind == DN and not quantity.extreme:
            yield name, setup.camera.longest_distance_dn * float(quantity.factors(setup.camera.mosaic).max())
    if space.filter is None:
        return
    low, high = (np.array([end(axis) for axis in space.axes], dtype=float) for end in (min, max))
    perturbed = [space.filter.family.perturbed(production_error) for production_error in study.tolerance.places]
    top = np.max([family.hull(low, high)[1] for family in perturbed], axis=0)
    counts, modified = setup.camera.mosaic.counts, list(setup.camera.modified)
    qe, grid = setup.camera.qe.copy(), setup.camera.grid
    qe[modified] = top
    yield SENSITIVITY, float(grid.integrate(top).sum() / grid.integrate(setup.camera.base_qe).sum())
    yield CFA_SENSITIVITY, float(cfa_sensitivity(grid.integrate(qe), counts, grid.integrate(setup.camera.clear_qe)))
    for name, rows in space.filter.family.dimensions.items():
        yield name, float(np.maximum(rows * low, rows * high).sum(axis=1).min())
