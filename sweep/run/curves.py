"""What a report draws besides the rows: curves of sensor, lights and filters, and the points of the signals."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa

from ..camera.imager import imager_of
from ..designs.space import Space
from ..search.limit import Limit
from ..study import Study


def curves_table(study: Study, rows: pd.DataFrame, on_front: pd.DataFrame, limit: Limit | None) -> pa.Table:
    """Columns `wavelength_nm`, `qe:<curve>`, `light:<type>:<name>`, `design:<design_id>:<k>`, `front:<design_id>:<k>`
    of those rows of the front that are not drawn anyway, `limit:<cfa>`.
    """
    columns: dict[str, Any] = {"wavelength_nm": study.grid.nodes_nm}
    columns |= {f"qe:{name}": values for name, values in study.sensor.qe.items()}
    lights = zip(study.lights.types, study.lights.names, study.lights.photons, strict=True)
    columns |= {f"light:{kind}:{name}": values for kind, name, values in lights}
    drawn = _drawn(study, rows)
    for what, some in (("design", drawn), ("front", _others(on_front, drawn))):
        for row in some:
            for index, curve in enumerate(row_curves(study, row)[1][0]):
                columns[f"{what}:{row['design_id']}:{index}"] = curve
    if limit is not None and limit.curve is not None and study.search is not None:
        columns[f"limit:{study.search.space.cfa}"] = limit.curve
    return pa.table(columns)


def points_table(study: Study, rows: pd.DataFrame, on_front: pd.DataFrame) -> pa.Table:
    """Digital numbers of every signal in every channel of the drawn designs and those on the front, a row each."""
    text, number = pa.string(), pa.float64()
    schema = pa.schema(
        [("design_id", pa.int64()), ("signal_type", text), ("signal", text), ("channel", text), ("dn", number)]
    )
    drawn = _drawn(study, rows)
    found = [schema.empty_table()]
    for row in [*drawn, *_others(on_front, drawn)]:
        space, curves = row_curves(study, row)
        setup = study.setup(space, row["scenario"])
        response = imager_of(setup).read(curves)[0][0, 0]
        signals, channels = response.shape
        columns = (
            np.full(response.size, row["design_id"]),
            np.repeat(study.lights.types, channels),
            np.repeat(study.lights.names, channels),
            np.tile(setup.mosaic.channels, signals),
            response.ravel(),
        )
        arrays = [pa.array(values, type=kind) for values, kind in zip(columns, schema.types, strict=True)]
        found.append(pa.Table.from_arrays(arrays, schema=schema))
    return pa.concat_tables(found).combine_chunks()


def _others(rows: pd.DataFrame, drawn: Sequence[Mapping[Hashable, Any]]) -> list[dict[Hashable, Any]]:
    """Rows that are not drawn already."""
    return rows[~rows["design_id"].isin([row["design_id"] for row in drawn])].to_dict("records")


def _drawn(study: Study, rows: pd.DataFrame) -> list[dict[Hashable, Any]]:
    """Of the highlights those in the first scenario, and the search's answer.

    Not those that failed: what killed a worker would kill this process.
    """
    first = (rows["scenario"] == next(iter(study.scenarios))) | (rows["kind"] == "search")
    shown = rows[first & (rows["status"] == "ok")]
    return shown.to_dict("records")


def row_space(study: Study, row: Mapping[Any, Any]) -> Space:
    """The space that a row belongs to."""
    if row["kind"] == "search":
        assert study.search is not None
        return study.search.space
    within = row["design_id"] % sum(space.size for space in study.spaces)  # ids run through the spaces of each scenario
    ends = np.cumsum([space.size for space in study.spaces])
    return study.spaces[int(np.searchsorted(ends, within, side="right"))]


def row_curves(study: Study, row: Mapping[Any, Any]) -> tuple[Space, Any]:
    """The space that a row belongs to and its filters' curves, ndarray[1, n_modified, n_wavelengths]."""
    space = row_space(study, row)
    point = np.array([[row[name] for name in space.parameters]], dtype=float)
    return space, space.curves(point, study.grid.size)
