"""Compiled inner loops of errors: distributions of digital numbers, and their overlap."""

from __future__ import annotations

import math

import numpy as np

from ...base.machine_code import njit
from ...base.types import FloatArray, IndexArray
from .kernels import occurring, poisson_shares

RARE = 1e-40
"""Counts less probable than this, relative to the most probable one, are left out."""
_TAIL = 13.0
_PER_DEVIATION = 1.3
_MOST_NATS = 100.0
"""Logarithms of a likelihood ratio beyond this are taken to say nothing, which bounds the error from above."""


@njit(cache=True, nogil=True)
def _counts(electrons: float, prnu: float, most: int) -> tuple[int, FloatArray]:
    """Return the first count and the probability of each, for a Gaussian gain; `most` takes all higher counts."""
    spread = 1.0 + _TAIL * prnu
    high = electrons * spread
    low = electrons * max(2.0 - spread, 0.0)
    start = min(max(int(low - 14 * math.sqrt(low) - 2), 0), most)
    if start == most:
        return most, np.ones(1)
    last = min(int(high + 14 * math.sqrt(high) + 110), most)
    shares = np.zeros(max(last, start) - start + 1)
    if prnu == 0:
        begin, end = poisson_shares(electrons, start, RARE, shares)
        return start + begin, shares[begin:end] / shares[begin:end].sum()
    half = int(_TAIL * _PER_DEVIATION * math.sqrt(1 + prnu * prnu * electrons)) + 1
    poisson = np.empty(shares.size)
    for i in range(-half, half + 1):
        z = _TAIL * i / half
        begin, end = poisson_shares(max(electrons * (1 + prnu * z), 0.0), start, RARE, poisson)
        weight = math.exp(-z * z / 2) / poisson[begin:end].sum()
        counted, here = shares[begin:end], poisson[begin:end]
        for k in range(here.size):
            counted[k] += weight * here[k]
    return start, shares / shares.sum()


@njit(cache=True, nogil=True)
def bin_shares(sigma: float) -> FloatArray:
    """Return shares of a Gaussian in bins of width 1, for positions of its mean at most 1/64 sigma apart."""
    reach = int(_TAIL * sigma) + 1
    places = int(64 / sigma) + 1
    bins = np.empty((places + 1, 2 * reach + 1))
    for p in range(places + 1):
        for i in range(2 * reach + 1):
            low, high = (i - reach - p / places) / sigma, (i - reach + 1 - p / places) / sigma
            if low > 0:
                bins[p, i] = 0.5 * (math.erfc(low / math.sqrt(2)) - math.erfc(high / math.sqrt(2)))
            else:
                bins[p, i] = 0.5 * (math.erfc(-high / math.sqrt(2)) - math.erfc(-low / math.sqrt(2)))
    return bins


@njit(cache=True, nogil=True)
def pixel_numbers(
    electrons: float,
    most: int,
    well_e: float,
    prnu: float,
    read_e: float,
    line: tuple[float, float],
    n_bins: int,
    table: FloatArray,
) -> tuple[int, FloatArray]:
    """Return the distribution of the digital numbers of one pixel.

    `well_e`, `prnu`, `read_e`: full well, electrons; PRNU; read noise, electrons; `line`: bins per electron, and
    position of no electron from the lower edge of the first bin; `table`: result of `bin_shares`; of size 0 without
    read noise.
    """
    first, shares = _counts(electrons, prnu, most)
    # Counts are taken together where that adds less than 1/700 to the variance of both and read noise hides it.
    group = max(1, min(int(read_e), int(math.sqrt(electrons) / 8)))
    reach = (table.shape[1] - 1) // 2 if table.size else 0
    places = table.shape[0] - 1
    slope, origin = line
    beyond = n_bins + reach + 1.0
    least = min(slope * min(float(first - group), well_e) + origin, beyond)
    largest = min(slope * min(float(first + shares.size + group), well_e) + origin, beyond)
    low = min(max(math.floor(least) - reach - 1, 0), n_bins - 1)
    high = min(max(math.floor(largest) + reach + 1, 0), n_bins - 1)
    probabilities = np.zeros(high - low + 1)
    k = 0
    while k < shares.size:
        count, weight = first + k, shares[k]
        k += 1
        held = min(float(count), well_e)
        if group > 1 and count < most:
            begin = count // group
            while k < shares.size and (first + k) // group == begin and first + k < most:
                weight += shares[k]
                k += 1
            held = min(begin * group + (group - 1) / 2, well_e)
        if weight < RARE:
            continue
        y = min(slope * held + origin, beyond)
        cell = math.floor(y)
        if not table.size:
            probabilities[min(max(cell, low), high) - low] += weight
            continue
        place = (y - cell) * places
        p = min(int(place), places - 1)
        right = weight * (place - p)
        left = weight - right
        begin = cell - reach - low
        for i in range(2 * reach + 1):
            b = min(max(begin + i, 0), high - low)
            probabilities[b] += left * table[p, i] + right * table[p + 1, i]
    return low, probabilities


