"""Pixel response: the weight of each QE in each readout element, at each sampling phase.

Optics do not depend on the filter. Everything between the scene and the electrons of the pixels is therefore a weight
per wavelength for each readout element (the mean of a channel, or a single pixel) and each channel whose filter it
sees.
"""

from __future__ import annotations

import hashlib
import pickle
import threading
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..base.cache import Cache
from ..base.types import Array, DesignPixels, Float, FloatArray, IndexArray, Int, PerWavelength
from ..spectra.spectrum import linear_basis
from . import disc_image, psf, sampling
from .field import field_heights, over_field
from .irradiance import path_factor
from .memory import pixels_per_phase
from .phases import Phases
from .setup import Setup

_HELD = 8_000_000
"""Values of pixels that are held at once."""
_KEPT_BYTES = 32 * 2**20
"""Responses that take more are not kept."""


@dataclass(frozen=True)
class SplitLight:
    """`PixelResponse.light` of single pixels in factors.

    A pixel is a sum of parts, each at a distinct place behind the filter of one channel.

    `shares`: share of each function in each wavelength; None if all wavelengths are equal.
    """

    values: Float[Array, "places functions"]
    shares: Float[Array, "functions wavelengths"] | None
    factor: Float[Array, "#wavelengths"]
    parts: Float[Array, " parts"]
    place: Int[IndexArray, "parts cases pixels"]
    through: Int[IndexArray, "parts pixels"]
    n_channels: int

    @property
    def shape(self) -> tuple[int, int, int, int]:
        """Cases, pixels, channels and wavelengths of the array."""
        return (*self.place.shape[1:], self.n_channels, self.factor.size)

    def whole(self) -> Float[Array, "cases pixels channels wavelengths"]:
        """Return the array."""
        by_place = (self.values if self.shares is None else self.values @ self.shares) * self.factor
        result = np.zeros(self.shape)
        pixels = np.arange(self.place.shape[2])
        for share, place, through in zip(self.parts, self.place, self.through, strict=True):
            result[:, pixels, through] += share * by_place[place]
        return result

    def _filtered_light(
        self, spectra: Float[Array, "designs channels signals wavelengths"]
    ) -> Float[Array, "designs channels _functions signals"]:
        """Sum over the wavelengths at each place."""
        light = spectra * self.factor
        by_function = light.sum(axis=-1, keepdims=True) if self.shares is None else light @ self.shares.T
        return np.asarray(self.values @ np.swapaxes(by_function, -1, -2), dtype=float)

    def add_sums(
        self, spectra: Float[Array, "designs channels signals wavelengths"], channels: Sequence[int], out: DesignPixels
    ) -> None:
        """Add sums over channels and wavelengths in place.

        Results of one design do not depend on other designs, except for rounding.

        `found`: array that is changed.
        """
        from .compiled import gather  # noqa: PLC0415  (compiled: kept off the start-up path)

        row = np.full(self.n_channels, -1)
        row[list(channels)] = np.arange(len(channels))
        gather(np.ascontiguousarray(self._filtered_light(spectra)), self.parts, self.place, row[self.through], out)

    def folded(self, weights: Float[Array, "cases pixels"], channel: int) -> Float[Array, "cases wavelengths"]:
        """Sum light through one channel's filter over the elements."""
        by_place = np.zeros((len(weights), len(self.values)))
        for share, place, through in zip(self.parts, self.place, self.through, strict=True):
            at = np.flatnonzero(through == channel)
            for case in range(len(weights)):
                np.add.at(by_place[case], place[case, at], share * weights[case, at])
        folded = by_place @ self.values
        return np.asarray((folded if self.shares is None else folded @ self.shares) * self.factor, dtype=float)


@dataclass(frozen=True)
class PixelResponse:
    """Weights of a scene.

    `source`: light, as an array or in factors; `uniform`: weights of a uniform background, not dimmed by air or lens;
    `readout`: weight of each element in the value of each channel; `spread`: weight of its variance in that of the
    channel; `by_channel`: True if each element is a channel; else it is a pixel.
    """

    source: Float[Array, "cases pixels channels _wavelengths"] | SplitLight
    uniform: Float[Array, "cases pixels channels"]
    readout: Float[Array, "cases pixels channels"]
    spread: Float[Array, "cases pixels channels"]
    by_channel: bool

    @cached_property
    def light(self) -> Float[Array, "cases pixels signals wavelengths"]:
        """Light on each element through each channel's filter, relative to a uniform field on axis in clear air."""
        return self.source.whole() if isinstance(self.source, SplitLight) else self.source

    @property
    def shape(self) -> tuple[int, int]:
        """Number of phases and elements."""
        return self.source.shape[0], self.source.shape[1]


