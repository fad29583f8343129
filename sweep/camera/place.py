"""Where light falls: lamps and filters at an image height, and images of a chart or a target on the mosaic there."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from ..base.cache import Cache
from ..base.types import Array, Bool, BoolArray, DesignCurves, Float
from ..spectra.spectrum import linear_basis
from . import disc_image, psf, sampling
from .angular import AngularResponse
from .image import Channels, Image, Pixels, Rates
from .irradiance import path_factor, scene_irradiance
from .memory import blocks
from .phases import Phases
from .setup import Setup

_LATTICE = 17
"""Phases from which on images are kept: tiles of one pattern, and scenes of other lights, ask for the same."""


class Position:
    """Lamps behind air and lens, and filters in the cone of rays, at one image height.

    `signals`, `background`: electrons/s of each signal on a whole image, and of the background, per unit of QE.
    """

    def __init__(self, setup: Setup) -> None:
        nodes_nm, irradiance = setup.camera.grid.nodes_nm, scene_irradiance(setup)
        area_bins = setup.camera.area_bins_m2_nm
        self._setup = setup
        self.signals = irradiance.signals * area_bins * path_factor(setup, nodes_nm)
        self.background = irradiance.background * area_bins * path_factor(setup, nodes_nm, background=True)
        self.has_background = bool(self.background.any())

    @cached_property
    def angular(self) -> AngularResponse:
        """Filters in the cone of rays there."""
        return AngularResponse(self._setup)

    def lit(
        self, qe: DesignCurves, channels: Sequence[int], shares: Float[Array, "functions wavelengths"] | None
    ) -> Rates:
        """Return electrons/s of each function of an image, in columns of designs and signals."""
        spectra = self._seen(qe, channels)[:, :, None] * self.signals
        of_functions = spectra.sum(axis=-1, keepdims=True) if shares is None else spectra @ shares.T
        ordered = np.transpose(of_functions, (1, 3, 0, 2))
        return np.ascontiguousarray(ordered.reshape(*ordered.shape[:2], len(qe) * len(self.signals)))

    def of_background(self, qe: DesignCurves, channels: Sequence[int]) -> Float[Array, "channels designs"]:
        """Return electrons/s of the background."""
        return np.asarray(np.einsum("ncw,w->cn", self._seen(qe, channels), self.background), dtype=float)

    def _seen(self, qe: DesignCurves, channels: Sequence[int]) -> DesignCurves:
        return self.angular.curves(qe, channels) if self._setup.moves else qe

    def per_qe(self, light: Float[Array, "*batch wavelengths"], channel: int) -> Float[Array, "*batch wavelengths"]:
        """Return weights of a channel's curve at normal incidence, from those of its curve in the cone."""
        if not self._setup.moves:
            return light
        return self.angular.light(light[..., None, :], [channel])[..., 0, :]


def chart(setup: Setup, *, by_pixel: bool) -> Image:
    """Return the image of a light that fills the field, for which one tile stands.

    `by_pixel`: pixels that see the filters of their neighbors are read one by one.
    """
    mosaic, crosstalk = setup.camera.mosaic, sampling.crosstalk_share(setup)
    n = len(mosaic.channels)
    if not crosstalk:
        return Channels(np.eye(n)[:, :, None], np.eye(n), None, mosaic.counts)
    around = [
        np.roll(mosaic.indices, (-down, -right), (0, 1)) for _, down, right in sampling.crosstalk_parts(crosstalk)
    ]
    through = np.stack([of_part.ravel() for of_part in around])
    dark = np.zeros_like(through)
    weight = 1 / mosaic.counts[through[0]]
    pixels = Pixels.of((np.ones((1, 1)), None), dark, through, dark[0], weight, 1, n)
    if by_pixel:
        return pixels
    return replace(Channels.of([pixels], crosstalk), counts=mosaic.counts)


_IMAGES: Cache[Hashable, list[Image]] = Cache(6)


def targets(setup: Setup, phases: Phases, *, by_pixel: bool) -> list[Image]:
    """Return the images of a target at sampling phases: of pixels, in parts that fit into memory; else one."""
    crosstalk = sampling.crosstalk_share(setup)

    def compute() -> list[Image]:
        parts = (target(setup, part) for part in blocks(setup, phases))
        return [*parts] if by_pixel else [Channels.of(parts, crosstalk)]

    if len(phases) < _LATTICE:
        return compute()
    scene, camera, pixel = setup.scene, setup.camera, setup.camera.pixel
    light = scene.target, scene.optics.f_number, psf.defocus_um(scene, pixel.pitch_um), setup.computes("blur")
    of_pixels = camera.mosaic.tile, pixel.pitch_um, pixel.fill_factor, crosstalk
    key = light, of_pixels, camera.grid, setup.accuracy.psf_step_nm, by_pixel, tuple(phases.keys)
    return _IMAGES.get(key, compute)


def target(setup: Setup, phases: Phases) -> Pixels:
    """Return the image of a target at sampling phases."""
    light, pixel, mosaic = setup.scene.target, setup.camera.pixel, setup.camera.mosaic
    assert light is not None
    half = pixel.fill_factor**0.5 / 2
    window = sampling.window(mosaic, phases.center_px, sampling.reach_px(setup, light))
    if light.readout == "mean":
        weights = sampling.mean_weights(window, half, sampling.radii_px(setup, light)[1], len(mosaic.channels))
    else:
        weights = sampling.center_weights(window, phases.nearest_px - phases.center_px, mosaic)
    case, row, column = np.nonzero(weights > 0)
    parts = sampling.crosstalk_parts(sampling.crosstalk_share(setup))
    rows_columns = [(row + down, column + right) for _, down, right in parts]  # a pixel at the border has no weight
    requested = np.zeros(weights.shape, dtype=bool)
    for there in rows_columns:
        requested[case, *there] = True
    on_pixels = _light(setup, window, requested, half)
    place = np.stack([on_pixels.place[case, *there] for there in rows_columns])
    through = np.stack([window.channel[there] for there in rows_columns])
    of_light = on_pixels.values, on_pixels.shares
    return Pixels.of(of_light, place, through, case, weights[case, row, column], len(weights), len(mosaic.channels))


def _light(
    setup: Setup, window: sampling.Window, requested: Bool[BoolArray, "cases rows columns"], half: float
) -> disc_image.PixelLight:
    """Return the light of the requested pixels, with the shares of its functions at all wavelengths."""
    scene, pixel, nodes_nm = setup.scene, setup.camera.pixel, setup.camera.grid.nodes_nm
    assert scene.target is not None
    radius_px = sampling.radii_px(setup, scene.target)[0]
    if not setup.computes("blur"):
        return disc_image.light_on_pixels(window, requested, half, radius_px, None, pixel.pitch_um)
    furthest_px = 2**0.5 * (sampling.reach_px(setup, scene.target) + 2.5)
    sizes = radius_px * pixel.pitch_um, furthest_px * pixel.pitch_um
    knots_nm = psf.psf_knots_nm(nodes_nm, setup.accuracy.psf_step_nm)
    w20_um = psf.defocus_um(scene, pixel.pitch_um)
    profile = psf.profile(*sizes, tuple(knots_nm * 1e-3), scene.optics.f_number, w20_um)
    light = disc_image.light_on_pixels(window, requested, half, radius_px, profile, pixel.pitch_um)
    if light.shares is None or knots_nm.size == nodes_nm.size:
        return light
    return disc_image.PixelLight(light.values, light.place, light.shares @ linear_basis(nodes_nm, knots_nm))
