"""Electrons of pixels and channels by two sparse matrices, against loops over pixels, wavelengths and filters."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from sweep.camera import disc_image, psf, sampling
from sweep.camera.image import Channels
from sweep.camera.phases import Phases
from sweep.camera.place import target
from sweep.camera.setup import Setup
from sweep.spectra.spectrum import linear_basis

from ..hard.scenes import DARK, F2, FAR, scene

CENTERS_PX = np.array([[0.0, 0.0], [0.3, 0.9], [1.6, -0.2], [0.7, 0.1]])
PHASES = Phases(CENTERS_PX, np.floor(CENTERS_PX + 0.5))


def pixel_by_pixel(
    setup: Setup, spectra: np.ndarray, crosstalk: float, *, blurred: bool
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Weights and channels of pixels, their light, and that of a field whose channels have 1, 2, ... electrons."""
    light, pixel, mosaic = setup.scene.target, setup.camera.pixel, setup.camera.mosaic
    assert light is not None
    nodes, n = setup.camera.grid.nodes_nm, len(mosaic.channels)
    radius, half = sampling.radii_px(setup, light)[0], pixel.fill_factor**0.5 / 2
    window = sampling.window(mosaic, PHASES.center_px, sampling.reach_px(setup, light))
    if light.readout == "mean":
        weights = sampling.mean_weights(window, half, sampling.radii_px(setup, light)[1], n)
    else:
        weights = sampling.center_weights(window, PHASES.nearest_px - PHASES.center_px, mosaic)
    profile, knots = None, psf.psf_knots_nm(nodes, setup.accuracy.psf_step_nm)
    if blurred:
        reach_um = math.sqrt(2) * (sampling.reach_px(setup, light) + 2.5) * pixel.pitch_um
        defocus = psf.defocus_um(setup.scene, pixel.pitch_um)
        f_number = setup.scene.optics.f_number
        profile = psf.profile(radius * pixel.pitch_um, reach_um, tuple(knots * 1e-3), f_number, defocus)
    every = np.ones(weights.shape, dtype=bool)
    on_pixels = disc_image.light_on_pixels(window, every, half, radius, profile, pixel.pitch_um).by_pixel()
    on_pixels = np.broadcast_to(on_pixels, (*weights.shape, on_pixels.shape[-1]))
    if on_pixels.shape[-1] == knots.size < nodes.size:
        on_pixels = on_pixels @ linear_basis(nodes, knots)
    own = np.zeros((*weights.shape, 5))
    flat = np.zeros(weights.shape)
    for channel in range(n):
        seen = window.channel == channel
        own[:, seen] = (on_pixels[:, seen] * np.ones(nodes.size)) @ spectra[channel].T
        flat[:, seen] = channel + 1.0
    around = np.zeros(own.shape), np.zeros(flat.shape)
    for down, right in ((-1, 0), (1, 0), (0, -1), (0, 1)):  # the window has a margin without weight
        around[0][:, 1:-1, 1:-1] += np.roll(own, (-down, -right), (1, 2))[:, 1:-1, 1:-1] / 4
        around[1][:, 1:-1, 1:-1] += np.roll(flat, (-down, -right), (1, 2))[:, 1:-1, 1:-1] / 4
    own, flat = (1 - crosstalk) * own + crosstalk * around[0], (1 - crosstalk) * flat + crosstalk * around[1]
    return weights, window.channel, own, flat


@pytest.mark.parametrize("crosstalk", [0.0, 0.1])
@pytest.mark.parametrize("readout", ["mean", "center"])
@pytest.mark.parametrize("psf_step_nm", [1e-3, 10.0, None], ids=["every wavelength", "every 10 nm", "sharp"])
def test_channels_are_weighted_sums_of_the_light_of_all_pixels(
    psf_step_nm: float | None, readout: str, crosstalk: float
) -> None:
    given = {"target": FAR | {"readout": readout}, "optics": F2, "visibility_m": 500, "noise": True}
    made = scene("split", "RYNCy", given, DARK | {"crosstalk": crosstalk})
    setup = replace(made.setup, left_out=frozenset({"blur"} if psf_step_nm is None else ()))
    if psf_step_nm is not None:
        setup = replace(setup, accuracy=setup.accuracy.model_copy(update={"psf_step_nm": psf_step_nm}))
    nodes, n = setup.camera.grid.nodes_nm, len(setup.camera.mosaic.channels)
    spectra = np.random.default_rng(1).uniform(size=(n, 5, nodes.size))  # behind each channel's filter
    image = target(setup, PHASES)
    of_functions = spectra.sum(axis=2)[:, None] if image.shares is None else image.shares @ np.swapaxes(spectra, 1, 2)
    found = image.folded(image.lit(np.ascontiguousarray(of_functions), range(n), crosstalk))
    squares = image.spread(image.lit(np.ascontiguousarray(of_functions), range(n), crosstalk))
    whole = image.folded(image.uniform(np.arange(1.0, n + 1)[:, None], range(n), crosstalk))[..., 0]

    weights, of_channel, own, flat = pixel_by_pixel(setup, spectra, crosstalk, blurred=psf_step_nm is not None)
    for channel in range(n):
        of_pixels = weights * (of_channel == channel)
        np.testing.assert_allclose(found[:, channel], np.einsum("xrc,xrcs->xs", of_pixels, own), rtol=1e-11)
        np.testing.assert_allclose(squares[:, channel], np.einsum("xrc,xrcs->xs", of_pixels**2, own), rtol=1e-11)
        np.testing.assert_allclose(whole[:, channel], np.einsum("xrc,xrc->x", of_pixels, flat), rtol=1e-11)
    means = Channels.of([image], crosstalk)
    of_means = means.folded(means.lit(np.ascontiguousarray(of_functions), range(n), crosstalk))
    np.testing.assert_allclose(of_means, found, rtol=1e-11)
    some, used = image.subset(np.array([2, 1]))
    lit = image.lit(np.ascontiguousarray(of_functions), range(n), crosstalk)
    np.testing.assert_allclose(some.folded(lit[used]), found[[2, 1]], rtol=1e-12)
    elements, of_mean, of_spread, _ = image.of_case(3)
    np.testing.assert_allclose(of_mean.T @ lit[elements], found[3], rtol=1e-12)
    np.testing.assert_allclose(of_spread.T @ lit[elements], squares[3], rtol=1e-12)


def test_mirrored_pixels_are_one_element() -> None:
    """A light in the middle of a pixel: of the eight places that mirrors and a transposition make equal, few differ."""
    given = {"target": FAR | {"phase_px": [0.0, 0.0]}, "optics": F2, "noise": True}
    made = scene("one", "RCCC", given, DARK)
    phases = Phases(np.zeros((1, 2)), np.zeros((1, 2)))
    image = target(made.setup, phases)
    assert image.channel.size < 0.3 * image.weight.size
