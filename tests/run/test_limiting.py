"""The two lights that limit each CSD: of every swept design that a report draws, and of no other."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from sweep.camera.model import scene_model
from sweep.metrics.limiting import limiting_lights
from sweep.results.designs import row_curves
from sweep.results.tables import LIMITED_BY
from sweep.study import Study

from ..build import load, ran

STUDY = """
study: limits
sensor: ar0820
lights: tl16
pixel: {read_noise_e: 2}
scenarios:
  chart: {exposure: {kind: white_patch}}
  road: {target: {distance_m: 150, fov_deg: 60, phase_px: any}, optics: {f_number: 2}, noise: true}
cfas: [RGGB, RYNCy]
sweeps:
  edges:
    {cfa: RYNCy, channel: N, base: Y, to: G,
     grid: {left_nm: [590, 610, 630], left_width_nm: [5, 20], right_nm: [640, 650, 690], right_width_nm: 10}}
  drawn: {cfa: RYNCy, channel: N, base: Y, to: G, values: [VALUES]}
constraints:
  sensitivity: {min: 0.9}
"""
VALUES = ", ".join(
    f"{{left_nm: {580 + 6 * at}, left_width_nm: {4 + at}, right_nm: {690 - 5 * at}, right_width_nm: 8}}"
    for at in range(9)
)
STUDY = STUDY.replace("VALUES", VALUES)
N_SWEPT = 2 * (18 + 9)


@pytest.fixture
def study(tmp_path: Path) -> Study:
    return load(tmp_path, STUDY)


def rows_with_lights(folder: Path) -> pd.DataFrame:
    table = pd.read_parquet(folder / "results.parquet")
    return table.merge(pd.read_parquet(folder / LIMITED_BY), on="design_id", how="left")


def distances(study: Study, row: dict[str, Any]) -> Iterator[tuple[str, dict[str, float]]]:
    """Of each pair of types every pair of lights with its smallest distance over the cases, from the curves alone."""
    space, curves = row_curves(study, row)
    setup = study.setup(space, row["scenario"])
    cases = scene_model(setup).read(curves)[0][0]
    lights = list(zip(setup.lights.names, setup.lights.types, np.moveaxis(cases, 1, 0), strict=True))
    for one, other in study.pairs:
        found = {
            f"{a} / {b}": float(np.linalg.norm(u - v, axis=-1).min())
            for (a, kind, u), (b, different, v) in product(lights, lights)
            if (kind, different) == (one, other)
        }
        yield f"{one}_{other}", found


def test_every_swept_design_is_limited_by_its_nearest_lights(study: Study, tmp_path: Path) -> None:
    ran(study, tmp_path / "out", 1)
    rows = rows_with_lights(tmp_path / "out")
    swept = rows[rows["kind"] == "sweep"]
    assert len(swept) == N_SWEPT
    assert {*swept["feasible"]} == {True, False}
    for row in swept.to_dict("records"):
        for pair, apart in distances(study, row):
            assert apart[row[f"limited_by_{pair}"]] == pytest.approx(min(apart.values()), rel=1e-12)


def test_lights_without_a_distance_limit_nothing(study: Study) -> None:
    model = scene_model(study.setup(study.spaces[-1], "chart"))
    nothing = model.read(np.zeros((1, 1, study.grid.size)))[0] * np.nan
    assert {lights[0] for lights in limiting_lights(model.setup, nothing).values()} == {None}
