"""What a report draws besides the rows: curves of sensor, lights and filters, and the points of the signals."""

from __future__ import annotations

from typing import Any

import numpy as np
import pyarrow as pa

from ..imaging import imager_of
from ..limit import Limit
from ..spaces import Space
from ..study import Study
from .jobs import jobs_of

BEST_PER_CFA = 5
"""Best feasible designs of each CFA's sweeps that the report lists and draws."""


def curves_table(study: Study, table: pa.Table, limit: Limit | None) -> pa.Table:
    """Columns `wavelength_nm`, `qe:<curve>`, `light:<type>:<name>`, `design:<design_id>:<k>`, `limit:<cfa>`."""
    columns: dict[str, Any] = {"wavelength_nm": study.grid.nodes_nm}
    columns |= {f"qe:{name}": values for name, values in study.sensor.qe.items()}
    lights = zip(study.lights.types, study.lights.names, study.lights.photons, strict=True)
    columns |= {f"light:{kind}:{name}": values for kind, name, values in lights}
    for row in drawn_rows(study, table):
        for index, curve in enumerate(_row_curves(study, row)[1][0]):
            columns[f"design:{row['design_id']}:{index}"] = curve
    if limit is not None and limit.curve is not None and study.search is not None:
        columns[f"limit:{study.search.space.cfa}"] = limit.curve
    return pa.table(columns)


def points_table(study: Study, table: pa.Table) -> pa.Table:
    """Digital numbers of every signal in every channel of the drawn designs, a row each."""
    found: list[dict[str, Any]] = []
    for row in drawn_rows(study, table):
        space, curves = _row_curves(study, row)
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
    """Plain CFAs, named designs, the search's answer and the best feasible designs of each CFA's sweeps."""
    frame = table.to_pandas()
    named = frame[frame["kind"].isin(["reference", "design", "search"])]
    swept = frame[(frame["kind"] == "sweep") & frame["feasible"]]
    best = swept.sort_values([study.objective.column, *study.trade_off], ascending=False).groupby("cfa", observed=True)
    rows: list[dict[str, Any]] = [*named.to_dict("records"), *best.head(BEST_PER_CFA).to_dict("records")]
    return rows


def _row_curves(study: Study, row: dict[str, Any]) -> tuple[Space, Any]:
    """The space that a row belongs to and its filters' curves, ndarray[1, n_modified, n_wavelengths]."""
    if row["kind"] == "search":
        assert study.search is not None
        space = study.search.space
    else:  # ids run through the spaces of each scenario
        at = row["design_id"]
        space = next(j.space for j in jobs_of(study) if j.first_id <= at < j.first_id + j.stop - j.start)
    point = np.array([[row[name] for name in space.parameters]], dtype=float)
    return space, space.curves(point, study.grid.size)
