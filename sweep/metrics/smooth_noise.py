"""Errors under noise as smooth rows with exact derivatives: what a search sees of them.

Every row is a closed form of the means and variances of two signals in the smooth response, whose noise is Gaussian
(`camera/linear.py`); `discrimination.py` has the same forms for the digital numbers. Differences D of the means and
variances a and b of the two signals are ndarray[n_pairs, n_channels], DN and DN^2.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..base.types import FloatArray
from ..camera.linear import linear_model
from ..camera.setup import Setup
from ..curves.lights import Pair, class_pairs
from .discrimination import detectability
from .smooth import Rows, SmoothDesign

_LN10 = math.log(10)


@dataclass(frozen=True)
class Slopes:
    """A function of pairs, ndarray[n_pairs], and its derivatives by D, a and b, ndarray[n_pairs, n_channels] each."""

    values: FloatArray
    by_difference: FloatArray
    by_first: FloatArray
    by_second: FloatArray


_OfPairs = Callable[[FloatArray, FloatArray, FloatArray], Slopes]


def squared_detectability(difference: FloatArray, first: FloatArray, second: FloatArray) -> Slopes:
    """d'^2 = D' S^-1 D for the mean S of both variances."""
    s = (first + second) / 2
    by_variance = -((difference / s) ** 2) / 2
    return Slopes((difference**2 / s).sum(axis=-1), 2 * difference / s, by_variance, by_variance)


def squared_contrast(difference: FloatArray, first: FloatArray, second: FloatArray) -> Slopes:
    """Squared distance over the variance along the line of the two points: (D'D)^2 / (D' S D); 0 where they meet."""
    s = (first + second) / 2
    length = (difference**2).sum(axis=-1, keepdims=True)
    along = (difference**2 * s).sum(axis=-1, keepdims=True)
    ratio = np.divide(length, along, out=np.zeros_like(length), where=along > 0)
    by_difference = 4 * ratio * difference - 2 * ratio**2 * difference * s
    by_variance = -(ratio**2) * difference**2 / 2
    return Slopes((length * ratio)[:, 0], by_difference, by_variance, by_variance)


def error_decades(difference: FloatArray, first: FloatArray, second: FloatArray) -> Slopes:
    """-log10 of the error Q(z) on either side of the plane of `discrimination.pairwise_error`, z = w / (p + q).

    w = D' S^-1 D; p and q are the deviations of both signals along the normal S^-1 D.
    """
    from scipy.special import log_ndtr  # noqa: PLC0415  (slow to import: kept off the start-up path)

    s = (first + second) / 2
    normal = difference / s
    w = squared_detectability(difference, first, second)
    p, q = (np.sqrt((normal**2 * v).sum(axis=-1, keepdims=True)) for v in (first, second))
    both = p + q
    apart = both > 0
    z = np.divide(w.values[:, None], both, out=np.zeros_like(both), where=apart)
    # The derivative of z is that of w less z times that of p + q, over p + q.
    per_p, per_q = (np.divide(z, 2 * v, out=np.zeros_like(z), where=v > 0) for v in (p, q))
    weighed = per_p * first + per_q * second
    by_s = weighed * normal**2 / s
    parts = (
        w.by_difference - 2 * weighed * normal / s,
        w.by_first - per_p * normal**2 + by_s,
        w.by_second - per_q * normal**2 + by_s,
    )
    tail = log_ndtr(-z)
    per_z = np.exp(-(z**2) / 2 - tail) / (math.sqrt(2 * math.pi) * _LN10)
    per_part = np.divide(per_z, both, out=np.zeros_like(both), where=apart)
    return Slopes(-tail[:, 0] / _LN10, *(per_part * part for part in parts))


def overlap(difference: FloatArray, first: FloatArray, second: FloatArray) -> Slopes:
    """Bhattacharyya distance of two Gaussians: D' S^-1 D / 8 + ln(S / sqrt(a b)) / 2, summed over the channels."""
    total = first + second
    form = difference**2 / (4 * total) + np.log(total / (2 * np.sqrt(first * second))) / 2
    by_total = -(difference**2) / (4 * total**2) + 1 / (2 * total)
    by_variances = (by_total - 1 / (4 * first), by_total - 1 / (4 * second))
    return Slopes(form.sum(axis=-1), difference / (2 * total), *by_variances)


