"""Colors of a study with the task `color`: error against noise for each named design."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import pyarrow as pa

from ..spectra.tasks import Chart, StudyTasks
from ..study import Study
from .analysis import named_designs

if TYPE_CHECKING:
    import pandas as pd

_KEYS = ("design_id", "name", "scenario")
_DESIGN = [("design_id", pa.int64()), ("name", pa.string()), ("scenario", pa.string())]
_TRADED = pa.schema(
    [*_DESIGN, ("light", pa.string()), *((name, pa.float64()) for name in ("regularization", "delta_e_mean", "snr"))]
)


def _shown(study: Study, highlights: pd.DataFrame) -> Iterator[tuple[dict[str, Any], Any]]:
    """Yield keys and colors of plain CFAs, named designs and the answer."""
    from ..metrics.tasks.color import PatchCamera  # noqa: PLC0415  (few studies have tasks)

    for design in named_designs(study, highlights):
        yield {key: design.row[key] for key in _KEYS}, PatchCamera(design.setup, design.curves)


def _chart_of(tasks: StudyTasks) -> tuple[tuple[str, ...], Chart]:
    task = tasks.by_name["color"]
    assert task.chart is not None
    return task.columns.lights, task.chart


def error_against_noise_table(study: Study, highlights: pd.DataFrame) -> pa.Table:
    """Compute color error against noise.

    Returns one row per design, light and regularization of the color matrix.
    """
    from ..metrics.tasks.evaluation import REGULARIZATIONS, error_against_noise  # noqa: PLC0415  (few studies have tasks)

    assert study.tasks is not None
    cases, chart = _chart_of(study.tasks)
    rows = []
    for design, patch_camera in _shown(study, highlights):
        for at, case in enumerate(cases):
            traded_off = error_against_noise(patch_camera, chart, at, study.tasks.conditions)
            for regularization, delta_e, snr in zip(REGULARIZATIONS, *traded_off, strict=True):
                values = {"light": case, "regularization": float(regularization), "delta_e_mean": delta_e, "snr": snr}
                rows.append(design | values)
    return pa.Table.from_pylist(rows, schema=_TRADED)
