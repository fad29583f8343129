"""What a readout sees of each channel's quantum efficiency: the linear effects, put together in their physical order.

Optics do not depend on the filter. So everything between the scene and the pixels' electrons is a weight per wavelength
for each unit of the readout (a channel's mean, or a single pixel) and each channel whose filter it looks through.
"""

from __future__ import annotations

import hashlib
import pickle
from collections import Counter
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from ..base.cache import Cache
from ..base.types import FloatArray
from ..curves.hats import hats
from .effects import blur, crosstalk, demosaic, phase, sampling
from .field import over_field
from .kernel_size import pixels_per_place
from .methods import Methods
from .mosaic import Mosaic
from .registry import factor_of_light
from .split_light import SplitLight
from .view import View

_HELD = 8_000_000
"""Values of pixels that are held at once."""
_KEPT_BYTES = 16 * 2**20
"""Kernels that take more are not kept."""


@dataclass(frozen=True)
class Kernel:
    """Weights of a scene.

    `source`: `light` as an array, or, of the pixels of a target, in factors. `uniform`: ndarray[n_cases, n_units,
    n_channels], the same of a uniform background, which nothing has dimmed yet. `readout`: ndarray[n_cases, n_units,
    n_channels], weight of each unit in the value of each channel, `spread`: of its variance in that of the channel. A
    case is a place of the light on the mosaic. `by_channel`: whether each unit is a channel; else it is a pixel.
    """

    source: FloatArray | SplitLight
    uniform: FloatArray
    readout: FloatArray
    spread: FloatArray
    by_channel: bool

    @cached_property
    def light(self) -> FloatArray:
        """What a unit gets of a signal's light through each channel's filter, relative to a uniform field on axis in
        clear air, ndarray[n_cases, n_units, n_channels, n_wavelengths].
        """
        return self.source.whole() if isinstance(self.source, SplitLight) else self.source

    @property
    def shape(self) -> tuple[int, int]:
        """Cases and units."""
        return self.source.shape[0], self.source.shape[1]


def colorless(view: View) -> View:
    """What kernels depend on: the view without filters, which is the same for all CFAs whose tiles are alike."""
    nothing = np.zeros_like(view.qe)
    bare = replace(view, mosaic=view.mosaic.colorless, modified=(), technologies=())
    return replace(bare, qe=nothing, clear_qe=np.zeros_like(view.clear_qe))