def pair_rows(design: SmoothDesign, *, of: _OfPairs, pairs: Sequence[Pair]) -> Rows:
    """A row for each two signals of the pairs of types, in every case of the scene."""
    return Rows.joined([_between(design, pair, of) for pair in pairs])


def bound_rows(design: SmoothDesign, *, types: Sequence[str]) -> Rows:
    """-log10 of the sum of the overlaps of each signal with those of the other types, in every case of the scene.

    See `discrimination.state_error_bound`.
    """
    sums: dict[str, list[Rows]] = {name: [] for name in types}  # [n_cases x n_own x n_others] of each other type
    n_cases, sizes = len(design.response), {name: len(index) for name, index in design.setup.members.items()}
    for a, b in class_pairs(tuple(types)):
        rows = _between(design, (a, b), overlap)
        values = rows.values.reshape(n_cases, sizes[a], sizes[b])
        by_u = rows.by_u.reshape(*values.shape, -1)
        sums[a].append(Rows(values, by_u))
        sums[b].append(Rows(values.swapaxes(1, 2), by_u.swapaxes(1, 2)))
    return Rows.joined([_summed(parts) for parts in sums.values()])


def _summed(parts: list[Rows]) -> Rows:
    from scipy.special import logsumexp  # noqa: PLC0415  (slow to import: kept off the start-up path)

    values = np.concatenate([rows.values for rows in parts], axis=2)
    by_u = np.concatenate([rows.by_u for rows in parts], axis=2)
    total = logsumexp(-values, axis=2, keepdims=True)
    share = np.exp(-values - total)
    by = (share[..., None] * by_u).sum(axis=2)
    return Rows(-total.ravel() / _LN10, by.reshape(total.size, -1) / _LN10)


def _between(design: SmoothDesign, pair: Pair, of: _OfPairs) -> Rows:
    """Rows of two types, [n_cases x n_first x n_second]."""
    return design.once(f"{of.__name__} of {' and '.join(pair)}", lambda: _of_signals(design, pair, of))


def _of_signals(design: SmoothDesign, pair: Pair, of: _OfPairs) -> Rows:
    members = design.setup.members
    one, other = (members[name] for name in pair)

    def of_both(values: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Of the first and of the second signal of every pair; the axes but signals and channels come first."""
        shape = (*values.shape[:-2], len(one), len(other), values.shape[-1])
        first = np.broadcast_to(values[..., one, None, :], shape)
        second = np.broadcast_to(values[..., None, other, :], shape)
        flat = (*values.shape[:-3], -1, values.shape[-1])
        return first.reshape(flat), second.reshape(flat)

    mean, variance = of_both(design.response), of_both(design.variance)
    mean_by_u, variance_by_u = of_both(design.response_by_u), of_both(design.variance_by_u)
    found = of(mean[0] - mean[1], *variance)
    by_u = (
        (found.by_difference * (mean_by_u[0] - mean_by_u[1])).sum(axis=-1)
        + (found.by_first * variance_by_u[0]).sum(axis=-1)
        + (found.by_second * variance_by_u[1]).sum(axis=-1)
    )
    return Rows(found.values, by_u.T)


def smooth_detectability(setup: Setup, curves: FloatArray, pair: Pair) -> FloatArray:
    """d' of the smooth response, the smallest over the cases, ndarray[n_designs]; see `smooth.smooth_csd`."""
    imager = linear_model(setup)
    mean, variance = imager.smooth(curves), imager.variance(curves)
    both = setup.members[pair[0]], setup.members[pair[1]]
    over = [detectability(mean[:, case], variance[:, case], *both) for case in range(mean.shape[1])]
    return np.asarray(np.min(over, axis=0), dtype=float)
