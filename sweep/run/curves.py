"""What a report draws besides the rows: curves of sensor, lights and filters, and the points of the signals."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa

from ..results.curves import FilterCurves, KeptCurves
from ..results.designs import row_curves, row_space
from ..search.limit import Limit
from ..study import Study
from .looks import Look

if TYPE_CHECKING:
    import pandas as pd


def kept_curves(study: Study, rows: pd.DataFrame, on_front: pd.DataFrame, limit: Limit | None) -> KeptCurves:
    """Curves of the sensor, the lights, own tasks' files, the drawn designs, those rows of the front that are not drawn
    anyway, the limit.
    """
    drawn = _drawn(study, rows)
    lights = zip(study.lights.types, study.lights.names, study.lights.photons, strict=True)
    limits = {}
    if limit is not None and limit.curve is not None and study.search is not None:
        limits[study.search.space.cfa] = limit.curve
    return KeptCurves(
        study.grid.nodes_nm,
        dict(study.sensor.qe),
        {(kind, name): values for kind, name, values in lights},
        _channels(study, drawn),
        _channels(study, _others(on_front, drawn)),
        limits,
        {} if study.tasks is None else dict(study.tasks.from_files),
    )


def _channels(study: Study, rows: Sequence[Mapping[Hashable, Any]]) -> dict[int, FilterCurves]:
    found = {}
    for row in rows:
        space, curves = row_curves(study, row)
        channels = () if space.filter is None else space.filter.channels
        found[int(row["design_id"])] = dict(zip(channels, curves[0], strict=True))
    return found


def points_table(study: Study, rows: pd.DataFrame, on_front: pd.DataFrame, looks: Mapping[int, Look]) -> pa.Table:
    """Digital numbers of every signal in every channel of the drawn designs and those on the front, a row each."""
    text, number = pa.string(), pa.float64()
    schema = pa.schema(
        [("design_id", pa.int64()), ("signal_type", text), ("signal", text), ("channel", text), ("dn", number)]
    )
    drawn = _drawn(study, rows)
    found = [schema.empty_table()]
    for row in [*drawn, *_others(on_front, drawn)]:
        response = looks[int(row["design_id"])].dn
        assert response is not None
        signals, channels = response.shape
        columns = (
            np.full(response.size, row["design_id"]),
            np.repeat(study.lights.types, channels),
            np.repeat(study.lights.names, channels),
            np.tile(study.setup(row_space(study, row), row["scenario"]).camera.mosaic.channels, signals),
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
