"""Distribution of a pixel's digital number: sums over Poisson electrons, tabulated over the expected electrons.

The order is the camera's: gain error, Poisson electrons, full well, read noise, gain and pedestal, ADC range,
rounding. Between two nodes of the root of the electrons the distributions are mixed linearly: the mean is exact, and a
mixture of two neighbors has up to 0.4 % more variance.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaln, ndtr

from ..base.types import FloatArray
from ..camera.noise import gaussian, moments
from ..camera.pixel import Pixel

ROOT_STEP = 1 / 16
"""Distance of nodes in the root of the expected electrons."""
_LEAST = 1e-30
_REACH = 9.5


@dataclass(frozen=True)
class PixelTable:
    """Distribution of a pixel at nodes of the expected electrons.

    Parameters
    ----------
    shares : ndarray of shape (n_numbers, n_nodes)
        Log of the probability of each number, less its largest over all nodes.
    below : ndarray of shape (n_nodes, n_numbers)
        Cumulative probability.
    """

    shares: NDArray[np.float32]
    below: NDArray[np.float32]

    @property
    def last(self) -> int:
        """Last node but one."""
        return len(self.below) - 2

    def at(self, electrons: FloatArray) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
        """Return the node below each expected number of electrons, and the share of the next one.

        Parameters
        ----------
        electrons : ndarray
            Expected electrons.

        Returns
        -------
        node, share : ndarray of the same shape
            Node and share.
        """
        node = np.minimum(np.sqrt(electrons) / ROOT_STEP, self.last).astype(np.int32)
        # Linear in the electrons, not in their root, so that the mean is exact.
        share = (electrons / ROOT_STEP**2 - node.astype(float) ** 2) / (2.0 * node + 1)
        return node, np.clip(share, 0.0, 1.0).astype(np.float32)


@lru_cache(maxsize=4)
def pixel_table(pixel: Pixel) -> PixelTable:
    """Return the table of a pixel with its noise; cached.

    Parameters
    ----------
    pixel : Pixel
        Full well, gain, noise and ADC.

    Returns
    -------
    PixelTable
        Table.
    """
    shares = _with_prnu(_without_prnu(pixel), pixel)
    logs = np.log(np.maximum(shares, _LEAST)).T
    logs -= logs.max(axis=1, keepdims=True)
    below = np.cumsum(shares, axis=1)
    below /= below[:, -1:]
    return PixelTable(np.ascontiguousarray(logs, dtype=np.float32), np.ascontiguousarray(below, dtype=np.float32))


def _nodes_e(pixel: Pixel) -> FloatArray:
    """Return the expected electrons of the nodes, from 0 to saturation."""
    last = math.sqrt(moments.LinearRange.of(moments.without_prnu(pixel)).last_e)
    return np.asarray((np.arange(math.ceil(last / ROOT_STEP) + 2) * ROOT_STEP) ** 2, dtype=float)


def _without_prnu(pixel: Pixel) -> FloatArray:
    """Return the distribution at each node without gain errors, ndarray of shape (n_nodes, n_numbers)."""
    from scipy.sparse import csr_matrix  # noqa: PLC0415  (slow to import: kept off the start-up path)

    well = math.ceil(pixel.well_e)
    counts = np.arange(well + 1, dtype=float)
    electrons = _nodes_e(pixel)[:, None]
    logs = counts * np.log(np.maximum(electrons, 1e-300)) - electrons - gammaln(counts + 1)
    poisson = np.exp(logs)
    poisson[0] = counts == 0
    poisson[:, -1] += np.maximum(1 - poisson.sum(axis=1), 0.0)  # electrons beyond the full well
    held = np.minimum(counts, pixel.well_e)
    mean, sigma = held * pixel.dn_per_e + pixel.offset_dn, pixel.read_noise_e * pixel.dn_per_e
    top = pixel.full_scale_dn
    reach = min(math.ceil(_REACH * sigma), top) + 1
    number = np.floor(np.clip(mean, 0, top) + 0.5)[:, None] + np.arange(-reach, reach + 1)
    low, high = (number + side - mean[:, None] for side in (-0.5, 0.5))
    low[:, 0], high[:, -1] = -np.inf, np.inf
    if sigma:
        low, high = ndtr(low / sigma), ndtr(high / sigma)
    else:
        low, high = (low > 0).astype(float), (high > 0).astype(float)
    rows = np.broadcast_to(np.arange(counts.size)[:, None], number.shape).ravel()
    columns = np.clip(number, 0, top).astype(int).ravel()  # numbers beyond an end are read as the end
    read = csr_matrix(((high - low).ravel(), (rows, columns)), shape=(counts.size, top + 1))
    poisson[poisson < _LEAST] = 0.0
    return np.asarray((csr_matrix(poisson) @ read).toarray(), dtype=float)


def _with_prnu(shares: FloatArray, pixel: Pixel) -> FloatArray:
    """Return the mean over Gaussian gains of the pixels, by the trapezoidal rule between the nodes."""
    if not pixel.prnu:
        return shares
    from scipy.sparse import csr_matrix  # noqa: PLC0415  (slow to import: kept off the start-up path)

    electrons = _nodes_e(pixel)
    z = np.linspace(-6, 6, 49)
    weight = gaussian.density(z) / gaussian.density(z).sum()
    scaled_electrons = np.minimum(electrons[:, None] * np.maximum(1 + pixel.prnu * z, 0.0), electrons[-1])
    left = np.clip(np.searchsorted(electrons, scaled_electrons, side="right") - 1, 0, electrons.size - 2)
    share = (scaled_electrons - electrons[left]) / np.diff(electrons)[left]
    rows = np.broadcast_to(np.arange(electrons.size)[:, None], scaled_electrons.shape).ravel()
    entries = np.concatenate([(weight * (1 - share)).ravel(), (weight * share).ravel()])
    columns = np.concatenate([left.ravel(), left.ravel() + 1])
    mixed = csr_matrix((entries, (np.tile(rows, 2), columns)), shape=(electrons.size, electrons.size))
    return np.asarray(mixed @ shares, dtype=float)
