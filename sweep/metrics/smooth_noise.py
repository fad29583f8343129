"""Errors under noise as smooth rows with exact derivatives, for the search.

Every row is a form of `discrimination`, of means and variances of two signals in the smooth response, whose noise is
Gaussian (`camera/linear.py`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from ..base.types import DesignCurves, PerDesign
from ..camera.linear import linear_model
from ..camera.setup import Setup
from ..spectra.lights import Pair
from .complex_step import Smooth, tail_decades
from .discrimination import detectability, margin
from .smooth import Rows, SmoothDesign

_OfPairs = Callable[[Smooth, Smooth, Smooth], Smooth]


def error_decades(difference: Smooth, first: Smooth, second: Smooth) -> Smooth:
    """Return -log10 of the error on either side of the plane between two points (see `margin`)."""
    return tail_decades(margin(difference, first, second))


def pair_rows(design: SmoothDesign, *, of: _OfPairs, pairs: Sequence[Pair], squared: bool) -> Rows:
    """Return a row for each two signals of the pairs of types, in every case of the scene."""
    rows = Rows.joined([_between(design, pair, of) for pair in pairs])
    return rows.squares() if squared else rows


def _between(design: SmoothDesign, pair: Pair, of: _OfPairs) -> Rows:
    """Return the rows of two types."""
    return design.cached(f"{of.__name__} of {' and '.join(pair)}", partial(_of_signals, design, pair, of))


def _of_signals(design: SmoothDesign, pair: Pair, of: _OfPairs) -> Rows:
    first, second = (design.setup.members[name] for name in pair)

    def of_pairs(mean: Smooth, variance: Smooth) -> Smooth:
        difference = mean[..., first, None, :] - mean[..., None, second, :]
        return of(difference, variance[..., first, None, :], variance[..., None, second, :])

    mean, variance, mean_by_u, variance_by_u = design.noisy
    return Rows.of(of_pairs, (mean, mean_by_u), (variance, variance_by_u))


def smooth_detectability(setup: Setup, curves: DesignCurves, pair: Pair) -> PerDesign:
    """Return d' of the smooth response, the smallest over the cases."""
    model = linear_model(setup)
    mean, variance = model.smooth(curves), model.variance(curves)
    members = setup.members[pair[0]], setup.members[pair[1]]
    over = [detectability(mean[:, case], variance[:, case], *members) for case in range(mean.shape[1])]
    return np.asarray(np.min(over, axis=0), dtype=float)
