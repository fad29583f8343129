"""Errors under noise as smooth rows with exact derivatives, for the search.

Every row is a closed form of the means and variances of two signals in the smooth response, whose noise is Gaussian
(`camera/linear.py`); `discrimination.py` has the same forms for the digital numbers.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from ..base.types import DesignCurves, PerDesign
from ..camera.linear import linear_model
from ..camera.setup import Setup
from ..spectra.lights import Pair, class_pairs
from .discrimination import detectability
from .smooth import Rows, SmoothDesign
from .tasks.colorimetry import COMPLEX_STEP, Smooth, root

_LN10 = math.log(10)


_OfPairs = Callable[[Smooth, Smooth, Smooth], Smooth]


def squared_detectability(difference: Smooth, first: Smooth, second: Smooth) -> Smooth:
    """Return d'^2 = D' S^-1 D for the mean S of both variances."""
    return np.asarray((difference**2 / ((first + second) / 2)).sum(axis=-1))


def squared_contrast(difference: Smooth, first: Smooth, second: Smooth) -> Smooth:
    """Return the squared distance over the variance along the line of the two points: (D'D)^2 / (D' S D).

    0 where the points coincide.
    """
    length = (difference**2).sum(axis=-1)
    return np.asarray(length * _ratio(length, (difference**2 * ((first + second) / 2)).sum(axis=-1)))


def margin(difference: Smooth, first: Smooth, second: Smooth) -> Smooth:
    """Return the standard deviations from both points to the plane of `discrimination.pairwise_error`.

    D' S^-1 D / (p + q), with the deviations p and q of both signals along the normal S^-1 D.

    0 where the points coincide.
    """
    normal = difference / (first + second)
    p, q = (root((normal**2 * variance).sum(axis=-1)) for variance in (first, second))
    return _ratio((normal * difference).sum(axis=-1), p + q)


def error_decades(difference: Smooth, first: Smooth, second: Smooth) -> Smooth:
    """Return -log10 of the error Q(z) on either side of the plane, z being the `margin`."""
    from scipy.special import log_ndtr  # noqa: PLC0415  (slow to import: kept off the start-up path)

    z = margin(difference, first, second)
    tail = log_ndtr(-z.real)
    if not np.iscomplexobj(z):
        return np.asarray(-tail / _LN10)
    by_z = np.exp(-(z.real**2) / 2 - tail) / (math.sqrt(2 * math.pi) * _LN10)
    return np.asarray(-tail / _LN10 + 1j * by_z * z.imag)


def overlap(difference: Smooth, first: Smooth, second: Smooth) -> Smooth:
    """Return the Bhattacharyya distance of two Gaussians, D' S^-1 D / 8 + ln(S / sqrt(a b)) / 2, over all channels."""
    total = first + second
    form = difference**2 / (4 * total) + np.log(total / (2 * np.sqrt(first * second))) / 2
    return np.asarray(form.sum(axis=-1))


def _ratio(over: Smooth, under: Smooth) -> Smooth:
    return np.divide(over, under, out=np.zeros_like(over), where=under.real > 0)


def pair_rows(design: SmoothDesign, *, of: _OfPairs, pairs: Sequence[Pair]) -> Rows:
    """Return a row for each two signals of the pairs of types, in every case of the scene."""
    return Rows.joined([_between(design, pair, of) for pair in pairs])


def bound_rows(design: SmoothDesign, *, types: Sequence[str]) -> Rows:
    """Return -log10 of the sum of the overlaps of each signal with those of other types, in every case of the scene."""
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
    """Return the rows of two types."""
    return design.cached(f"{of.__name__} of {' and '.join(pair)}", lambda: _of_signals(design, pair, of))


def _of_signals(design: SmoothDesign, pair: Pair, of: _OfPairs) -> Rows:
    members = design.setup.members
    first_signals, second_signals = (members[name] for name in pair)

    def of_both(values: Smooth) -> tuple[Smooth, Smooth]:
        """Combine the values of the first with those of the second signals, all pairs along one axis."""
        shape = (*values.shape[:-2], len(first_signals), len(second_signals), values.shape[-1])
        first = np.broadcast_to(values[..., first_signals, None, :], shape)
        second = np.broadcast_to(values[..., None, second_signals, :], shape)
        flat = (*values.shape[:-3], -1, values.shape[-1])
        return first.reshape(flat), second.reshape(flat)

    def of_pairs(mean: Smooth, variance: Smooth) -> Smooth:
        first, second = of_both(mean)
        return of(first - second, *of_both(variance))

    mean, variance, mean_by_u, variance_by_u = design.noisy
    along = of_pairs(mean + 1j * COMPLEX_STEP * mean_by_u, variance + 1j * COMPLEX_STEP * variance_by_u)
    shape = len(along), -1
    return Rows(of_pairs(mean, variance), along.imag.reshape(shape).T / COMPLEX_STEP)


def smooth_detectability(setup: Setup, curves: DesignCurves, pair: Pair) -> PerDesign:
    """Return d' of the smooth response, the smallest over the cases."""
    model = linear_model(setup)
    mean, variance = model.smooth(curves), model.variance(curves)
    members = setup.members[pair[0]], setup.members[pair[1]]
    over = [detectability(mean[:, case], variance[:, case], *members) for case in range(mean.shape[1])]
    return np.asarray(np.min(over, axis=0), dtype=float)