def make_kernel(
    view: View,
    methods: Methods,
    wavelength_nm: FloatArray,
    *,
    by_pixel: bool,
    work: Counter[str],
    cases: phase.Cases | None = None,
) -> Kernel:
    """The kernel at some wavelengths, of one place of the field after the other.

    `by_pixel` keeps the pixels apart, for a readout that is not straight. `cases`: places of the light on the mosaic
    instead of those of the method of `phase`.
    """
    places = over_field(replace(view, methods=methods))
    if view.scenario.field is not None:
        given = partial(make_kernel, by_pixel=by_pixel, work=work, cases=cases)
        return _joined([given(place, methods, wavelength_nm) for place in places])
    if view.scenario.target is None:
        made = _uniform(view, methods, by_pixel=by_pixel)
        light = made.light
    elif methods.sampling == "skip":
        made = _ideal(view, methods, wavelength_nm)
        light = made.light
    else:
        knots = blur.knots(wavelength_nm, methods.blur)
        cases = phase.cases(view, methods.phase) if cases is None else cases
        if by_pixel:
            made = _pixels(view, methods, knots, cases, by_pixel=True, work=work)
        else:
            step = max(1, _HELD // (pixels_per_place(view) * max(len(view.mosaic.channels) ** 2, knots.size)))
            blocks = [cases.some(slice(at, at + step)) for at in range(0, len(cases.places_px), step)]
            made = _joined([_pixels(view, methods, knots, block, by_pixel=False, work=work) for block in blocks])
        same = knots is wavelength_nm or _one_light(made.source)
        between = None if same else hats(wavelength_nm, knots)
        if isinstance(made.source, SplitLight):
            factor = np.broadcast_to(factor_of_light(view, methods, wavelength_nm), wavelength_nm.shape)
            shares = made.source.shares
            shares = shares if shares is None or between is None else shares @ between
            return replace(made, source=replace(made.source, shares=shares, factor=factor))
        light = made.light if between is None else made.light @ between
    return replace(made, source=light * factor_of_light(view, methods, wavelength_nm))


def _one_light(source: FloatArray | SplitLight) -> bool:
    """Whether every wavelength sees the same."""
    return source.shares is None if isinstance(source, SplitLight) else bool(source.shape[-1] == 1)


KERNELS: Cache[bytes, tuple[Kernel, Counter[str]]] = Cache(8)
"""The latest kernels of channels: CFAs with tiles of one pattern share theirs."""


def kept_kernel(view: View, *, by_pixel: bool, work: Counter[str]) -> Kernel:
    """`make_kernel` of a view at every wavelength, for all places of its method; kept where it is small.

    `work` counts a kept one as if it was made.
    """
    wave = view.grid.nodes_nm
    over = len(over_field(view))  # filters that move need more places than those that do not
    places = phase.n_places(view, view.methods.phase) * over
    if by_pixel or 8 * places * len(view.mosaic.channels) ** 2 * wave.size > _KEPT_BYTES:
        return make_kernel(view, view.methods, wave, by_pixel=by_pixel, work=work)

    def made() -> tuple[Kernel, Counter[str]]:
        own: Counter[str] = Counter()
        return make_kernel(view, view.methods, wave, by_pixel=False, work=own), own

    kernel, own = KERNELS.get(hashlib.sha256(pickle.dumps((over, colorless(view)))).digest(), made)
    work.update(own)
    return kernel


def _uniform(view: View, methods: Methods, *, by_pixel: bool) -> Kernel:
    """A field without structure: one tile stands for all."""
    tile, n = view.mosaic.indices, len(view.mosaic.channels)
    own = (tile[..., None] == np.arange(n)).astype(float)
    share = crosstalk.share(view, methods.crosstalk)
    split = crosstalk.mixed(own[None], share, periodic=True).reshape(1, tile.size, n, 1)
    weights = own.reshape(-1, n) / view.mosaic.counts
    if by_pixel and share and tile.size > n:
        return Kernel(split, split[..., 0], weights[None], weights[None] ** 2, by_channel=False)
    folded = np.einsum("uc,xukl->xckl", weights, split)
    return Kernel(folded, folded[..., 0], np.eye(n)[None], np.diag(1 / view.mosaic.counts)[None], by_channel=True)


def _ideal(view: View, methods: Methods, wavelength_nm: FloatArray) -> Kernel:
    """No pixels: every channel sees the mean over the readout, or the image's very center."""
    target = view.scenario.target
    assert target is not None
    uniform = _uniform(view, methods, by_pixel=False).uniform
    radius, readout = (r * view.pixel.pitch_um for r in sampling.radii_px(view, target))
    if target.readout == "center":
        readout = 1e-3 * view.pixel.pitch_um
    lost = np.full(wavelength_nm.size, min(1.0, radius / readout) ** 2)
    if methods.blur != "skip":
        w20_um = blur.defocus_um(view.scenario, view.pixel.pitch_um)
        knots = blur.knots(wavelength_nm, methods.blur)
        kept = blur.mean_over_disc(radius, readout, knots * 1e-3, view.scenario.optics.f_number, w20_um)
        lost = np.interp(wavelength_nm, knots, kept)
    own = np.eye(uniform.shape[-1])[None]
    return Kernel(uniform[..., None] * lost, uniform, own, own, by_channel=True)


def _joined(parts: list[Kernel]) -> Kernel:
    if len(parts) == 1:
        return parts[0]
    arrays = ([part.light, part.uniform, part.readout, part.spread] for part in parts)
    light, uniform, readout, spread = (np.concatenate(each) for each in zip(*arrays, strict=True))
    return Kernel(light, uniform, readout, spread, parts[0].by_channel)


def pixels_of_tile(made: Kernel, mosaic: Mosaic) -> Kernel:
    """The pixels of one tile, each as the unit of its channel, of a kernel whose units are channels."""
    channel = mosaic.indices.ravel()
    own = np.eye(len(mosaic.channels))[channel] / mosaic.counts
    return Kernel(made.light[:, channel], made.uniform[:, channel], own[None], own[None] ** 2, by_channel=False)


def profile_of(view: View, methods: Methods, wavelength_nm: FloatArray) -> blur.Profile | None:
    """The light's blurred image, as far as any pixel of the readout can be; None where blur is left out."""
    target = view.scenario.target
    if target is None or methods.blur == "skip":
        return None
    pitch_um = view.pixel.pitch_um
    furthest_px = 2**0.5 * (sampling.reach_px(view, target) + 2.5)
    sizes = (sampling.radii_px(view, target)[0] * pitch_um, furthest_px * pitch_um)
    w20_um = blur.defocus_um(view.scenario, pitch_um)
    return blur.profile(*sizes, tuple(wavelength_nm * 1e-3), view.scenario.optics.f_number, w20_um)


def _pixels(
    view: View,
    methods: Methods,
    wavelength_nm: FloatArray,
    cases: phase.Cases,
    *,
    by_pixel: bool,
    work: Counter[str],
) -> Kernel:
    """Every pixel of the readout, for every place of the light."""
    target, pixel, n = view.scenario.target, view.pixel, len(view.mosaic.channels)
    assert target is not None
    radius, half = sampling.radii_px(view, target)[0], pixel.fill_factor**0.5 / 2
    seen, own, apart = _weights(view, methods, cases)
    share = crosstalk.share(view, methods.crosstalk)
    spread = crosstalk.mixed(apart, share) if share else apart
    wanted = np.asarray((spread > 0).any(axis=3))
    profile = profile_of(view, methods, wavelength_nm)
    if profile is not None:
        work["blur"] += profile.work
    light = sampling.light_on_pixels(seen, wanted, half, radius, profile, pixel.pitch_um)
    work["sampling"] += light.values.size
    if by_pixel:
        return _apart(light, own, apart, share)
    # What each channel's readout takes of the pixels of each channel: [cases, rows, columns, channels x channels].
    taken = spread[..., :, None] * own[..., None, :]
    shape = (len(apart), n, n)
    folded = light.folded(taken.reshape(*taken.shape[:3], n * n)).reshape(*shape, -1)
    weights = np.repeat(np.eye(n)[None], len(apart), axis=0)
    return Kernel(folded, taken.sum(axis=(1, 2)), weights, weights, by_channel=True)


def _weights(view: View, methods: Methods, cases: phase.Cases) -> tuple[sampling.Window, FloatArray, FloatArray]:
    """The pixels around the light, whose channel each is, ndarray[rows, columns, n_channels], and its weight in the
    value of each, ndarray[n_cases, rows, columns, n_channels].
    """
    target, mosaic, n = view.scenario.target, view.mosaic, len(view.mosaic.channels)
    assert target is not None
    seen = sampling.window(mosaic, cases.places_px, sampling.reach_px(view, target))
    if target.readout == "mean":
        half, readout = view.pixel.fill_factor**0.5 / 2, sampling.radii_px(view, target)[1]
        weights = sampling.mean_weights(seen, half, readout, n)
    else:
        weights = demosaic.center_weights(seen, cases.home_px - cases.places_px, methods.demosaic, mosaic)
    own = (seen.channel[..., None] == np.arange(n)).astype(float)
    return seen, own, weights[..., None] * own


def readout_of(view: View, methods: Methods, cases: phase.Cases, like: Methods) -> FloatArray:
    """`Kernel.readout` of some methods on the pixels that `like` reads, ndarray[n_cases, n_pixels, n_channels]."""
    used = (_weights(view, like, cases)[2] > 0).any(axis=(0, 3))
    return _weights(view, methods, cases)[2][:, used]


def _apart(light: sampling.PixelLight, own: FloatArray, apart: FloatArray, share: float) -> Kernel:
    """The pixels one by one: those with a weight in any readout."""
    used = (apart > 0).any(axis=(0, 3))
    rows, columns = np.nonzero(used)
    taken = [((1 - share), rows, columns)]
    if share:  # see `crosstalk.mixed`; a pixel at the border has no weight
        steps = ((-1, 0), (1, 0), (0, -1), (0, 1))
        taken += [(share / 4, rows + down, columns + right) for down, right in steps]
    n = own.shape[2]
    uniform = np.zeros((len(apart), rows.size, n))
    pixels, channel = np.arange(rows.size), own.argmax(axis=2)
    for part, row, column in taken:
        uniform[:, pixels, channel[row, column]] += part
    parts = np.array([part for part, _, _ in taken])
    place = np.stack([light.place[:, row, column] for _, row, column in taken])
    through = np.stack([channel[row, column] for _, row, column in taken])
    split = SplitLight(light.values, light.shares, np.ones(1), parts, place, through, n)
    readout = apart[:, used]
    return Kernel(split, uniform, readout, readout**2, by_channel=False)
