"""From a row of the result table back to its design."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ..designs.space import Space
from ..study import Study

if TYPE_CHECKING:
    import pandas as pd


def row_space(study: Study, row: Mapping[Any, Any]) -> Space:
    """The space that a row belongs to."""
    if row["kind"] == "search":
        assert study.search is not None
        return study.search.space
    within = row["design_id"] % sum(space.size for space in study.spaces)  # ids run through the spaces of each scenario
    ends = np.cumsum([space.size for space in study.spaces])
    return study.spaces[int(np.searchsorted(ends, within, side="right"))]


def computed_rows(*tables: pd.DataFrame) -> list[dict[Any, Any]]:
    """The rows of tables, each design once; not those that failed."""
    rows: dict[Any, dict[Any, Any]] = {}
    for table in tables:
        for row in table[table["status"] == "ok"].to_dict("records"):
            rows.setdefault(row["design_id"], row)
    return [*rows.values()]


def row_curves(study: Study, row: Mapping[Any, Any]) -> tuple[Space, Any]:
    """The space that a row belongs to and its filters' curves, ndarray[1, n_modified, n_wavelengths]."""
    space = row_space(study, row)
    point = np.array([[row[name] for name in space.parameters]], dtype=float)
    return space, space.curves(point, study.grid.size)