def without_filters(setup: Setup) -> Setup:
    """Return the setup without filters, which responses do not depend on."""
    camera = setup.camera
    dark = {"qe": np.zeros_like(camera.qe), "clear_qe": np.zeros_like(camera.clear_qe)}
    return setup.with_camera(mosaic=camera.mosaic.without_filters, modified=(), technologies=(), **dark)


def pixel_response(setup: Setup, phases: Phases | None, *, by_pixel: bool) -> PixelResponse:
    """Compute the pixel response at every wavelength of the grid, one field position after the other.

    `phases`: sampling phases of a target; None if the light fills the field; `by_pixel`: keep single pixels, for a
    nonlinear readout.
    """
    wavelength_nm = setup.camera.grid.nodes_nm
    if setup.scene.field is not None:
        return _joined([pixel_response(position, phases, by_pixel=by_pixel) for position in over_field(setup)])
    if phases is None:
        response = _uniform(setup, by_pixel=by_pixel)
        return replace(response, source=response.light * path_factor(setup, wavelength_nm))
    knots = psf.psf_knots_nm(wavelength_nm, setup.accuracy.psf_step_nm)
    if by_pixel:
        response = _pixels(setup, knots, phases, by_pixel=True)
    else:
        step = max(1, _HELD // (pixels_per_phase(setup) * max(len(setup.camera.mosaic.channels) ** 2, knots.size)))
        blocks = [phases.subset(slice(at, at + step)) for at in range(0, len(phases), step)]
        response = _joined([_pixels(setup, knots, block, by_pixel=False) for block in blocks])
    same = knots.size == wavelength_nm.size or _one_light(response.source)
    between = None if same else linear_basis(wavelength_nm, knots)
    factor = path_factor(setup, wavelength_nm)
    if isinstance(response.source, SplitLight):
        shares = response.source.shares
        shares = shares if shares is None or between is None else shares @ between
        return replace(response, source=replace(response.source, shares=shares, factor=factor))
    return replace(response, source=(response.light if between is None else response.light @ between) * factor)


def _one_light(source: Float[Array, "cases pixels channels wavelengths"] | SplitLight) -> bool:
    """Return whether all wavelengths are equal."""
    return source.shares is None if isinstance(source, SplitLight) else bool(source.shape[-1] == 1)


class ChannelResponses:
    """Cache of channel responses by phase, shared by CFAs with equal tiles; thread-safe."""

    def __init__(self) -> None:
        self._known: dict[tuple[float, ...], tuple[FloatArray, FloatArray]] = {}
        self._one_at_a_time = threading.Lock()

    def at(self, setup: Setup, phases: Phases) -> PixelResponse:
        """Return the response at some phases."""
        keys = phases.keys
        with self._one_at_a_time:
            new = [at for at, key in enumerate(keys) if key not in self._known]
            if new:
                response = pixel_response(setup, phases.subset(np.array(new)), by_pixel=False)
                if (len(self._known) + len(new)) * response.light[0].nbytes > _KEPT_BYTES:
                    self._known.clear()
                    return response if len(new) == len(keys) else pixel_response(setup, phases, by_pixel=False)
                parts = zip(response.light, response.uniform, strict=True)
                self._known.update(zip((keys[at] for at in new), parts, strict=True))
            light, uniform = (np.stack(part) for part in zip(*(self._known[key] for key in keys), strict=True))
        weights = np.repeat(np.eye(uniform.shape[2])[None], len(keys), axis=0)
        return PixelResponse(light, uniform, weights, weights, by_channel=True)


_CHANNELS: Cache[bytes, ChannelResponses] = Cache(4)
_RESPONSES: Cache[bytes, PixelResponse] = Cache(8)
"""The latest ones: CFAs with tiles of one pattern share theirs."""


def channel_responses(setup: Setup) -> ChannelResponses:
    """Return the cache of the responses of a target's channels in a scene."""
    return _CHANNELS.get(hashlib.sha256(pickle.dumps(without_filters(setup))).digest(), ChannelResponses)


def kept_response(setup: Setup, phases: Phases | None, *, by_pixel: bool) -> PixelResponse:
    """Return the pixel response at the phases of the scene; small ones are cached.

    `by_pixel`: keep single pixels.
    """
    heights = field_heights(setup)  # filters that move need more positions than those that do not
    count = 1 if phases is None else len(phases)
    if (
        by_pixel
        or 8 * count * len(heights) * len(setup.camera.mosaic.channels) ** 2 * setup.camera.grid.size > _KEPT_BYTES
    ):
        return pixel_response(setup, phases, by_pixel=by_pixel)
    key = hashlib.sha256(pickle.dumps((heights, count, without_filters(setup)))).digest()
    # The heights are those of the setup's own filters, which a colorless one does not have.
    return _RESPONSES.get(key, lambda: pixel_response(setup, phases, by_pixel=False))


def _uniform(setup: Setup, *, by_pixel: bool) -> PixelResponse:
    """Return the response of a field without structure, for which one tile stands."""
    tile, n = setup.camera.mosaic.indices, len(setup.camera.mosaic.channels)
    of_channel = (tile[..., None] == np.arange(n)).astype(float)
    share = sampling.crosstalk_share(setup)
    split = sampling.with_crosstalk(of_channel[None], share, periodic=True).reshape(1, tile.size, n, 1)
    weights = of_channel.reshape(-1, n) / setup.camera.mosaic.counts
    if by_pixel and share and tile.size > n:
        return PixelResponse(split, split[..., 0], weights[None], weights[None] ** 2, by_channel=False)
    folded = np.einsum("uc,xukl->xckl", weights, split)
    return PixelResponse(
        folded, folded[..., 0], np.eye(n)[None], np.diag(1 / setup.camera.mosaic.counts)[None], by_channel=True
    )


def _joined(parts: list[PixelResponse]) -> PixelResponse:
    if len(parts) == 1:
        return parts[0]
    arrays = ([part.light, part.uniform, part.readout, part.spread] for part in parts)
    light, uniform, readout, spread = (np.concatenate(values) for values in zip(*arrays, strict=True))
    return PixelResponse(light, uniform, readout, spread, parts[0].by_channel)


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


def _pixels(setup: Setup, wavelength_nm: PerWavelength, phases: Phases, *, by_pixel: bool) -> PixelResponse:
    """Return the response of every pixel of the readout at every phase."""
    target, pixel, n = setup.scene.target, setup.camera.pixel, len(setup.camera.mosaic.channels)
    assert target is not None
    radius, half = sampling.radii_px(setup, target)[0], pixel.fill_factor**0.5 / 2
    window, of_channel, readout_weights = _weights(setup, phases)
    share = sampling.crosstalk_share(setup)
    spread = sampling.with_crosstalk(readout_weights, share) if share else readout_weights
    has_weight = np.asarray((spread > 0).any(axis=3))
    profile = _profile(setup, wavelength_nm)
    light = disc_image.light_on_pixels(window, has_weight, half, radius, profile, pixel.pitch_um)
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
    taken = [((1 - share), rows, columns)]
    if share:  # see `with_crosstalk`; a pixel at the border has no weight
        steps = ((-1, 0), (1, 0), (0, -1), (0, 1))
        taken += [(share / 4, rows + down, columns + right) for down, right in steps]
    n = of_channel.shape[2]
    uniform = np.zeros((len(readout_weights), rows.size, n))
    pixels, channel = np.arange(rows.size), of_channel.argmax(axis=2)
    for part, row, column in taken:
        uniform[:, pixels, channel[row, column]] += part
    parts = np.array([part for part, _, _ in taken])
    place = np.stack([light.place[:, row, column] for _, row, column in taken])
    through = np.stack([channel[row, column] for _, row, column in taken])
    split = SplitLight(light.values, light.shares, np.ones(1), parts, place, through, n)
    readout = readout_weights[:, used]
    return PixelResponse(split, uniform, readout, readout**2, by_channel=False)
