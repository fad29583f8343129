"""How often noise turns one of two signals into the other, from mean and variance of the readout of each.

The channels of a mosaic are read from different pixels, so their noise is independent. The margin r of two signals is
the distance, in standard deviations along its normal, of both from the plane between them at which they err equally
often, for the plane that errs least (Anderson, Bahadur 1962): r^2 is the largest sum of D^2 / (Va / l + Vb / (1 - l))
over the channels for any l between 0 and 1. The error is Q(r), and d' = 2 r, which of noise that is alike is the
Mahalanobis distance. A channel without variance separates two signals for certain, unless their means are equal; then
it has no effect.

Forms of two signals take the difference of their means, DN, and both variances, DN^2, channels on the last axis.
"""

from __future__ import annotations

import numpy as np

from ..base.types import Array, DesignSignals, Float, IndexArray, Int, PerDesign, SameShape
from ..camera.noise.gaussian import share_below
from .complex_step import Smooth, length, ratio


def margin(difference: Smooth, first: Smooth, second: Smooth) -> Smooth:
    """Return the margin of two signals; its derivative is that of the plane that is best here."""
    w = balance_of(*(values.real for values in np.broadcast_arrays(difference, first, second)))[..., None]
    return length(ratio(difference * np.sqrt(w / (1 + w)), np.sqrt(first + w * second)))


def dprime(difference: Smooth, first: Smooth, second: Smooth) -> Smooth:
    """Return d', twice the margin."""
    return 2 * margin(difference, first, second)


def balance_of(
    difference: Float[Array, "*batch channels"],
    first: Float[Array, "*batch channels"],
    second: Float[Array, "*batch channels"],
) -> SameShape:
    """Return l / (1 - l) of the best plane."""
    from .margin_kernels import balances  # noqa: PLC0415  (compiled: kept off the start-up path)

    apart, ours, theirs = (np.ascontiguousarray(of).reshape(-1, of.shape[-1]) for of in (difference, first, second))
    found = np.empty(len(apart))
    balances(apart, ours, theirs, found)
    return found.reshape(difference.shape[:-1])


def detectability(
    mean: DesignSignals, variance: DesignSignals, first: Int[IndexArray, " first"], second: Int[IndexArray, " second"]
) -> PerDesign:
    """Return d', the smallest over the pairs of two types; 0 for coincident points."""
    from .margin_kernels import smallest_margins  # noqa: PLC0415  (compiled: kept off the start-up path)

    smallest = np.empty(len(mean))
    smallest_margins(np.ascontiguousarray(mean), np.ascontiguousarray(variance), first, second, smallest)
    return 2 * smallest


def error_of(dprime: SameShape) -> SameShape:
    """Return the error at a d', Q(d' / 2)."""
    return share_below(-dprime / 2)
