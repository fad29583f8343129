"""Error probability of two signal types by exact sums over the digital numbers, where these are few.

Each channel's value is the sum of a few independent pixels with Poisson electrons, full well, read noise, pedestal and
ADC range, rounded.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from ...base.types import Array, Float, FloatArray, IndexArray, Int, MemberNumbers, PerDesign
from ...spectra.lights import Pair, class_pairs
from ..mosaic import Mosaic
from ..pixel import Pixel
from ..scene import Scene
from .merged_numbers import merged_numbers
from .merged_readings import countable

FLOOR = 1e-18
"""Largest contribution of neglected tails to an error."""
_FAR = 14.0
"""Standard deviations beyond which readings of a pixel are left out."""
_LEAST_BINS = 1e-4
"""Read noise below this, in bins, moves nothing into another bin."""
_NATS = 0.25
"""A step of the log-likelihood ratio is this over the number of channels: errors are exact within exp(1/16)."""
_AT_ONCE = 4096
"""Signals of designs whose digital numbers are held at once."""
_MOST_SUMS = 3e8
"""Additions that a signal's digital numbers may take: a fifth of a second. Sensors of 16 bit and 10^6 e stay below."""
_MOST_PIXELS, _MOST_MERGED = 16, 4
"""Pixels of a channel, read once and of merged captures: their bins, of one pixel's noise, tell sums of more less well
than Q(r) does."""
_MOST_BINS = 1_000_000
"""Bins of one pixel; those of 51 signals in four channels take 1.6 GiB."""


def _bins(pixel: Pixel) -> tuple[int, float, int]:
    """Return digital numbers per bin, read noise in bins, and number of bins.

    A bin is a quarter of the noise of every count, or of an electron.
    """
    wide = max(1, int(max(pixel.read_noise_e, 1.0) * min(pixel.dn_per_e, pixel.full_scale_dn) / 4))
    return wide, pixel.read_noise_e * pixel.dn_per_e / wide, pixel.full_scale_dn // wide + 1


def few_pixels(scene: Scene, pixel: Pixel, mosaic: Mosaic) -> bool:
    """Return whether a channel is the mean of so few pixels that their sums are made; never of a target's."""
    most = _MOST_MERGED if pixel.captures else _MOST_PIXELS
    return scene.target is None and mosaic.counts.max() <= most and affordable(pixel, int(mosaic.counts.max()))


def affordable(pixel: Pixel, pixels: int) -> bool:
    """Return whether sums over so many pixels take at most `_MOST_SUMS` additions and `_MOST_BINS` bins."""
    if pixel.captures:
        return countable(pixel)
    (wide, sigma, n_bins), prnu = _bins(pixel), pixel.prnu
    most = math.ceil(pixel.well_e)
    electrons = min(most / max(1 - _FAR * prnu, 0.01), 100 * pixel.well_e + 1e5)
    counts_of_gain = 2 * _FAR * math.sqrt(electrons) + 125  # counts of one gain
    gains = 2 * _FAR * 1.3 * math.sqrt(1 + prnu**2 * electrons) + 3 if prnu else 1
    counts = min(most, 2 * _FAR * prnu * electrons + counts_of_gain) + 1
    reach = 2 * _FAR * sigma + 3
    bins = min(n_bins, counts * pixel.dn_per_e / wide + reach)
    sums = 10 * gains * counts_of_gain + counts * reach + (64 / sigma * reach if sigma > _LEAST_BINS else 0)
    return bins * pixels <= _MOST_BINS and sums + (bins * (pixels - 1)) ** 2 <= _MOST_SUMS


