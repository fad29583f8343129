"""Expected electrons of a signal head's pixels for one design, and images drawn from them."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...base.types import Array, ChannelCurves, Float, FloatArray, ImageNumbers, PerKnot
from ...camera.angular import AngularResponse
from ...camera.irradiance import signal_irradiance
from ...camera.pixel import Pixel, irradiance_factor
from ...camera.sampling import crosstalk_share, with_crosstalk
from ...camera.scene import FixedExposure, Noise, Scene
from ...camera.setup import Setup
from ...spectra.color import luminance_per_photon_radiance
from ...spectra.spectrum import linear_basis
from .head import MARGIN, HeadMaps, head_maps, lamp_maps
from .image_kernels import draw_numbers
from .keys import LightLevel, Vision
from .materials import ambient_light, phantom, reflectance
from .pixel_table import PixelTable, pixel_table
from .scenes import Scenes, orders_of_lenses, uniforms

Numbers = NDArray[np.int16]
"""Digital numbers of images."""


def setup_at(setup: Setup, vision: Vision, distance_m: float, level: LightLevel) -> Setup:
    """Return the setup's camera before a head at a distance, with lamps of 1 cd."""
    scenario = Scene(
        target=vision.target(distance_m),
        optics=vision.optics,
        intensity_cd=1.0,
        exposure=FixedExposure(exposure_s=level.exposure_s),
        noise=Noise(),
    )
    return replace(setup, scene=scenario, left_out=frozenset())


@dataclass(frozen=True)
class HeadElectrons:
    """Expected electrons of the parts of a head at one distance and level.

    `lamps`: added per candela and second, by position.
    """

    unlit: Float[Array, "places backgrounds pixels"]
    phantoms: Float[Array, "places lenses lenses pixels"]
    lamps: Float[Array, "places lenses signals pixels"]
    time_s: float

    def of(
        self,
        place: ImageNumbers,
        background: ImageNumbers,
        order: ImageNumbers,
        phantom_on: ImageNumbers,
        lit: tuple[ImageNumbers, ImageNumbers, Float[Array, " images"]],
    ) -> Float[Array, "images pixels"]:
        """Return electrons of some heads.

        `lit`: type of the lit lens (-1: none), its signal, its intensity, cd. Returns expected electrons.
        """
        electrons = self.unlit[place, background]
        sunny = np.flatnonzero(phantom_on)
        for position, kinds in enumerate(orders_of_lenses(self.lamps.shape[1])[order].T):
            electrons[sunny] += self.phantoms[place[sunny], position, kinds[sunny]]
            on = np.flatnonzero(lit[0] == kinds)
            electrons[on] += (self.time_s * lit[2][on, None]) * self.lamps[place[on], position, lit[1][on]]
        return electrons


