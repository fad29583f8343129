"""What a report draws besides the rows: curves of sensor, lights and filters, and the points of the signals."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pyarrow as pa

from ..imaging import imager_of
from ..limit import Limit
from ..spaces import Space
from ..study import Study

BEST_PER_CFA = 5
"""Best feasible designs of each CFA's sweeps that the report lists and draws."""


def curves_table(study: Study, table: pa.Table, limit: Limit | None) -> pa.Table:
    """Columns `wavelength_nm`, `qe:<curve>`, `light:<type>:<name>`, `design:<design_id>:<k>`, `limit:<cfa>`."""
    columns: dict[str, Any] = {"wavelength_nm": study.grid.nodes_nm}
    columns |= {f"qe:{name}": values for name, values in study.sensor.qe.items()}
    lights = zip(study.lights.types, study.lights.names, study.lights.photons, strict=True)
    columns |= {f"light:{kind}:{name}": values for kind, name, values in lights}
    for row in drawn_rows(study, table):
        for index, curve in enumerate(row_curves(study, row)[1][0]):
            columns[f"design:{row['design_id']}:{index}"] = curve
    if limit is not None and limit.curve is not None and study.search is not None:
        columns[f"limit:{study.search.space.cfa}"] = limit.curve
    return pa.table(columns)


def points_table(study: Study, table: pa.Table) -> pa.Table:
    """Digital numbers of every signal in every channel of the drawn designs, a row each."""
    found: list[dict[str, Any]] = []
    for row in drawn_rows(study, table):
        space, curves = row_curves(study, row)
        setup = study.setup(space, row["scenario"])
        response = imager_of(setup).read(curves)[0][0, 0]
        for signal, (kind, name) in enumerate(zip(study.lights.types, study.lights.names, strict=True)):
            for channel, values in zip(setup.mosaic.channels, response.T, strict=True):
                found.append(
                    {
                        "design_id": row["design_id"],
                        "signal_type": kind,
                        "signal": name,
                        "channel": channel,
                        "dn": float(values[signal]),
                    }
                )
    return pa.Table.from_pylist(found)


def drawn_rows(study: Study, table: pa.Table) -> list[dict[str, Any]]:
    """The search's answer, and in the first scenario plain CFAs, named designs and the best of each CFA's sweeps."""
    frame = table.to_pandas()
    frame = frame[(frame["scenario"] == next(iter(study.scenarios))) | (frame["kind"] == "search")]
    named = frame[frame["kind"].isin(["reference", "design", "search"])]
    swept = frame[(frame["kind"] == "sweep") & frame["feasible"]]
    best = swept.sort_values([study.objective.column, *study.trade_off], ascending=False).groupby("cfa", observed=True)
    rows: list[dict[str, Any]] = [*named.to_dict("records"), *best.head(BEST_PER_CFA).to_dict("records")]
    return rows


def row_space(study: Study, row: Mapping[Any, Any]) -> Space:
    """The space that a row belongs to."""
    if row["kind"] == "search":
        assert study.search is not None
        return study.search.space
    within = row["design_id"] % sum(space.size for space in study.spaces)  # ids run through the spaces of each scenario
    ends = np.cumsum([space.size for space in study.spaces])
    return study.spaces[int(np.searchsorted(ends, within, side="right"))]


def row_curves(study: Study, row: dict[str, Any]) -> tuple[Space, Any]:
    """The space that a row belongs to and its filters' curves, ndarray[1, n_modified, n_wavelengths]."""
    space = row_space(study, row)
    point = np.array([[row[name] for name in space.parameters]], dtype=float)
    return space, space.curves(point, study.grid.size)
