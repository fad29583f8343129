"""Pixel response: the weight of each QE in each readout element, at each sampling phase.

Optics do not depend on the filter. Everything between the lens and the electrons of the pixels is therefore a weight
per wavelength for each readout element (the mean of a channel, or a single pixel) and each channel whose filter it
sees.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..base.cache import Cache
from ..base.types import Array, DesignPixels, Float, FloatArray, IndexArray, Int, PerWavelength
from ..spectra.spectrum import linear_basis
from . import disc_image, psf, sampling
from .memory import pixels_per_phase
from .phases import Phases
from .setup import Setup

_HELD = 8_000_000
"""Values of pixels that are held at once."""
_KEPT_BYTES = 32 * 2**20
"""Responses that take more are not kept."""
_LATTICE = 17
"""Phases from which on responses of single pixels are kept: CFAs with tiles of one pattern ask for the same lattice."""


@dataclass(frozen=True)
class SplitLight:
    """`PixelResponse.light` of single pixels in factors.

    A pixel is a sum of parts, each at a distinct place behind the filter of one channel.

    `shares`: share of each function in each wavelength; None if all wavelengths are equal.
    """

    values: Float[Array, "places functions"]
    shares: Float[Array, "functions wavelengths"] | None
    parts: Float[Array, " parts"]
    place: Int[IndexArray, "parts cases pixels"]
    through: Int[IndexArray, "parts pixels"]
    n_channels: int

    def whole(self) -> Float[Array, "cases pixels channels _wavelengths"]:
        """Return the array."""
        by_place = self.values if self.shares is None else self.values @ self.shares
        result = np.zeros((*self.place.shape[1:], self.n_channels, by_place.shape[1]))
        pixels = np.arange(self.place.shape[2])
        for share, place, through in zip(self.parts, self.place, self.through, strict=True):
            result[:, pixels, through] += share * by_place[place]
        return result

    def add_sums(
        self, spectra: Float[Array, "designs channels signals wavelengths"], channels: Sequence[int], out: DesignPixels
    ) -> None:
        """Add sums of spectra over channels and wavelengths in place.

        Results of one design do not depend on other designs, except for rounding.
        """
        from .pixel_kernels import gather  # noqa: PLC0415  (compiled: kept off the start-up path)

        by_function = spectra.sum(axis=-1, keepdims=True) if self.shares is None else spectra @ self.shares.T
        by_place = self.values @ np.swapaxes(by_function, -1, -2)
        row = np.full(self.n_channels, -1)
        row[list(channels)] = np.arange(len(channels))
        gather(np.ascontiguousarray(by_place), self.parts, self.place, row[self.through], out)

    def folded(self, weights: Float[Array, "cases pixels"], channel: int) -> Float[Array, "cases _wavelengths"]:
        """Sum light through one channel's filter over the elements."""
        by_place = np.zeros((len(weights), len(self.values)))
        for share, place, through in zip(self.parts, self.place, self.through, strict=True):
            at = np.flatnonzero(through == channel)
            for case in range(len(weights)):
                np.add.at(by_place[case], place[case, at], share * weights[case, at])
        folded = by_place @ self.values
        return folded if self.shares is None else np.asarray(folded @ self.shares)


@dataclass(frozen=True)
class PixelResponse:
    """Weights of the light of a target, relative to a uniform field.

    `source`: light, as an array or in factors; `uniform`: weights of a uniform background; `readout`: weight of each
    element in the value of each channel; `spread`: weight of its variance in that of the channel; `by_channel`: True if
    each element is a channel; else it is a pixel.
    """

    source: Float[Array, "cases pixels channels _wavelengths"] | SplitLight
    uniform: Float[Array, "cases pixels channels"]
    readout: Float[Array, "cases pixels channels"]
    spread: Float[Array, "cases pixels channels"]
    by_channel: bool

    @cached_property
    def light(self) -> Float[Array, "cases pixels signals _wavelengths"]:
        """Light on each element through each channel's filter."""
        return self.source.whole() if isinstance(self.source, SplitLight) else self.source

    @property
    def shape(self) -> tuple[int, int]:
        """Number of phases and elements."""
        return self.uniform.shape[0], self.uniform.shape[1]

    def subset(self, which: slice | Int[IndexArray, " subset"]) -> PixelResponse:
        """Return the response at some phases."""
        source = self.source
        of_some = replace(source, place=source.place[:, which]) if isinstance(source, SplitLight) else source[which]
        return PixelResponse(of_some, self.uniform[which], self.readout[which], self.spread[which], self.by_channel)