class HeadCamera:
    """One design before signal heads, at every distance and level of a benchmark."""

    def __init__(self, setup: Setup, curves: ChannelCurves, vision: Vision) -> None:
        qe = setup.camera.qe.copy()
        qe[list(setup.camera.modified)] = curves
        self.vision = vision
        self.setup = setup
        self.levels = list(vision.levels.values())
        self._setups = [[setup_at(setup, vision, d, level) for level in self.levels] for d in vision.distances_m]
        channels = list(range(len(qe)))
        self.qe = AngularResponse(self._setups[0][0]).curves(qe, channels)
        self.pixel: Pixel = self._setups[0][0].camera.pixel
        self.table: PixelTable = pixel_table(self.pixel)
        size = vision.crop_px + 2 * MARGIN
        rows, columns = setup.camera.mosaic.indices.shape
        at = np.arange(-MARGIN, size - MARGIN)
        self._channel = setup.camera.mosaic.indices[np.ix_(at % rows, at % columns)]
        self._lamps: dict[int, FloatArray] = {}
        self._heads: dict[tuple[int, int], HeadElectrons] = {}

    def electrons(self, distance: int, level: int) -> HeadElectrons:
        """Return expected electrons of the parts of a head at a distance and a light level, by their indices."""
        if (distance, level) not in self._heads:
            self._heads[distance, level] = self._made(distance, level)
        return self._heads[distance, level]

    def _made(self, distance: int, level: int) -> HeadElectrons:
        setup, level_settings = self._setups[distance][level], self.levels[level]
        maps = head_maps(setup, self.vision)
        time_s, grid = level_settings.exposure_s, setup.camera.grid
        arriving = self._of_white(level_settings)
        housing, plate, glass = (arriving * reflectance(grid, of) for of in ("dark gray", "black", "black"))
        around = self._around(level_settings)
        uniform = np.ones((1, *maps.backplate.shape[1:]))
        knots = maps.knots_nm
        unlit = self._electrons(knots, uniform, around) + self._electrons(knots, maps.backplate, plate - around)
        unlit += self._electrons(knots, maps.housing, (housing - plate)[None])
        unlit += self._electrons(knots, maps.lenses.sum(axis=1), (glass - housing)[None])
        return HeadElectrons(
            np.maximum(unlit, 0.0) * time_s + self.pixel.dark_e_per_s * time_s,
            self._phantoms(maps, setup, level_settings) * time_s,
            self._lamp_rates(distance, maps, setup),
            time_s,
        )

    def _of_white(self, level: LightLevel) -> Float[Array, " wavelengths"]:
        """Return the photons that arrive from a surface of reflectance 1."""
        grid = self.setup.camera.grid
        ambient = ambient_light(grid, level.light)
        radiance = level.illuminance_lx / math.pi / luminance_per_photon_radiance(grid, ambient[None])[0]
        return np.asarray(ambient * (radiance * irradiance_factor(self.vision.optics)), dtype=float)

    def _around(self, level: LightLevel) -> Float[Array, "backgrounds wavelengths"]:
        """Return the photons that arrive from each background."""
        grid, white = self.setup.camera.grid, self._of_white(level)
        return np.stack([white * reflectance(grid, background) for background in self.vision.backgrounds])

    def background(self, level: int) -> Float[Array, "backgrounds pixels"]:
        """Return expected electrons of images of each background without a head."""
        settings = self.levels[level]
        knots = head_maps(self._setups[0][level], self.vision).knots_nm
        uniform = np.ones((1, *self._channel.shape, knots.size))
        electrons = self._electrons(knots, uniform, self._around(settings))[0]
        return np.asarray((electrons + self.pixel.dark_e_per_s) * settings.exposure_s, dtype=float)

    def lamps(self, distance: int, spectra: Float[Array, "lamps wavelengths"]) -> Float[Array, "places lamps pixels"]:
        """Return electrons of other lamps, as wide as a lens, for one candela and second at each position."""
        setup = self._setups[distance][0]
        knots, discs = lamp_maps(setup, self.vision)
        per_cd = self._per_candela(setup) / luminance_per_photon_radiance(setup.camera.grid, spectra)
        return np.maximum(self._electrons(knots, discs, spectra * per_cd[:, None]), 0.0)

    def _phantoms(self, maps: HeadMaps, setup: Setup, level: LightLevel) -> Float[Array, "places lenses lenses pixels"]:
        """Return electrons/s of sun on each lens, reflected with its color."""
        spectra = np.stack([phantom(setup.camera.grid, kind) for kind in self.vision.lenses])
        per_cd = self._per_candela(setup) / luminance_per_photon_radiance(setup.camera.grid, spectra)
        return self._of_lenses(maps, spectra * (level.phantom_cd * per_cd)[:, None])

    def _per_candela(self, setup: Setup) -> float:
        """Return the luminance of a lens of one candela, times irradiance over radiance."""
        luminance = setup.scene.luminance_cd_m2
        assert luminance is not None
        return luminance * irradiance_factor(self.vision.optics)

    def _lamp_rates(self, distance: int, maps: HeadMaps, setup: Setup) -> Float[Array, "places lenses lamps pixels"]:
        """Return electrons/s of each lamp of one candela at each position; equal at all levels."""
        if distance not in self._lamps:
            self._lamps[distance] = self._of_lenses(maps, signal_irradiance(setup))
        return self._lamps[distance]

    def _of_lenses(
        self, maps: HeadMaps, spectra: Float[Array, "spectra wavelengths"]
    ) -> Float[Array, "places lenses spectra pixels"]:
        """Return spectra on each lens."""
        places, positions = maps.lenses.shape[:2]
        lens_electrons = self._electrons(maps.knots_nm, maps.lenses.reshape(-1, *maps.lenses.shape[2:]), spectra)
        return np.maximum(lens_electrons.reshape(places, positions, *lens_electrons.shape[1:]), 0.0)

    def _electrons(
        self,
        knots_nm: PerKnot,
        light: Float[Array, "cases side side knots"],
        spectra: Float[Array, "spectra wavelengths"],
    ) -> Float[Array, "cases spectra pixels"]:
        """Return electrons/s of images with spectra, through each pixel's filter, with crosstalk."""
        setup = self.setup
        on_knots = linear_basis(setup.camera.grid.nodes_nm, knots_nm)
        seen = self.qe * setup.camera.area_bins_m2_nm
        weight = np.einsum("cw,sw,kw->cks", seen, spectra, on_knots, optimize=True)
        electrons = np.empty((len(light), len(spectra), *self._channel.shape))
        for channel in range(len(self.qe)):
            in_channel = self._channel == channel
            electrons[:, :, in_channel] = np.moveaxis(light[:, in_channel] @ weight[channel], 2, 1)
        share = crosstalk_share(setup)
        if share:
            flat = electrons.reshape(-1, *self._channel.shape)
            electrons = with_crosstalk(flat, share).reshape(electrons.shape)
        inner = slice(MARGIN, -MARGIN)
        return electrons[:, :, inner, inner].reshape(*electrons.shape[:2], -1)

    def n_places(self) -> int:
        """Return the number of positions of the head on the mosaic."""
        return int(self.setup.camera.mosaic.indices.size * self.vision.places_per_pixel**2)

    def expected(self, scenes: Scenes) -> Float[Array, "images pixels"]:
        """Return expected electrons of scenes."""
        n_pixels = self.vision.crop_px**2
        electrons = np.empty((len(scenes), n_pixels))
        candelas = np.array(self.vision.intensities_cd)
        for distance in np.unique(scenes.distance):
            for level in np.unique(scenes.level):
                here = np.flatnonzero((scenes.distance == distance) & (scenes.level == level))
                if not here.size:
                    continue
                here_scenes = scenes.subset(here)
                lit = (here_scenes.state - 1, here_scenes.lamp, candelas[here_scenes.intensity])
                place = (here_scenes.place * self.n_places()).astype(np.intp)
                heads = self.electrons(int(distance), int(level))
                electrons[here] = heads.of(place, here_scenes.background, here_scenes.order, here_scenes.phantom, lit)
        return electrons

    def images(self, scenes: Scenes) -> Numbers:
        """Return images of scenes, each with its own photons."""
        numbers = self.drawn(self.expected(scenes), scenes.key)
        return numbers.reshape(len(scenes), self.vision.crop_px, self.vision.crop_px)

    def drawn(self, electrons: Float[Array, "images pixels"], keys: ImageNumbers) -> Numbers:
        """Return digital numbers with the photons of each image's key."""
        node, share = self.table.at(electrons.ravel())
        numbers = np.empty(electrons.size, dtype=np.int16)
        draw_numbers(node, share, self.table.below, uniforms(keys, electrons.shape[1]).ravel(), numbers)
        return numbers.reshape(electrons.shape)
