"""What a readout sees of each channel's quantum efficiency: the linear effects, put together in their physical order.

Optics do not depend on the filter. So everything between the scene and the pixels' electrons is a weight per wavelength
for each unit of the readout (a channel's mean, or a single pixel) and each channel whose filter it looks through.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, fields, replace

import numpy as np

from ..types import FloatArray
from .effects import blur, crosstalk, demosaic, extinction, illumination, phase, sampling
from .view import REFERENCE, Methods, Setup

_HELD = 8_000_000
"""Values of pixels that are held at once."""
MOST_BYTES = 2 * 2**30
"""What the images of a scene may take of a worker's memory."""
_COPIES = 4
"""So many arrays of the size of a kernel are held while it is made."""


@dataclass(frozen=True)
class Kernel:
    """Weights of a scene.

    `light`: ndarray[n_cases, n_units, n_channels, n_wavelengths], what a unit gets of a signal's light through each
    channel's filter, relative to a uniform field on axis in clear air. `uniform`: ndarray[n_cases, n_units,
    n_channels], the same of a uniform background. `readout`: ndarray[n_cases, n_units, n_channels], weight of each
    unit in the value of each channel, `spread`: of its variance in that of the channel. A case is a place of the light
    on the mosaic.
    """

    light: FloatArray
    uniform: FloatArray
    readout: FloatArray
    spread: FloatArray


