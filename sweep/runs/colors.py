"""Colors of a study with the task `color`: error against noise, and areas of two pictures, for each named design."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa

from ..base.types import Array, Float
from ..results.tables import CHART, NIGHT
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
_NUMBERS = pa.list_(pa.float64())
_RENDERED = pa.schema(
    [*_DESIGN, ("picture", pa.string()), ("area", pa.string()), ("xyz", _NUMBERS), ("covariance", _NUMBERS)]
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


def rendered_table(study: Study, highlights: pd.DataFrame) -> pa.Table:
    """Compute the areas of two pictures: the chart in daylight, and a night scene under white LEDs.

    Returns one row per design, picture and area. Those of the eye itself have no design.
    """
    from ..metrics.tasks.evaluation import rendered_areas  # noqa: PLC0415
    from ..spectra.builtin.task_sets import NIGHT_LIGHT, NIGHT_LX, night_scene  # noqa: PLC0415  (few studies have tasks)
    from ..spectra.color import color_matching  # noqa: PLC0415
    from ..spectra.spectrum import energy_from_photons  # noqa: PLC0415

    tasks = study.tasks
    assert tasks is not None
    cases, chart = _chart_of(tasks)
    day, night = cases.index("d65"), cases.index(NIGHT_LIGHT)
    streets = night_scene(study.grid)
    street = np.stack(list(streets.values()))
    white = chart.gray[night] / 0.18 * NIGHT_LX
    lamp_xyz = [
        energy_from_photons(study.grid.nodes_nm, photons) @ color_matching(study.grid).T for photons in (street, white)
    ]
    names = [str(number) for number in range(1, len(chart.xyz[day]) + 1)]
    rows = _areas({}, CHART, names, chart.xyz[day] / chart.white[day]) + _areas(
        {}, NIGHT, streets, lamp_xyz[0] / lamp_xyz[1]
    )
    dark = replace(tasks.conditions, illuminance_lx=NIGHT_LX)
    for design, patch_camera in _shown(study, highlights):
        patches = chart.photons[day] * tasks.conditions.illuminance_lx
        rows += _areas(design, CHART, names, *rendered_areas(patch_camera, chart, day, patches, tasks.conditions))
        rows += _areas(design, NIGHT, streets, *rendered_areas(patch_camera, chart, night, street, dark))
    return pa.Table.from_pylist(rows, schema=_RENDERED)


def _areas(
    design: dict[str, Any],
    picture: str,
    names: Any,
    xyz: Float[Array, "colors 3"],
    covariance: Float[Array, "colors _ _"] | None = None,
) -> list[dict[str, Any]]:
    """Return the rows of a picture; without a covariance there is no noise."""
    spread = np.zeros((len(xyz), 3, 3)) if covariance is None else covariance
    return [
        design | {"picture": picture, "area": area, "xyz": color.tolist(), "covariance": noise.ravel().tolist()}
        for area, color, noise in zip(names, xyz, spread, strict=True)
    ]
