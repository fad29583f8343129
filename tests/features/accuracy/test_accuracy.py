"""`sweep accuracy`: error and time of presets and of steps."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from sweep.features.accuracy.accuracy import measure_accuracy
from sweep.runs.dry_run import spread
from sweep.study import Study, load_study

from ...build import stopband_study

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
@pytest.mark.slow
def test_presets_are_measured_in_every_scene(tmp_path: Path) -> None:
    path = tmp_path / "two.yaml"
    path.write_text(TWO_SCENES)

    def at_step(step_nm: float | None) -> Study:
        return load_study(path, changes={"wavelengths.step_nm": step_nm} if step_nm else {})

    measure_accuracy(at_step, tmp_path, lambda *_: None, steps_nm=[10.0])
    table = pd.read_parquet(tmp_path / "accuracy.parquet").set_index(["scenario", "setting"])
    names = ("10 nm", "standard", "reference")
    assert list(table.index) == [(scene, name) for scene in ("chart", "anywhere") for name in names]
    error_dn = table["error_dn"].unstack("setting")
    assert (error_dn["reference"] == 0).all()
    assert (error_dn["10 nm"] > error_dn["standard"]).all()
    assert error_dn.loc["anywhere", "standard"] > error_dn.loc["chart", "standard"]
    assert (table["designs"] == 2).all()
    assert (tmp_path / "accuracy.png").is_file()


def test_every_beginning_of_the_designs_is_spread_over_all() -> None:
    order = spread(42)
    assert order[0] == 0
    assert sorted(order) == list(range(42))
    for n in range(2, 42):
        gaps = np.diff([*sorted(order[:n]), 42])
        assert gaps.max() <= 3 * 42 / n
