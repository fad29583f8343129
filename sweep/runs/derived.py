"""Tables derived from the rows that a report shows."""

from __future__ import annotations

from itertools import chain
from typing import Any

import numpy as np
import pyarrow as pa

from ..features import modules
from ..results.curves import FilterCurves, KeptCurves
from ..results.designs import row_curves, row_space
from ..results.tables import CURVES, LIMITED_BY, POINTS
from ..study import Study
from .analysis import RunTable, Shown
from .crossings import RANGES
from .details import limited_by_table
from .handovers import CAPTURES_FULL
from .saturated import SATURATION
from .worst import WORST_VALUES

_POINTS = pa.schema(
    [("design_id", pa.int64())]
    + [(name, pa.string()) for name in ("signal_type", "signal", "channel")]
    + [("dn", pa.float64())]
)


def row_tables(study: Study) -> dict[str, RunTable]:
    """Return the tables beside the rows that a study asks for, by their files' names."""
    of_features = chain.from_iterable(module.TABLES for module in modules("tables"))
    return {table.name: table for table in (*_TABLES, *of_features) if table.asked(study)}


def _curves_table(shown: Shown) -> pa.Table:
    """Return the curves of sensor, lights, drawn designs, front and upper bound."""
    study, limit = shown.study, shown.limit()
    lights = zip(study.lights.types, study.lights.names, study.lights.photons, strict=True)
    limits = {}
    if limit is not None and limit.curve is not None and study.search is not None:
        limits[study.search.space.cfa] = limit.curve
    return KeptCurves(
        study.grid.nodes_nm,
        dict(study.sensor.qe),
        {(kind, name): values for kind, name, values in lights},
        _filters(study, shown.drawn),
        _filters(study, shown.other_front),
        limits,
        {} if study.colorants is None else dict(zip(study.colorants.names, study.colorants.absorbance, strict=True)),
    ).table()


def _filters(study: Study, rows: list[dict[Any, Any]]) -> dict[int, FilterCurves]:
    """Return the QE of the modified channels of designs."""
    filters = {}
    for row in rows:
        space, curves = row_curves(study, row)
        channels = () if space.filter is None else space.filter.channels
        filters[int(row["design_id"])] = dict(zip(channels, curves[0], strict=True))
    return filters


def _points_table(shown: Shown) -> pa.Table:
    """Return the digital numbers of each signal in each channel of drawn designs and the front."""
    lights, parts = shown.study.lights, [_POINTS.empty_table()]
    for row in [*shown.drawn, *shown.other_front]:
        dn = shown.details[int(row["design_id"])].dn
        assert dn is not None
        signals, channels = dn.shape
        mosaic = shown.study.setup(row_space(shown.study, row), row["scenario"]).camera.mosaic
        columns = (
            np.full(dn.size, row["design_id"]),
            np.repeat(lights.types, channels),
            np.repeat(lights.names, channels),
            np.tile(mosaic.channels, signals),
            dn.ravel(),
        )
        arrays = [pa.array(values, type=kind) for values, kind in zip(columns, _POINTS.types, strict=True)]
        parts.append(pa.Table.from_arrays(arrays, schema=_POINTS))
    return pa.concat_tables(parts).combine_chunks()


_TABLES = (
    RunTable(CURVES, lambda _: True, _curves_table),
    RunTable(POINTS, lambda _: True, _points_table),
    RunTable(LIMITED_BY, lambda _: True, limited_by_table),
    SATURATION,
    CAPTURES_FULL,
    WORST_VALUES,
    RANGES,
)