@njit(cache=True, nogil=True)
def _sum_of(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return the distribution of the sum of two numbers."""
    total = np.zeros(first.size + second.size - 1)
    for i in range(first.size):
        if first[i] > RARE:
            share, shifted = first[i], total[i:]
            for j in range(second.size):
                shifted[j] += share * second[j]
    return total


@njit(cache=True, nogil=True)
def channel_numbers(
    electrons: FloatArray,
    most: int,
    well_e: float,
    prnu: float,
    read_e: float,
    line: tuple[float, float],
    n_bins: int,
    table: FloatArray,
) -> tuple[IndexArray, IndexArray, FloatArray]:
    """Return the distribution of sums of pixels."""
    firsts, starts = np.empty(len(electrons), np.intp), np.zeros(len(electrons) + 1, np.intp)
    values = np.empty(4096)
    for i in range(len(electrons)):
        first, shares = pixel_numbers(electrons[i, 0], most, well_e, prnu, read_e, line, n_bins, table)
        pixel_first, pixel_shares = first, shares
        for u in range(1, electrons.shape[1]):
            if electrons[i, u] != electrons[i, u - 1]:
                pixel_first, pixel_shares = pixel_numbers(
                    electrons[i, u], most, well_e, prnu, read_e, line, n_bins, table
                )
            first, shares = first + pixel_first, _sum_of(shares, pixel_shares)
        low, high = occurring(shares, RARE)
        firsts[i] = first + low
        starts[i + 1] = starts[i] + high - low
        if starts[i + 1] > values.size:
            grown = np.empty(2 * starts[i + 1])
            for k in range(starts[i]):
                grown[k] = values[k]
            values = grown
        for k in range(low, high):
            values[starts[i] + k - low] = shares[k]
    return firsts, starts, values[: starts[-1]]


@njit(cache=True, nogil=True)
def mean_shares(
    value: FloatArray, chance: FloatArray, other: FloatArray, shares: FloatArray, edges: FloatArray, weight: int
) -> FloatArray:
    """Return the distribution of the mean of `weight` values and another one.

    `value`, `other`: values, ascending: means of `weight` pixels, and of one; `edges`: edges between bins, ascending;
    `weight`: number of pixels.
    """
    total = np.zeros(edges.size + 1)
    for i in range(value.size):
        if chance[i] == 0:
            continue
        fixed = value[i] * weight / (weight + 1)
        at = np.searchsorted(edges, fixed + other[0] / (weight + 1), side="right")
        for j in range(other.size):
            mean = fixed + other[j] / (weight + 1)
            while at < edges.size and mean >= edges[at]:
                at += 1
            total[at] += chance[i] * shares[j]
    return total


@njit(cache=True, nogil=True)
def overlaps(firsts: IndexArray, starts: IndexArray, roots: FloatArray, rows: IndexArray) -> FloatArray:
    """Return the Bhattacharyya coefficient of each two signals of a design."""
    products = np.ones((rows.shape[1], rows.shape[1]))
    for a in range(rows.shape[1]):
        for b in range(a):
            for c in range(rows.shape[0]):
                first_row, second_row = rows[c, a], rows[c, b]
                if first_row == second_row:
                    continue
                i, j, n = _common(firsts, starts, first_row, second_row)
                total = 0.0
                for k in range(n):
                    total += roots[i + k] * roots[j + k]
                products[a, b] *= total
                if total == 0:
                    break
            products[b, a] = products[a, b]
    return products


@njit(cache=True, nogil=True)
def _common(firsts: IndexArray, starts: IndexArray, first_row: int, second_row: int) -> tuple[int, int, int]:
    """Return where the bins that two rows share begin in each, and their number."""
    low = max(firsts[first_row], firsts[second_row])
    high = min(
        firsts[first_row] + starts[first_row + 1] - starts[first_row],
        firsts[second_row] + starts[second_row + 1] - starts[second_row],
    )
    return (
        starts[first_row] + low - firsts[first_row],
        starts[second_row] + low - firsts[second_row],
        max(high - low, 0),
    )


@njit(cache=True, nogil=True)
def _ratios(
    firsts: IndexArray,
    starts: IndexArray,
    roots: FloatArray,
    logs: FloatArray,
    first_row: int,
    second_row: int,
    step: float,
) -> tuple[int, FloatArray]:
    """Return the overlap of one channel by the logarithm of the likelihood ratio, in steps."""
    i, j, n = _common(firsts, starts, first_row, second_row)
    most = int(_MOST_NATS / step)
    histogram = np.zeros(2 * most + 1)
    begin, end = 2 * most, 0
    for k in range(n):
        p, q = roots[i + k], roots[j + k]
        if p > 0 and q > 0:
            at = round(min(max(2 * (logs[i + k] - logs[j + k]) / step, -most), most)) + most
            histogram[at] += p * q
            begin, end = min(begin, at), max(end, at)
    if end < begin:
        return 0, np.zeros(1)
    return begin - most, histogram[begin : end + 1]


@njit(cache=True, nogil=True)
def _sum_of_few(dense: FloatArray, sparse: FloatArray) -> FloatArray:
    """Return the distribution of the sum of two numbers, few of which occur in a long range."""
    total, occurring = np.zeros(dense.size + sparse.size - 1), np.flatnonzero(sparse)
    for i in range(dense.size):
        if dense[i] > RARE:
            for j in occurring:
                total[i + j] += dense[i] * sparse[j]
    return total


@njit(cache=True, nogil=True)
def _least_error(
    firsts: IndexArray,
    starts: IndexArray,
    roots: FloatArray,
    logs: FloatArray,
    rows: IndexArray,
    a: int,
    b: int,
    step: float,
) -> float:
    """Return the error of the maximum likelihood rule for two equally frequent signals.

    Half the sum of min(p, q), that is of sqrt(p q) exp(-|ln(p / q)| / 2); the logarithms of independent channels add.
    Each is off by at most half a step, so that the error is exact within exp(n_channels step / 4).
    """
    # Two halves of the channels, so that their sum over both need not be written out.
    first, left_shares, right_shares = 0, np.ones(1), np.ones(1)
    for c in range(rows.shape[0]):
        if rows[c, a] != rows[c, b]:
            ratio_first, ratios = _ratios(firsts, starts, roots, logs, rows[c, a], rows[c, b], step)
            first += ratio_first
            if left_shares.size <= right_shares.size:
                left_shares = _sum_of_few(left_shares, ratios)
            else:
                right_shares = _sum_of_few(right_shares, ratios)
    return 0.5 * _mean_decay(left_shares, right_shares, first, step / 2)


@njit(cache=True, nogil=True)
def _mean_decay(left_shares: FloatArray, right_shares: FloatArray, first: int, rate: float) -> float:
    """Return the sum of one[i] other[j] exp(-rate |first + i + j|)."""
    n, decay = right_shares.size, math.exp(-rate)
    before, after = np.zeros(n + 1), np.zeros(n + 1)  # of other[m] exp(-rate |j - m|), for m < j and m >= j
    for m in range(n):
        before[m + 1] = (before[m] + right_shares[m]) * decay
        after[n - 1 - m] = right_shares[n - 1 - m] + after[n - m] * decay
    total = 0.0
    for i in range(left_shares.size):
        if left_shares[i] > 0:
            turn = min(max(-(first + i), 0), n)
            total += left_shares[i] * (before[turn] + after[turn]) * math.exp(-rate * abs(first + i + turn))
    return total


@njit(cache=True, nogil=True)
def largest_error(
    overlap: FloatArray,
    first: IndexArray,
    second: IndexArray,
    firsts: IndexArray,
    starts: IndexArray,
    roots: FloatArray,
    logs: FloatArray,
    rows: IndexArray,
    step: float,
) -> float:
    """Return the largest error over the pairs of two types; pairs with a small overlap are skipped."""
    largest = 0.0
    bound = 0.5 * overlap[first][:, second].ravel()
    while bound.max() > largest:  # few are looked at, so that sorting them all is not worth it
        at = bound.argmax()
        a, b = first[at // second.size], second[at % second.size]
        largest = max(largest, _least_error(firsts, starts, roots, logs, rows, a, b, step))
        bound[at] = 0.0
    return largest
