"""The forward model against a full run of ISETCam: another program, written by others.

`tests/data/isetcam_5nm.json` is that run, and says how it was made (tests/data/README.md).

Known differences: ISETCam counts the first and the last bin of a spectrum whole, and the package half of it, so its
light there is twice as much here; its ADC scales by 4096 and saturates at 4096 (ours is given that gain, and saturates at 4095);
its `skip` optics force a magnification of 1; it computes in single precision.
"""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sweep.camera.camera import Camera
from sweep.camera.effects import Box
from sweep.camera.linear import linear_model
from sweep.camera.model import SceneModel
from sweep.camera.mosaic import Mosaic
from sweep.camera.pixel import Optics, Pixel, irradiance_factor
from sweep.camera.plan import plan_scene
from sweep.camera.psf import otf as transfer_function
from sweep.camera.scene import FixedExposure, Scene
from sweep.camera.setup import Setup
from sweep.spectra.lights import Lights
from sweep.spectra.spectrum import WavelengthGrid

RUN = Path(__file__).parent.parent / "data" / "isetcam_5nm.json"
FIXED = [("RGGB", [0, 1, 2]), ("RCCC", [0, 3]), ("RCCB", [0, 2, 3])]


@cache
def reference() -> dict[str, Any]:
    found: dict[str, Any] = json.loads(RUN.read_text())["grid_5nm"]
    return found


def pixel() -> Pixel:
    c = reference()["constants"]
    return Pixel(
        pitch_um=c["pixel_size_m"][0] * 1e6,
        fill_factor=c["fill_factor"],
        well_e=float(c["well_capacity_e"]),
        gain_dn_per_e=4096 * c["conversion_gain_V_per_e"] / c["voltage_swing_V"],
    )


def isetcam_setup(mosaic: Mosaic, magnification: float, exposure_s: float, kept: np.ndarray | float = 1.0) -> Setup:
    """The reference's patches and sensor; a lens at a finite distance has a magnification, which dims its image.

    `kept`: share of the light that the blur leaves, per wavelength.
    """
    ref = reference()
    optics, names = Optics(f_number=float(ref["constants"]["f_number"])), tuple(ref["patch_names"])
    dimmed = irradiance_factor(optics, magnification) / irradiance_factor(optics)
    total = float(ref["total_photon_radiance"])
    photons = np.array(ref["photon_radiance"]) / total
    np.testing.assert_allclose(photons.sum(axis=1) * ref["bin_nm"], 1.0, rtol=1e-12)
    photons[:, [0, -1]] *= 2
    lights = Lights("isetcam", names, names, photons * kept, 1.0, "", False)
    qe = np.array(ref["qe"])[columns_of(mosaic)]
    scenario = Scene(
        photon_radiance=total,
        optics=Optics(f_number=optics.f_number, transmission=dimmed),
        exposure=FixedExposure(exposure_s=exposure_s),
    )
    return Setup(Camera(WavelengthGrid(step_nm=5), mosaic, qe, (), qe[0], pixel()), lights, scenario)


def columns_of(mosaic: Mosaic) -> list[int]:
    """The reference's number of each channel; its clear pixel is W."""
    names: list[str] = reference()["qe_names"]
    return [names.index({"C": "W"}.get(channel, channel)) for channel in mosaic.channels]


def every_channel() -> Setup:
    """All channels of the reference side by side, read out with all effects."""
    return isetcam_setup(Mosaic.from_rows("all", [reference()["qe_names"]]), 0.0, 1.0)


NOTHING = np.empty((1, 0, 61))
"""Curves of a CFA without a modified channel."""


