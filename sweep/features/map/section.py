"""Key `search.map` of a study."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Annotated

from pydantic import Field

from ...base.errors import Fault, unknown
from ...base.types import Section
from ...designs.family import ChoosingFamily
from ...study.axes import Values

if TYPE_CHECKING:
    from ...study import Study, StudySection
    from ...study.checks import Checked

_MOST_OF_AXIS = 200
"""Values of one parameter of a map."""


class Keys(Section):
    """Keys of a search."""

    map: Annotated[dict[str, Values], Field(min_length=2, max_length=2)] | None = None
    """Two parameters and their values: the best objective at each pair of values, with all others free."""


KEYS = {"SearchSection": Keys}


def axes_of(section: StudySection) -> Mapping[str, tuple[float, ...]]:
    """Return the two parameters of a map with their values; nothing where none is asked."""
    asked = None if section.search is None else section.search.key("map")
    return {} if asked is None else {name: axis.points() for name, axis in asked.items()}


def map_of(study: Study) -> Mapping[str, tuple[float, ...]]:
    """Return the two parameters of a study's map with their values."""
    return axes_of(study.section)


def faults(checked: Checked) -> Iterator[Fault]:
    """Check that a map is of one search's parameters, inside its box, and leaves one of them free."""
    search = checked.search
    asked = None if checked.section.search is None else checked.section.search.key("map")
    if search is None or asked is None:
        return
    if search.tiles:
        yield Fault(("search", "map"), "of one tile, and the search is over several", None, "a box with a `cfa`")
    if len(search.scenarios) > 1:
        yield Fault(("search", "map"), "of one scenario, and the search is over several", None, "one `scenario`")
    space = search.space
    assert space.filter is not None
    ends = {name: (min(axis), max(axis)) for name, axis in zip(space.parameters, space.axes, strict=True)}
    for name, axis in asked.items():
        path = "search", "map", name
        if name not in ends:
            yield unknown(path, "parameter", name, ends)
        elif isinstance(space.filter.family, ChoosingFamily) and space.filter.family.slots:
            yield Fault(path, "a map has no choice from a catalog", space.name, "a box of another family")
        elif axis.size > _MOST_OF_AXIS:
            yield Fault(path, "too many values", axis.size, f"at most {_MOST_OF_AXIS}")
        elif min(axis.points()) < ends[name][0] or max(axis.points()) > ends[name][1]:
            shown = f"{min(axis.points()):g} to {max(axis.points()):g}"
            yield Fault(path, "outside the box", shown, "{:g} to {:g}".format(*ends[name]))
    if not any(low < high for name, (low, high) in ends.items() if name not in asked):
        yield Fault(("search", "space"), "every parameter is fixed", space.name, "one free parameter or more")
