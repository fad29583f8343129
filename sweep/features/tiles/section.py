"""Checks of a search over tiles; its keys are written out as CFAs and boxes (`written.py`)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from ...base.errors import Fault
from ...designs.family import ChoosingFamily

if TYPE_CHECKING:
    from ...study.checks import Checked


def faults(checked: Checked) -> Iterator[Fault]:
    """Check that a search over tiles is asked for what it has."""
    search, stated = checked.search, checked.section.search
    if search is None or stated is None or not search.tiles:
        return
    if stated.algorithm != "SLSQP":
        yield Fault(("search", "algorithm"), "of a search over tiles", stated.algorithm, "SLSQP")
    if any(space.filter is not None and isinstance(space.filter.family, ChoosingFamily) for space in search.tiles):
        name = stated.space or ""
        yield Fault(("search", "space"), "a search over tiles has no choice from a catalog", name, "another family")
    if len(search.scenarios) > 1:
        yield Fault(("search", "scenario"), "a search over tiles is in one scenario", None, search.scenario)
