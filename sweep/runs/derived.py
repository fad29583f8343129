"""Tables derived from the rows that a report shows."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa

from ..base.types import IndexArray, Int, Parallel, Progress
from ..results.curves import FilterCurves, KeptCurves
from ..results.designs import computed_rows, row_curves, row_space
from ..results.tables import (
    CROSSINGS,
    CURVES,
    HANDOVERS,
    LAMP_LIMITS,
    LIMITED_BY,
    POINTS,
    REGIONS_MAP,
    ROBUSTNESS,
    SATURATED,
    SEARCHED,
    SENSOR_MAP,
    TRADED,
    UNCERTAINTY,
    WORST,
    YIELDS,
)
from ..search.upper_bound import UpperBound
from ..study import Study
from .allowed_lamps import ALLOWED_LAMPS
from .analysis import Analysis
from .colors import error_against_noise_table
from .crossings import RANGES
from .details import OVER_SENSOR, Details, limited_by_table
from .handovers import CAPTURES_FULL
from .moved_lamps import MOVED_LAMPS
from .robustness import ROBUST
from .saturated import SATURATION
from .uncertainty import uncertainty_table
from .worst import WORST_VALUES
from .yields import JUDGED_YIELDS

if TYPE_CHECKING:
    import pandas as pd

_POINTS = pa.schema(
    [("design_id", pa.int64())]
    + [(name, pa.string()) for name in ("signal_type", "signal", "channel")]
    + [("dn", pa.float64())]
)


@dataclass(frozen=True)
class DerivedInput:
    """Input of the derived tables."""

    study: Study
    rows: pd.DataFrame
    on_front: pd.DataFrame
    details: Mapping[int, Details]
    points: Int[IndexArray, " points"]
    limit: Callable[[], UpperBound | None]
    parallel: Parallel
    kept: Callable[[str], Parallel]
    progress: Progress

    @property
    def drawn(self) -> list[dict[Any, Any]]:
        """Rows of the first scenario and the search's answer, without those that failed."""
        first = self.rows["scenario"] == next(iter(self.study.scenarios))
        return computed_rows(self.rows[first | (self.rows["kind"] == SEARCHED)])

    @property
    def other_front(self) -> list[dict[Any, Any]]:
        """Rows on the front that are not drawn."""
        ids = [row["design_id"] for row in self.drawn]
        return computed_rows(self.on_front[~self.on_front["design_id"].isin(ids)])


_ANALYSES = {
    SATURATED: SATURATION,
    ROBUSTNESS: ROBUST,
    YIELDS: JUDGED_YIELDS,
    REGIONS_MAP: ALLOWED_LAMPS,
    LAMP_LIMITS: MOVED_LAMPS,
    SENSOR_MAP: OVER_SENSOR,
    HANDOVERS: CAPTURES_FULL,
    WORST: WORST_VALUES,
    CROSSINGS: RANGES,
}


def row_tables(study: Study) -> dict[str, Callable[[DerivedInput], pa.Table]]:
    """Return the derived tables of a study."""

    def made(analysis: Analysis) -> Callable[[DerivedInput], pa.Table]:
        return lambda s: analysis.table(
            s.study, s.rows, s.kept(analysis.phase) if analysis.is_kept else s.parallel, s.progress
        )

    tables: dict[str, Callable[[DerivedInput], pa.Table]] = {
        CURVES: _curves_table,
        POINTS: _points_table,
        LIMITED_BY: lambda s: limited_by_table(s.study, s.details, s.points, s.parallel, s.progress),
        **{name: made(analysis) for name, analysis in _ANALYSES.items() if analysis.asked(study)},
    }
    if study.section.uncertainty is not None:
        tables[UNCERTAINTY] = lambda s: uncertainty_table(s.study, s.rows, s.parallel, s.progress)
    if study.tasks is not None and "color" in study.tasks.by_name:
        tables[TRADED] = lambda s: error_against_noise_table(s.study, s.rows)
    return tables


def _curves_table(shown: DerivedInput) -> pa.Table:
    """Return the curves of sensor, lights, files of user tasks, drawn designs, front and upper bound."""
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
        {} if study.tasks is None else dict(study.tasks.from_files),
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


def _points_table(shown: DerivedInput) -> pa.Table:
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
