"""`sweep accuracy`: error and time of presets."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from sweep.report.accuracy import measure_accuracy
from sweep.runs.dry_run import spread
from sweep.study import load_study

from ..build import stopband_study

TWO_SCENES = stopband_study(
    "two",
    "{left_nm: [600, 610], left_width_nm: 20, right_nm: 650, right_width_nm: 10}",
    before="""\
wavelengths: {step_nm: 5}
pixel: {read_noise_e: 2, offset_dn: 168}
scenarios:
  chart: {}
  anywhere: {target: {distance_m: 250, fov_deg: 60, phase_px: any}, optics: {f_number: 2}, noise: true}
""",
)


@pytest.mark.long
def test_presets_are_measured_in_every_scene(tmp_path: Path) -> None:
    path, progress = tmp_path / "two.yaml", list[tuple[str, int, int]]()
    path.write_text(TWO_SCENES)
    measure_accuracy(load_study(path), tmp_path, lambda *call: progress.append(call), presets=["fast"])
    table = pd.read_parquet(tmp_path / "accuracy.parquet").set_index(["scenario", "preset"])
    assert list(table.index) == [(scene, name) for scene in ("chart", "anywhere") for name in ("fast", "reference")]
    assert (table["error_dn"].xs("reference", level="preset") == 0).all()
    assert table.loc[("anywhere", "fast"), "error_dn"] > table.loc[("chart", "fast"), "error_dn"]
    assert (table["total_s"] > table["first_s"]).all()
    assert (table["designs"] == 2).all()
    assert progress[0] == ("measurements", 0, 4)
    assert progress[-1] == ("measurements", 4, 4)
    assert (tmp_path / "accuracy.png").is_file()


def test_every_beginning_of_the_designs_is_spread_over_all() -> None:
    order = spread(42)
    assert order[0] == 0
    assert sorted(order) == list(range(42))
    for n in range(2, 42):
        gaps = np.diff([*sorted(order[:n]), 42])
        assert gaps.max() <= 3 * 42 / n
