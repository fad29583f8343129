"""Colors of a study with the task `color`: error against noise for each named design."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import pyarrow as pa

from ...runs.analysis import RunTable, Shown, named_designs
from ...study import Study
from . import TRADED
from .spectra import Chart, StudyTasks

if TYPE_CHECKING:
    import pandas as pd

_KEYS = ("design_id", "name", "scenario")
_DESIGN = [("design_id", pa.int64()), ("name", pa.string()), ("scenario", pa.string())]
_TRADED = pa.schema(
    [*_DESIGN, ("light", pa.string()), *((name, pa.float64()) for name in ("regularization", "delta_e_mean", "snr"))]
)


def _designs(study: Study, highlights: pd.DataFrame) -> Iterator[tuple[dict[str, Any], Any]]:
    """Yield keys and colors of plain CFAs, named designs and the answer."""
    from .color import PatchCamera  # noqa: PLC0415  (few studies have tasks)

    for design in named_designs(study, highlights):
        yield {key: design.row[key] for key in _KEYS}, PatchCamera(design.setup, design.curves)


def tasks_of(study: Study) -> StudyTasks | None:
    """Return the tasks of a study."""
    tasks = study.features.get("tasks")
    return tasks if isinstance(tasks, StudyTasks) else None


def _asked(study: Study) -> bool:
    tasks = tasks_of(study)
    return tasks is not None and "color" in tasks.by_name


def _chart_of(tasks: StudyTasks) -> tuple[tuple[str, ...], Chart]:
    task = tasks.by_name["color"]
    assert task.chart is not None
    return task.columns.lights, task.chart


def _table(shown: Shown) -> pa.Table:
    """Compute color error against noise.

    Returns one row per design, light and regularization of the color matrix.
    """
    from .evaluation import REGULARIZATIONS, error_against_noise  # noqa: PLC0415  (few studies have tasks)

    tasks = tasks_of(shown.study)
    assert tasks is not None
    cases, chart = _chart_of(tasks)
    rows = []
    for design, patch_camera in _designs(shown.study, shown.rows):
        for at, case in enumerate(cases):
            traded_off = error_against_noise(patch_camera, chart, at, tasks.conditions)
            for regularization, delta_e, snr in zip(REGULARIZATIONS, *traded_off, strict=True):
                values = {"light": case, "regularization": float(regularization), "delta_e_mean": delta_e, "snr": snr}
                rows.append(design | values)
    return pa.Table.from_pylist(rows, schema=_TRADED)


TABLES = (RunTable(TRADED, _asked, _table),)
