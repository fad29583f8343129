"""How far two classes of spectra are apart in a CFA: in digital numbers, in noise, and as an error of one pair.

`electrons`: expected electrons of each spectrum in a pixel of each channel, ndarray[n, n_spectra, n_channels]; it may
be complex, see `colorimetry`. `pairs`: both spectra of each pair of two classes. A value is an array of the pairs.
"""

from __future__ import annotations

import math

import numpy as np

from ...base.types import IndexArray
from ...camera.noise.gaussian import share_below
from .color import ChannelNoise
from .colorimetry import Smooth

Pairs = tuple[IndexArray, IndexArray]
_LEAST = 1e-300


def squared_distances(electrons: Smooth, pairs: Pairs, dn_per_e: float) -> Smooth:
    """Squared distances in digital numbers, ndarray[n, n_pairs]."""
    apart = dn_per_e * (electrons[:, pairs[0]] - electrons[:, pairs[1]])
    return np.asarray((apart**2).sum(axis=-1))


def squared_detectabilities(electrons: Smooth, pairs: Pairs, noise: ChannelNoise) -> Smooth:
    """d'^2: the squared distance over the mean variance of both points, ndarray[n, n_pairs]."""
    apart = electrons[:, pairs[0]] - electrons[:, pairs[1]]
    variance = noise.of(electrons)
    return np.asarray((apart**2 / ((variance[:, pairs[0]] + variance[:, pairs[1]]) / 2)).sum(axis=-1))


def margins(electrons: Smooth, pairs: Pairs, noise: ChannelNoise) -> Smooth:
    """Standard deviations from both points of a pair to the plane where they err equally often, ndarray[n, n_pairs].

    The plane's normal is the difference over the mean variance, as in `discrimination.pairwise_error`.
    """
    apart = electrons[:, pairs[0]] - electrons[:, pairs[1]]
    ours, theirs = (noise.of(electrons)[:, side] for side in pairs)
    normal = apart / (ours + theirs)
    spreads = [((normal**2 * own).sum(axis=-1) + _LEAST) ** 0.5 for own in (ours, theirs)]
    return np.asarray((normal * apart).sum(axis=-1) / (spreads[0] + spreads[1]))


def pair_errors(margin: Smooth) -> Smooth:
    """Probability that Gaussian noise goes beyond the plane, with its derivative."""
    error = share_below(-margin.real)
    if not np.iscomplexobj(margin):
        return np.asarray(error)
    return np.asarray(error - 1j * np.exp(-(margin.real**2) / 2) / math.sqrt(2 * math.pi) * margin.imag)