class Responses:
    """Responses of a target on the pixels of a tile; those of channels are kept by phase."""

    def __init__(self, setup: Setup) -> None:
        self._setup = setup
        self._channels: dict[tuple[float, ...], tuple[FloatArray, FloatArray]] = {}
        self._lattices: Cache[Hashable, PixelResponse] = Cache(2)

    def pixels(self, phases: Phases) -> PixelResponse:
        """Return the response of single pixels, for a nonlinear readout."""

        def compute() -> PixelResponse:
            return _pixels(self._setup, phases, by_pixel=True)

        if len(phases) < _LATTICE:
            return compute()
        return self._lattices.get(tuple(phases.keys), compute)

    def channels(self, phases: Phases) -> PixelResponse:
        """Return the response of channels."""
        keys, known = phases.keys, self._channels
        new = [at for at, key in enumerate(keys) if key not in known]
        if new:
            light, uniform = self._folded(phases.subset(np.array(new)))
            known = known | {keys[at]: (light[number], uniform[number]) for number, at in enumerate(new)}
            if len(known) * light[0].nbytes <= _KEPT_BYTES:
                self._channels = known  # as a whole: threads share it
        light, uniform = (np.stack(part) for part in zip(*(known[key] for key in keys), strict=True))
        weights = np.repeat(np.eye(uniform.shape[2])[None], len(keys), axis=0)
        return PixelResponse(light, uniform, weights, weights, by_channel=True)

    def _folded(
        self, phases: Phases
    ) -> tuple[Float[Array, "cases channels channels _wavelengths"], Float[Array, "cases channels channels"]]:
        setup = self._setup
        knots = psf.psf_knots_nm(setup.camera.grid.nodes_nm, setup.accuracy.psf_step_nm).size
        step = max(1, _HELD // (pixels_per_phase(setup) * max(len(setup.camera.mosaic.channels) ** 2, knots)))
        blocks = [phases.subset(slice(at, at + step)) for at in range(0, len(phases), step)]
        parts = [_pixels(setup, block, by_pixel=False) for block in blocks]
        return np.concatenate([part.light for part in parts]), np.concatenate([part.uniform for part in parts])


_RESPONSES: Cache[Hashable, Responses] = Cache(8)
"""The latest ones: CFAs with tiles of one pattern, and field positions, share theirs."""


def responses_of(setup: Setup) -> Responses:
    """Return the responses of a target on a tile."""
    scene, camera, pixel = setup.scene, setup.camera, setup.camera.pixel
    key = (
        scene.target,
        scene.optics.f_number,
        psf.defocus_um(scene, pixel.pitch_um),
        (pixel.pitch_um, pixel.fill_factor, sampling.crosstalk_share(setup)),
        camera.mosaic.tile,
        camera.grid,
        setup.accuracy.psf_step_nm,
        setup.computes("blur"),
    )
    return _RESPONSES.get(key, lambda: Responses(setup))


def uniform_response(setup: Setup, *, by_pixel: bool) -> PixelResponse:
    """Return the response of a field without structure, for which one tile stands.

    `by_pixel`: keep single pixels, each of which sees the filters of its neighbors.
    """
    tile, n = setup.camera.mosaic.indices, len(setup.camera.mosaic.channels)
    of_channel = (tile[..., None] == np.arange(n)).astype(float)
    share = sampling.crosstalk_share(setup)
    split = sampling.with_crosstalk(of_channel[None], share, periodic=True).reshape(1, tile.size, n, 1)
    weights = of_channel.reshape(-1, n) / setup.camera.mosaic.counts
    if by_pixel and tile.size > n:
        return PixelResponse(split, split[..., 0], weights[None], weights[None] ** 2, by_channel=False)
    folded = np.einsum("uc,xukl->xckl", weights, split)
    return PixelResponse(
        folded, folded[..., 0], np.eye(n)[None], np.diag(1 / setup.camera.mosaic.counts)[None], by_channel=True
    )


def _profile(setup: Setup, wavelength_nm: PerWavelength) -> psf.DiscProfile | None:
    """Return the light's blurred image as far as any pixel of the readout; None if blur is left out."""
    target = setup.scene.target
    if target is None or not setup.computes("blur"):
        return None
    pitch_um = setup.camera.pixel.pitch_um
    furthest_px = 2**0.5 * (sampling.reach_px(setup, target) + 2.5)
    sizes = (sampling.radii_px(setup, target)[0] * pitch_um, furthest_px * pitch_um)
    w20_um = psf.defocus_um(setup.scene, pitch_um)
    return psf.profile(*sizes, tuple(wavelength_nm * 1e-3), setup.scene.optics.f_number, w20_um)


def _pixels(setup: Setup, phases: Phases, *, by_pixel: bool) -> PixelResponse:
    """Return the response of every pixel of the readout at every phase."""
    target, pixel, n = setup.scene.target, setup.camera.pixel, len(setup.camera.mosaic.channels)
    assert target is not None
    wavelength_nm = setup.camera.grid.nodes_nm
    knots_nm = psf.psf_knots_nm(wavelength_nm, setup.accuracy.psf_step_nm)
    radius, half = sampling.radii_px(setup, target)[0], pixel.fill_factor**0.5 / 2
    window, of_channel, readout_weights = _weights(setup, phases)
    share = sampling.crosstalk_share(setup)
    spread = sampling.with_crosstalk(readout_weights, share) if share else readout_weights
    has_weight = np.asarray((spread > 0).any(axis=3))
    profile = _profile(setup, knots_nm)
    light = disc_image.light_on_pixels(window, has_weight, half, radius, profile, pixel.pitch_um)
    if light.shares is not None and knots_nm.size < wavelength_nm.size:
        light = replace(light, shares=light.shares @ linear_basis(wavelength_nm, knots_nm))
    if by_pixel:
        return _apart(light, of_channel, readout_weights, share)
    # Weights of the pixels of each channel in each channel's readout: [cases, rows, columns, channels x channels].
    taken = spread[..., :, None] * of_channel[..., None, :]
    shape = (len(readout_weights), n, n)
    folded = light.folded(taken.reshape(*taken.shape[:3], n * n)).reshape(*shape, -1)
    weights = np.repeat(np.eye(n)[None], len(readout_weights), axis=0)
    return PixelResponse(folded, taken.sum(axis=(1, 2)), weights, weights, by_channel=True)


def _weights(
    setup: Setup, phases: Phases
) -> tuple[sampling.Window, Float[Array, "_cases _pixels _channels"], Float[Array, "_cases _rows _columns _channels"]]:
    """Return pixels around the light, their channels and their weights."""
    target, mosaic, n = setup.scene.target, setup.camera.mosaic, len(setup.camera.mosaic.channels)
    assert target is not None
    window = sampling.window(mosaic, phases.center_px, sampling.reach_px(setup, target))
    if target.readout == "mean":
        half, readout = setup.camera.pixel.fill_factor**0.5 / 2, sampling.radii_px(setup, target)[1]
        weights = sampling.mean_weights(window, half, readout, n)
    else:
        weights = sampling.center_weights(window, phases.nearest_px - phases.center_px, mosaic)
    of_channel = (window.channel[..., None] == np.arange(n)).astype(float)
    return window, of_channel, weights[..., None] * of_channel


def _apart(
    light: disc_image.PixelLight,
    of_channel: Float[Array, "_channels _rows _columns"],
    readout_weights: Float[Array, "_channels _cases _rows _columns"],
    share: float,
) -> PixelResponse:
    """Return the response of single pixels that have a weight in any readout."""
    used = (readout_weights > 0).any(axis=(0, 3))
    rows, columns = np.nonzero(used)
    # A pixel at the border has no weight.
    taken = [(part, rows + down, columns + right) for part, down, right in sampling.crosstalk_parts(share)]
    n = of_channel.shape[2]
    uniform = np.zeros((len(readout_weights), rows.size, n))
    pixels, channel = np.arange(rows.size), of_channel.argmax(axis=2)
    for part, row, column in taken:
        uniform[:, pixels, channel[row, column]] += part
    parts = np.array([part for part, _, _ in taken])
    place = np.stack([light.place[:, row, column] for _, row, column in taken])
    through = np.stack([channel[row, column] for _, row, column in taken])
    split = SplitLight(light.values, light.shares, parts, place, through, n)
    readout = readout_weights[:, used]
    return PixelResponse(split, uniform, readout, readout**2, by_channel=False)