def make_kernel(
    setup: Setup,
    methods: Methods,
    wavelength_nm: FloatArray,
    *,
    by_pixel: bool,
    work: Counter[str],
    cases: phase.Cases | None = None,
) -> Kernel:
    """The kernel at some wavelengths; `by_pixel` keeps the pixels apart, for a readout that is not straight.

    `cases`: places of the light instead of those of the method of `phase`.
    """
    if setup.scenario.target is None:
        made = _uniform(setup, methods, by_pixel=by_pixel)
        light = made.light
    elif methods.sampling == "skip":
        made = _ideal(setup, methods, wavelength_nm)
        light = made.light
    else:
        knots = blur.knots(wavelength_nm, methods.blur)
        cases = phase.cases(setup, methods.phase) if cases is None else cases
        if by_pixel:
            made = _pixels(setup, methods, knots, cases, by_pixel=True, work=work)
        else:
            step = max(1, _HELD // (pixels_per_place(setup) * max(len(setup.mosaic.channels) ** 2, knots.size)))
            blocks = [cases.some(slice(at, at + step)) for at in range(0, len(cases.places_px), step)]
            made = _joined([_pixels(setup, methods, knots, block, by_pixel=False, work=work) for block in blocks])
        light = made.light if knots is wavelength_nm else _interpolated(made.light, knots, wavelength_nm)
    falls = illumination.factor(setup, methods.illumination)
    dimmed = falls * extinction.transmittance(setup, methods.extinction, wavelength_nm)
    return replace(made, light=light * dimmed, uniform=made.uniform * falls)


def _interpolated(light: FloatArray, knots: FloatArray, wavelength_nm: FloatArray) -> FloatArray:
    """Linear between the knots along the last axis."""
    if light.shape[-1] == 1:
        return light
    hats = np.stack([np.interp(wavelength_nm, knots, unit) for unit in np.eye(knots.size)])
    return np.asarray(light @ hats, dtype=float)


def _share(setup: Setup, methods: Methods) -> float:
    return 0.0 if methods.crosstalk == "skip" else setup.pixel.crosstalk


def _uniform(setup: Setup, methods: Methods, *, by_pixel: bool) -> Kernel:
    """A field without structure: one tile stands for all."""
    tile, n = setup.mosaic.indices, len(setup.mosaic.channels)
    own = (tile[..., None] == np.arange(n)).astype(float)
    share = _share(setup, methods)
    split = crosstalk.mixed(own[None], share, periodic=True).reshape(1, tile.size, n, 1)
    weights = own.reshape(-1, n) / setup.mosaic.counts
    if by_pixel and share:
        return Kernel(split, split[..., 0], weights[None], weights[None] ** 2)
    folded = np.einsum("uc,xukl->xckl", weights, split)
    return Kernel(folded, folded[..., 0], np.eye(n)[None], np.diag(1 / setup.mosaic.counts)[None])


def _ideal(setup: Setup, methods: Methods, wavelength_nm: FloatArray) -> Kernel:
    """No pixels: every channel sees the mean over the readout, or the image's very center."""
    target = setup.scenario.target
    assert target is not None
    uniform = _uniform(setup, methods, by_pixel=False).uniform
    radius, readout = (r * setup.pixel.pitch_um for r in sampling.radii_px(setup, target))
    if target.readout == "center":
        readout = 1e-3 * setup.pixel.pitch_um
    lost = np.full(wavelength_nm.size, min(1.0, radius / readout) ** 2)
    if methods.blur != "skip":
        w20_um = blur.defocus_um(setup.scenario, setup.pixel.pitch_um)
        knots = blur.knots(wavelength_nm, methods.blur)
        kept = blur.mean_over_disc(radius, readout, knots * 1e-3, setup.scenario.optics.f_number, w20_um)
        lost = np.interp(wavelength_nm, knots, kept)
    own = np.eye(uniform.shape[-1])[None]
    return Kernel(uniform[..., None] * lost, uniform, own, own)


def pixels_per_place(setup: Setup) -> int:
    """About how many pixels are looked at around each place of a light."""
    target, rows_columns = setup.scenario.target, setup.mosaic.indices.shape
    if target is None:
        return int(np.prod(rows_columns))
    reach = sampling.reach_px(setup, target)
    return int(np.prod([2 * reach + n + 3 for n in rows_columns]))


def bytes_per_place(setup: Setup, *, by_pixel: bool) -> int:
    """About how much memory the kernel of one place of a light takes while it is made."""
    n = len(setup.mosaic.channels)
    units = pixels_per_place(setup) if by_pixel else n
    return 8 * _COPIES * units * n * setup.grid.size


def blocks(setup: Setup, cases: phase.Cases) -> list[phase.Cases]:
    """Places whose kernels, pixel by pixel, fit into half of `MOST_BYTES` together."""
    step = max(1, MOST_BYTES // 2 // bytes_per_place(setup, by_pixel=True))
    return [cases.some(slice(at, at + step)) for at in range(0, len(cases.places_px), step)]


def too_large(setup: Setup) -> tuple[str, str, str] | None:
    """Why a target's kernel is not computed: problem, value, what is allowed; None when it is."""
    if setup.scenario.target is None:
        return None
    channels = f"{len(setup.mosaic.channels)} channels and {setup.grid.size} wavelengths"
    if (one := bytes_per_place(setup, by_pixel=True)) > MOST_BYTES:
        problem = f"{pixels_per_place(setup):,} pixels around the light, of {channels}, take too much memory"
        return problem, f"{one / 2**30:.1f} GiB", f"at most {MOST_BYTES / 2**30:g} GiB"
    places = len(phase.places_px(setup, REFERENCE.phase))
    if places > phase.MOST:
        problem = f"a light at any place of a tile of {setup.mosaic.indices.size:,} pixels has too many places"
        return problem, f"{places:,}", f"at most {phase.MOST:,} (a tile of {phase.MOST // 16} pixels), or a named place"
    if (every := places * bytes_per_place(setup, by_pixel=False)) > MOST_BYTES:
        problem = f"{places:,} places of the light, of {channels}, take too much memory"
        return problem, f"{every / 2**30:.1f} GiB", f"at most {MOST_BYTES / 2**30:g} GiB"
    return None


def _joined(parts: list[Kernel]) -> Kernel:
    if len(parts) == 1:
        return parts[0]
    names = [field.name for field in fields(Kernel)]
    return Kernel(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))


def profile_of(setup: Setup, methods: Methods, wavelength_nm: FloatArray) -> blur.Profile | None:
    """The light's blurred image, as far as any pixel of the readout can be; None where blur is left out."""
    target = setup.scenario.target
    if target is None or methods.blur == "skip":
        return None
    pitch_um = setup.pixel.pitch_um
    furthest_px = 2**0.5 * (sampling.reach_px(setup, target) + 2.5)
    sizes = (sampling.radii_px(setup, target)[0] * pitch_um, furthest_px * pitch_um)
    w20_um = blur.defocus_um(setup.scenario, pitch_um)
    return blur.profile(*sizes, tuple(wavelength_nm * 1e-3), setup.scenario.optics.f_number, w20_um)


def _pixels(
    setup: Setup,
    methods: Methods,
    wavelength_nm: FloatArray,
    cases: phase.Cases,
    *,
    by_pixel: bool,
    work: Counter[str],
) -> Kernel:
    """Every pixel of the readout, for every place of the light."""
    target, pixel, n = setup.scenario.target, setup.pixel, len(setup.mosaic.channels)
    assert target is not None
    radius, half = sampling.radii_px(setup, target)[0], pixel.fill_factor**0.5 / 2
    seen, own, apart = _weights(setup, methods, cases)
    share = _share(setup, methods)
    spread = crosstalk.mixed(apart, share) if share else apart
    wanted = np.asarray((spread > 0).any(axis=3))
    profile = profile_of(setup, methods, wavelength_nm)
    if profile is not None:
        work["blur"] += profile.work
    light = sampling.light_on_pixels(seen, wanted, half, radius, profile, pixel.pitch_um)
    work["sampling"] += light.values.size
    if by_pixel:
        return _apart(light, own, apart, share)
    # What each channel's readout takes of the pixels of each channel: [cases, rows, columns, channels x channels].
    taken = spread[..., :, None] * own[..., None, :]
    shape = (len(apart), n, n)
    folded = light.folded(taken.reshape(*taken.shape[:3], n * n)).reshape(*shape, light.values.shape[1])
    weights = np.repeat(np.eye(n)[None], len(apart), axis=0)
    return Kernel(folded, taken.sum(axis=(1, 2)), weights, weights)


def _weights(setup: Setup, methods: Methods, cases: phase.Cases) -> tuple[sampling.Window, FloatArray, FloatArray]:
    """The pixels around the light, whose channel each is, ndarray[rows, columns, n_channels], and its weight in the
    value of each, ndarray[n_cases, rows, columns, n_channels].
    """
    target, mosaic, n = setup.scenario.target, setup.mosaic, len(setup.mosaic.channels)
    assert target is not None
    seen = sampling.window(mosaic, cases.places_px, sampling.reach_px(setup, target))
    if target.readout == "mean":
        half, readout = setup.pixel.fill_factor**0.5 / 2, sampling.radii_px(setup, target)[1]
        weights = sampling.mean_weights(seen, half, readout, n)
    else:
        weights = demosaic.center_weights(seen, cases.home_px - cases.places_px, methods.demosaic, mosaic)
    own = (seen.channel[..., None] == np.arange(n)).astype(float)
    return seen, own, weights[..., None] * own


def readout_of(setup: Setup, methods: Methods, cases: phase.Cases, like: Methods) -> FloatArray:
    """`Kernel.readout` of some methods on the pixels that `like` reads, ndarray[n_cases, n_pixels, n_channels]."""
    used = (_weights(setup, like, cases)[2] > 0).any(axis=(0, 3))
    return _weights(setup, methods, cases)[2][:, used]


def _apart(light: sampling.PixelLight, own: FloatArray, apart: FloatArray, share: float) -> Kernel:
    """The pixels one by one: those with a weight in any readout."""
    used = (apart > 0).any(axis=(0, 3))
    split = light.by_pixel()[..., None, :] * own[None, ..., None]
    uniform = own[None]
    if share:
        split, uniform = crosstalk.mixed(split, share), crosstalk.mixed(uniform, share)
    readout = apart[:, used]
    return Kernel(split[:, used], np.repeat(uniform[:, used], len(apart), axis=0), readout, readout**2)
