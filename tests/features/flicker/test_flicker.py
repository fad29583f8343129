"""Flicker of a pulsed lamp: captures one after the other show a false hue."""

from __future__ import annotations

import pytest

from sweep.camera.model import scene_model
from sweep.camera.pixel import Pixel
from sweep.camera.scene import FixedExposure, PwmDrive, Scene
from sweep.metrics.evaluate import evaluate

from ...camera.test_captures import chart_setup


def test_staggered_exposures_show_a_false_hue_and_a_split_pixel_none() -> None:
    scene = Scene(
        exposure=FixedExposure(exposure_s=0.011),
        intensity_cd=50.0,
        drive=PwmDrive(duty=0.1, frequency_hz=200.0),
        noise=True,
    )
    found = {}
    for captures in ("split_pixel", "staggered"):
        setup = chart_setup(scene=scene, pixel=Pixel(captures=captures, read_noise_e=2, offset_dn=64))
        found[captures] = evaluate(scene_model(setup), setup.camera.base_qe[None])
    assert found["split_pixel"]["false_hue_dn"] < 0.1 * found["split_pixel"]["chromatic_csd_yellow_red"]
    assert found["split_pixel"]["lamp_seen"] == pytest.approx(1)
    assert found["staggered"]["false_hue_dn"] > 1_000
    assert found["staggered"]["lamp_seen"] < 0.5
    assert found["staggered"]["flicker_modulation"] == pytest.approx(1)
