"""The forward model against a full run of ISETCam: another program, written by others.

Known differences: ISETCam's ADC scales by 4096 and saturates at 4096 (ours is given that gain, and saturates at 4095);
its `skip` optics force a magnification of 1; it computes in single precision.
"""

from __future__ import annotations

import json
from functools import cache
from typing import Any

import numpy as np
import pytest

from sweep.sensor import Optics, Pixel, digital_numbers, electron_rate, irradiance_factor

from .conftest import SHARED, needs_reference

pytestmark = needs_reference
FIXED = [("RGGB", [0, 1, 2]), ("RCCC", [0, 3]), ("RCCB", [0, 2, 3])]


@cache
def reference() -> dict[str, Any]:
    found: dict[str, Any] = json.loads((SHARED / "reference" / "isetcam_5nm.json").read_text())["grid_5nm"]
    return found


def pixel() -> Pixel:
    c = reference()["constants"]
    return Pixel(
        pitch_um=c["pixel_size_m"][0] * 1e6,
        fill_factor=c["fill_factor"],
        well_e=float(c["well_capacity_e"]),
        gain_dn_per_e=4096 * c["conversion_gain_V_per_e"] / c["voltage_swing_V"],
    )


def electrons(cfa: str, mode: str) -> tuple[np.ndarray, dict[str, Any]]:
    """Ours, ndarray[n_patches, n_channels] in the reference's channel order, and the reference's run."""
    ref = reference()
    run = next(r for r in ref["runs"] if r["cfa"] == cfa and r["mode"] == mode)
    optics = Optics(f_number=float(ref["constants"]["f_number"]))
    factor = irradiance_factor(optics, magnification=ref["skip_magnification"])
    light = np.array(ref["photon_radiance"]) * factor
    rate = electron_rate(light, np.array(ref["qe"]), float(ref["bin_nm"]), pixel())
    return rate * run["skip_exposure_s"], run


@pytest.mark.parametrize("mode", ["fixed", "auto"])
@pytest.mark.parametrize(("cfa", "channels"), FIXED)
def test_volts_agree_to_single_precision(cfa: str, channels: list[int], mode: str) -> None:
    found, run = electrons(cfa, mode)
    volts = found * reference()["constants"]["conversion_gain_V_per_e"]
    expected = np.array(run["skip_volts_unclipped"], dtype=float)
    assert list(np.flatnonzero(np.isfinite(expected[0]))) == channels
    np.testing.assert_allclose(volts[:, channels], expected[:, channels], rtol=1e-6)


@pytest.mark.parametrize("mode", ["fixed", "auto"])
@pytest.mark.parametrize(("cfa", "channels"), FIXED)
def test_digital_numbers_are_the_same(cfa: str, channels: list[int], mode: str) -> None:
    found, run = electrons(cfa, mode)
    expected = np.array(run["skip_dn"], dtype=float)[:, channels]
    if mode == "fixed":
        assert expected.max() < 4095
    # The only difference that is allowed: where ISETCam's ADC saturates at 4096, ours does at 4095.
    np.testing.assert_array_equal(digital_numbers(found, pixel())[:, channels], np.minimum(expected, 4095))


def test_irradiance_agrees_to_single_precision() -> None:
    ref = reference()
    optics = Optics(f_number=float(ref["constants"]["f_number"]))
    light = np.array(ref["photon_radiance"])
    skipped = light * irradiance_factor(optics, magnification=ref["skip_magnification"])
    np.testing.assert_allclose(skipped, np.array(ref["skip_oi_irradiance_photons"]), rtol=1e-6)
    factor = irradiance_factor(optics, magnification=ref["constants"]["magnification"])
    assert factor == pytest.approx(ref["constants"]["irradiance_factor"], rel=1e-12)
