"""The search of a study: where and how it searches, and what its objective and constraints must be."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ..camera.scene import WhitePatchExposure
from ..designs.space import Space
from ..metrics.quantity import Quantity
from ..search.solver import ALGORITHMS
from .axes import Axis
from .model import Search
from .schema import StudySection
from .sources import Sources


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