def _numbers(
    electrons: Float[Array, "captures signals pixels"], channels: Sequence[Int[IndexArray, " _pixels"]], pixel: Pixel
) -> tuple[
    Int[IndexArray, " numbers"],
    Int[IndexArray, " _parts"],
    Float[Array, " _rows"],
    Int[IndexArray, "_numbers captures signals"],
]:
    """Return first bin, start and roots of shares of each distinct signal, and the row of each design's signal."""
    from .error_kernels import bin_shares, channel_numbers  # noqa: PLC0415  (compiled: kept off the start-up path)

    wide, sigma, n_bins = _bins(pixel)
    table = bin_shares(sigma) if sigma > _LEAST_BINS else np.empty((0, 0))
    line = pixel.dn_per_e / wide, (pixel.offset_dn + 0.5) / wide
    read = math.ceil(pixel.well_e), pixel.well_e, pixel.prnu, pixel.read_noise_e, line, n_bins, table
    firsts, starts, shares, rows = list[IndexArray](), [np.zeros(1, np.intp)], list[FloatArray](), list[IndexArray]()
    for pixels_of_channel in channels:
        flat = np.ascontiguousarray(
            np.sort(electrons[..., pixels_of_channel], axis=-1).reshape(-1, len(pixels_of_channel))
        )
        distinct, which = np.unique(flat, axis=0, return_inverse=True)
        first, start, share = channel_numbers(distinct, *read)
        rows.append(which.reshape(electrons.shape[:2]) + sum(first.size for first in firsts))
        starts.append(start[1:] + starts[-1][-1])
        firsts.append(first)
        shares.append(share)
    return np.concatenate(firsts), np.concatenate(starts), np.sqrt(np.concatenate(shares)), np.stack(rows)


def errors(
    electrons: Float[Array, "*captures designs signals pixels"],
    channels: Sequence[Int[IndexArray, " _pixels"]],
    pixel: Pixel,
    members: Mapping[str, MemberNumbers],
    light: Float[Array, "captures pixels"] | None = None,
) -> dict[Pair, PerDesign]:
    """Compute the errors of a batch of designs.

    The error of two signals is that of the maximum likelihood rule, the least of any rule: half the sum of the smaller
    of both probabilities over all readouts.

    `electrons`: expected electrons of each pixel; of an HDR pixel those of each exposure, on the first axis; `light`:
    light of the exposures of an HDR pixel relative to that of a pixel of full sensitivity.
    """
    from . import error_kernels as kernels  # noqa: PLC0415  (compiled: kept off the start-up path)

    used = np.unique(np.concatenate(list(members.values())))
    members = {name: np.searchsorted(used, signals) for name, signals in members.items()}
    electrons = electrons[..., used, :]
    n_designs, n_signals = electrons.shape[-3:-1]
    unknown = np.asarray(np.isnan(electrons).reshape(-1, *electrons.shape[-3:]).any(axis=(0, 2, 3)))
    most_e = max(first_signals.well_e for first_signals in pixel.read_as or (pixel,))
    electrons = np.where(unknown[:, None, None], 0.0, np.minimum(electrons, 100 * most_e + 1e5))
    pairs = class_pairs(list(members))
    pair_errors = {pair: np.empty(n_designs) for pair in pairs}
    step = _NATS / len(channels)
    for start in range(0, n_designs, max(1, _AT_ONCE // n_signals)):
        block = electrons[..., start : start + max(1, _AT_ONCE // n_signals), :, :]
        if light is None:
            firsts, starts, roots, all_rows = _numbers(block, channels, pixel)
        else:
            firsts, starts, roots, all_rows = merged_numbers(block, light, channels, pixel)
        parts = firsts, starts, roots
        with np.errstate(divide="ignore"):
            logs = np.log(roots)
        for d in range(block.shape[-3]):
            rows = np.ascontiguousarray(all_rows[:, d])
            overlap = kernels.overlaps(*parts, rows)
            for pair in pairs:
                first_signals, second_signals = members[pair[0]], members[pair[1]]
                error = kernels.largest_error(overlap, first_signals, second_signals, *parts, logs, rows, step)
                pair_errors[pair][start + d] = min(error + FLOOR, 0.5)
    for values in pair_errors.values():
        values[unknown] = np.nan
    return pair_errors
