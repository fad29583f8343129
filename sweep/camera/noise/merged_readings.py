"""Readings of the captures of an HDR pixel for given numbers of electrons: exact distributions of the merged value.

The merged value is in bins of an eighth of its noise, or in the codes of a companded pixel. Which captures are usable,
read noise, full well, ADC range and rounding are exact.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ...base.types import Array, Bool, BoolArray, Float, IndexArray, Int, PerValue
from ..pixel import Pixel
from . import gaussian
from .merge import exposure_of, limits_dn, saturating_e
from .subsets import share_beyond

NOISE_BINS = 8.0
"""Bins per standard deviation of the noise of a merged value."""
ROOT_STEP = 1 / 16
"""Grid of the root of the expected electrons that nodes of tables lie on."""
_REACH = 9.5
_MOST_READ, _MOST_SUMS = 5e6, 1e6
"""Numbers of electrons times digital numbers that read noise spreads each over; additions for each pixel."""
_LEAST = 1e-25
"""Probability of a digital number, of given electrons, below which it is left out."""


@dataclass(frozen=True)
class Bins:
    """Bins of merged values: an eighth of the noise of the capture that is used at them, or codes.

    `edges_e`: merged value from which on each capture is used, electrons of a pixel of full sensitivity, from 0 on;
    `dark_e`: electrons whose photons have the variance of its read noise; `knees`: electrons and codes of a companded
    pixel, from (0, 0) on; of shape (2, 1) if it is none.
    """

    edges_e: Float[Array, " captures"]
    light: Float[Array, " captures"]
    dark_e: Float[Array, " captures"]
    knees: Float[Array, "2 knees"]

    @classmethod
    def of(cls, pixel: Pixel, light: Float[Array, " captures"]) -> Bins:
        """Return the bins of a pixel."""
        read = [(*each, a) for *each, a in zip(pixel.read_as, limits_dn(pixel), light, strict=True)]
        ends = [(limit - capture.offset_dn) / (capture.dn_per_e * a) for capture, limit, a in read if limit is not None]
        dark = np.array([max(capture.read_noise_e**2, 1.0) / a for capture, _, a in read])
        knees_dn, codes = pixel.knees
        knees = np.stack([(knees_dn - pixel.offset_dn) / pixel.dn_per_e, codes])
        return cls(np.maximum.accumulate([0.0, *ends]), light, dark, knees)

    @property
    def _starts(self) -> Float[Array, " exposures"]:
        """Standard deviations of the noise below each of the edges."""
        ends = (
            2
            * np.sqrt(self.light[:-1])
            * (np.sqrt(self.edges_e[1:] + self.dark_e[:-1]) - np.sqrt(self.edges_e[:-1] + self.dark_e[:-1]))
        )
        return np.concatenate([[0.0], np.cumsum(ends)])

    def number(self, electrons: PerValue) -> Int[IndexArray, " values"]:
        """Return the bins of merged values.

        `electrons`: merged values, electrons of a pixel of full sensitivity. Those below 0 mirror those above.
        """
        if self.knees.shape[1] > 1:
            return np.asarray(np.floor(np.interp(electrons, *self.knees) + 0.5), dtype=np.intp)
        size = np.abs(electrons)
        at = np.searchsorted(self.edges_e, size, side="right") - 1
        light, dark, edge = np.sqrt(self.light[at]), self.dark_e[at], self.edges_e[at]
        widths = 2 * light * (np.sqrt(size + dark) - np.sqrt(edge + dark)) + self._starts[at]
        return np.asarray(np.floor(NOISE_BINS * np.copysign(widths, electrons)), dtype=np.intp)

    def value(self, number: Int[IndexArray, " values"] | PerValue) -> PerValue:
        """Return the values in the middle of bins.

        `number`: bins; half a bin less is a bin's lower edge. Returns electrons of a pixel of full sensitivity.
        """
        if self.knees.shape[1] > 1:
            return np.asarray(np.interp(number, *self.knees[::-1]), dtype=float)
        widths, starts = (number + 0.5) / NOISE_BINS, self._starts
        size = np.abs(widths)
        at = np.searchsorted(starts, size, side="right") - 1
        light, dark, edge = np.sqrt(self.light[at]), self.dark_e[at], self.edges_e[at]
        above = ((size - starts[at]) / (2 * light) + np.sqrt(edge + dark)) ** 2 - dark
        return np.asarray(np.copysign(above, widths), dtype=float)


def nodes_of(
    pixel: Pixel, light: Float[Array, " captures"]
) -> tuple[Float[Array, " roots"], Bool[BoolArray, " roots"]]:
    """Return expected electrons at which a merged value is tabulated: one in each eighth of its noise.

    `light`: light of each exposure relative to that of a pixel of full sensitivity. Returns `roots_e`: squares of the
    multiples of `ROOT_STEP`, up to where all is saturated, electrons; `is_node`: True for nodes. A step of the root is
    an eighth of the noise where all light is read, and less where a small photodiode is.
    """
    roots_e = np.square(np.arange(n_roots(pixel, light), dtype=float) * ROOT_STEP)
    is_node = np.ones(roots_e.size, dtype=bool)
    if len(pixel.captures) > 1:
        of_capture = np.array([light[at] for at in exposure_of(pixel)])
        noise_bins = Bins.of(pixel.model_copy(update={"companding": ()}), of_capture).number(roots_e)
        is_node[1:-1] = np.diff(noise_bins)[:-1] > 0
    return roots_e, is_node


def n_roots(pixel: Pixel, light: Float[Array, " captures"]) -> int:
    """Return the number of multiples of `ROOT_STEP` up to the root of the electrons from which on all is saturated."""
    return math.ceil(math.sqrt(float((saturating_e(pixel) / light).max())) / ROOT_STEP) + 2


@dataclass(frozen=True)
class Readings:
    """Distribution of the readings of each number of electrons, for all captures of an HDR pixel.

    `bins`: bins of a pixel of full sensitivity. `columns`, `shares`: bins from `first` on, and probabilities that the
    capture is the first usable one of its exposure and reads it.
    """

    bins: Bins
    exposure: Int[IndexArray, " captures"]
    passed: Float[Array, "captures exposures counts"]
    starts: Int[IndexArray, "captures counts+1"]
    columns: Int[IndexArray, " entries"]
    shares: Float[Array, " entries"]
    first: int
    n_bins: int


def countable(pixel: Pixel) -> bool:
    """Return whether merged values are summed up.

    True for `merge: saturated`, unless wells, PRNU or read noise are very large.
    """
    well_e = max(capture.well_e for capture in pixel.read_as)
    sums = 2 * _REACH * math.sqrt(well_e) * (1 + 2 * _REACH * math.sqrt(1 + pixel.prnu**2 * well_e) * bool(pixel.prnu))
    reach_dn = [
        min(2 * _REACH * readout.dn_per_e * readout.read_noise_e + 3, readout.full_scale_dn)
        for readout in pixel.read_as
    ]
    return pixel.merge == "saturated" and well_e * max(reach_dn) <= _MOST_READ and sums <= _MOST_SUMS


@lru_cache(maxsize=8)
def readings_of(pixel: Pixel, light: tuple[float, ...]) -> Readings:
    """Compute the distribution of the readings of each number of electrons.

    `pixel`: HDR pixel with `merge: saturated`; `light`: light of each exposure relative to that of a pixel of full
    sensitivity.
    """
    from scipy.sparse import csr_matrix  # noqa: PLC0415  (slow to import: kept off the start-up path)

    read, limits = pixel.read_as, limits_dn(pixel)
    n_counts = max(math.ceil(capture.well_e) for capture in read) + 1
    counts, n_captures = np.arange(n_counts, dtype=float), len(read)
    exposure = np.array(exposure_of(pixel))
    bins = Bins.of(pixel, np.array(light)[exposure])
    passed = np.ones((n_captures, len(pixel.exposures), n_counts))
    entries = []
    for number, (capture, limit) in enumerate(zip(read, limits, strict=True)):
        rows, numbers_dn, shares = _read(counts, capture, limit)
        value_e = (numbers_dn - capture.offset_dn) / (capture.dn_per_e * light[exposure[number]])
        shares *= passed[number, exposure[number], rows]
        entries.append((rows, bins.number(value_e), shares))
        if limit is not None:
            passed[number + 1 :, exposure[number]] *= share_beyond(counts, capture, limit)
    occurring = np.concatenate([of_bins for _, of_bins, _ in entries])  # a capture may never be usable
    first = min(0, int(occurring.min()))
    n_bins = int(occurring.max()) - first + 1
    summed = [csr_matrix((shares, (rows, at - first)), shape=(n_counts, n_bins)) for rows, at, shares in entries]
    ends = np.concatenate([[0], np.cumsum([matrix.nnz for matrix in summed])])
    starts = np.stack([matrix.indptr + end for matrix, end in zip(summed, ends[:-1], strict=True)]).astype(np.intp)
    columns = np.concatenate([matrix.indices for matrix in summed]).astype(np.intp)
    shares = np.concatenate([matrix.data for matrix in summed])
    return Readings(bins, exposure, passed, starts, columns, shares, first, n_bins)


def _read(
    counts: Float[Array, " counts"], pixel: Pixel, limit_dn: int | None
) -> tuple[Int[IndexArray, " _counts"], Float[Array, " _counts"], Float[Array, " _counts"]]:
    """Return row, digital number below the limit, and probability, of each count and number that occur."""
    sigma = pixel.dn_per_e * pixel.read_noise_e
    mean = pixel.dn_per_e * np.minimum(counts, pixel.well_e) + pixel.offset_dn
    top = pixel.full_scale_dn
    reach = min(math.ceil(_REACH * sigma) + 1, top)
    center = np.clip(np.floor(mean + 0.5), 0, top)
    number = center[:, None] + np.arange(-reach, reach + 1)
    low, high = (number + side - mean[:, None] for side in (-0.5, 0.5))
    # An end of the range takes what lies beyond it.
    low, high = np.where(number == 0, -np.inf, low), np.where(number == top, np.inf, high)
    if sigma:
        upper = low > 0  # differences of small tails, not of numbers near 1
        tails = [gaussian.share_below(np.where(upper, -end, end) / sigma) for end in (low, high)]
        share = np.where(upper, tails[0] - tails[1], tails[1] - tails[0])
    else:
        share = ((low <= 0) & (high > 0)).astype(float)
    inside = (number >= 0) & (number <= top) & (share > _LEAST)
    if limit_dn is not None:
        inside &= number < limit_dn
    rows = np.asarray(np.nonzero(inside)[0], dtype=np.intp)
    return rows, np.asarray(number[inside], dtype=float), np.asarray(share[inside], dtype=float)
