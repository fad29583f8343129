"""Tables that are made of the rows that a report can show: which a study asks for, and how each is made."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ..base.types import IndexArray, Parallel, Progress
from ..results.tables import (
    CROSSINGS,
    CURVES,
    LIMITED_BY,
    POINTS,
    RECOGNITION,
    REGIONS_MAP,
    RENDERED,
    ROBUSTNESS,
    SENSOR_MAP,
    TRADED,
    VALIDATED,
)
from ..search.limit import Limit
from ..study import Study
from ..study.axes import series_of
from .colors import rendered_table, traded_table
from .crossings import crossings_table
from .curves import kept_curves, points_table
from .held_out import held_out_table
from .limiting import limited_by_table
from .looks import Look
from .recognition import recognition_table

if TYPE_CHECKING:
    import pandas as pd
    import pyarrow as pa


@dataclass(frozen=True)
class Shown:
    """Rows that a report can show, and those `on_front` of them; `limit`: of a search.

    `looks`: at them, by their ids; `points`: ids of the swept designs that figures show as points, ndarray[n_points];
    `kept`: calls whose results are kept as parts under a name.
    """

    study: Study
    rows: pd.DataFrame
    on_front: pd.DataFrame
    looks: Mapping[int, Look]
    points: IndexArray
    limit: Callable[[], Limit | None]
    parallel: Parallel
    kept: Callable[[str], Parallel]
    progress: Progress


@dataclass(frozen=True)
class RowTable:
    """A table: whether a study asks for it, and what it holds."""

    asked: Callable[[Study], bool]
    made: Callable[[Shown], pa.Table]


def _always(_: Study) -> bool:
    return True


def _curves(shown: Shown) -> pa.Table:
    return kept_curves(shown.study, shown.rows, shown.on_front, shown.limit()).table()


def _robustness(shown: Shown) -> pa.Table:
    from .robustness import robustness_table  # noqa: PLC0415  (only where lights have a population)

    return robustness_table(shown.study, shown.rows, shown.kept("robustness"), shown.progress)


def _regions(shown: Shown) -> pa.Table:
    from .allowed_lamps import regions_table  # noqa: PLC0415  (only where a study asks for it)

    return regions_table(shown.study, shown.rows, shown.parallel, shown.progress)


def _sensor_map(shown: Shown) -> pa.Table:
    from .sensor_map import sensor_map_table  # noqa: PLC0415  (only where a scene has places of the sensor)

    return sensor_map_table(shown.study, shown.rows, shown.parallel, shown.progress)


def _has_crossings(study: Study) -> bool:
    return study.section.recognition is not None and bool(series_of(study.scenarios))


def _has_patches(study: Study) -> bool:
    return study.section.recognition is not None and bool(study.section.recognition.patches)


def _has_colors(study: Study) -> bool:
    return study.tasks is not None and "color" in study.tasks.by_name


ROW_TABLES = {
    CURVES: RowTable(_always, _curves),
    POINTS: RowTable(_always, lambda s: points_table(s.study, s.rows, s.on_front, s.looks)),
    LIMITED_BY: RowTable(_always, lambda s: limited_by_table(s.study, s.looks, s.points, s.parallel, s.progress)),
    VALIDATED: RowTable(
        lambda study: study.held_out is not None,
        lambda s: held_out_table(s.study, s.rows, s.on_front, s.parallel, s.progress),
    ),
    ROBUSTNESS: RowTable(lambda study: study.pair_over_population is not None, _robustness),
    REGIONS_MAP: RowTable(lambda study: study.section.regions is not None, _regions),
    SENSOR_MAP: RowTable(lambda study: any(s.field is not None for s in study.scenarios.values()), _sensor_map),
    CROSSINGS: RowTable(
        _has_crossings,
        lambda s: crossings_table(s.study, s.rows, s.parallel, s.progress),
    ),
    RECOGNITION: RowTable(_has_patches, lambda s: recognition_table(s.study, s.rows, s.looks)),
    TRADED: RowTable(_has_colors, lambda s: traded_table(s.study, s.rows)),
    RENDERED: RowTable(_has_colors, lambda s: rendered_table(s.study, s.rows)),
}
"""By the names of their files, in the order in which they are made."""