def electrons(cfa: str, mode: str) -> tuple[np.ndarray, dict[str, Any]]:
    """Ours, ndarray[n_patches, n_channels] in the reference's channel order, and the reference's run."""
    ref = reference()
    run = next(r for r in ref["runs"] if r["cfa"] == cfa and r["mode"] == mode)
    every = Mosaic.from_rows("all", [ref["qe_names"]])
    setup = isetcam_setup(every, ref["skip_magnification"], run["skip_exposure_s"])
    scene = linear_model(setup).scene
    return scene.own_views[0].rates(NOTHING, scene.exposures[0])[:, 0].T * run["skip_exposure_s"], run


@pytest.mark.parametrize("mode", ["fixed", "auto"])
@pytest.mark.parametrize(("cfa", "channels"), FIXED)
def test_volts_agree_to_single_precision_and_digital_numbers_are_the_same(
    cfa: str, channels: list[int], mode: str
) -> None:
    found, run = electrons(cfa, mode)
    volts = found * reference()["constants"]["conversion_gain_V_per_e"]
    expected = np.array(run["skip_volts_unclipped"], dtype=float)
    assert list(np.flatnonzero(np.isfinite(expected[0]))) == channels
    np.testing.assert_allclose(volts[:, channels], expected[:, channels], rtol=1e-6)
    expected = np.array(run["skip_dn"], dtype=float)[:, channels]
    if mode == "fixed":
        assert expected.max() < 4095
    # The only difference that is allowed: where ISETCam's ADC saturates at 4096, ours does at 4095.
    np.testing.assert_array_equal(
        SceneModel(every_channel()).readout.convert(found)[:, channels], np.minimum(expected, 4095)
    )


def kept_at_the_center(f_number: float) -> np.ndarray:
    """Light that the blur leaves at the center of ISETCam's field, per wavelength, by our transfer function.

    Its field is finite, with a dark margin of an eighth on each side, and its blur is periodic. The file states 64 rows;
    a square field fits the irradiance that it gives (the 96 columns of its other images do not: the loss is 17 % off).
    """
    ref = reference()
    rows, margin, sample_um = (
        ref["skip_oi_size"][0],
        ref["constants"]["oi_pad"][0],
        ref["constants"]["oi_sample_m"] * 1e6,
    )
    field = np.pad(np.ones((rows, rows)), margin)
    nu = np.hypot(*np.meshgrid(*[np.fft.fftfreq(len(field), sample_um)] * 2))
    kept = []
    for wave_nm in ref["wave_nm"]:
        otf = transfer_function(nu.ravel(), np.array([wave_nm * 1e-3]), f_number, 0.0).reshape(nu.shape)
        kept.append(np.fft.ifft2(np.fft.fft2(field) * otf).real[len(field) // 2, len(field) // 2])
    return np.array(kept)


@pytest.mark.parametrize("cfa", ["RGGB", "RCCC", "RCCB"])
def test_a_uniform_field_agrees_through_the_whole_image_chain(cfa: str) -> None:
    ref = reference()
    run = next(r for r in ref["runs"] if r["cfa"] == cfa and r["mode"] == "fixed")
    mosaic = Mosaic.from_name(cfa)
    columns, constants = columns_of(mosaic), ref["constants"]
    kept = kept_at_the_center(float(constants["f_number"]))
    setup = isetcam_setup(mosaic, constants["magnification"], run["exposure_s"], kept)
    plan = plan_scene("uniform", [Box(setup, setup.camera.qe, setup.camera.qe)], 0.1, setup.accuracy)
    assert "quantization" in plan.computed
    smooth = linear_model(setup).smooth(NOTHING)[0, 0]
    volts = np.array(run["uniform_volts_unclipped"], dtype=float)[:, columns]
    np.testing.assert_allclose(smooth, 4096 * volts, atol=0.1, rtol=0)
    dn = SceneModel(replace(setup, left_out=plan.left_out)).read(NOTHING)[0][0, 0]
    expected = np.minimum(np.array(run["uniform_dn"], dtype=float)[:, columns], 4095)
    near_a_step = np.abs(4096 * volts - np.floor(4096 * volts) - 0.5) < 0.1
    assert ((dn == expected) | near_a_step).all()
