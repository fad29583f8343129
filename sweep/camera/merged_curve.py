"""Mean and variance of the merged value of an HDR pixel over its expected electrons, with slopes, for the search."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from ..base.types import FloatArray
from .merge import merged
from .pixel import Pixel
from .readings import nodes_of

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

_LEAST_ROOT = 1e-3
_STEPS_DN2 = 1 / 12
"""Least variance that is taken, DN^2, as of rounding: a saturated pixel has none, and no direction to go."""


@dataclass(frozen=True)
class MergedCurve:
    """Splines over the root of the expected electrons, in which Poisson means are smooth.

    Parameters
    ----------
    moments : CubicSpline
        Mean, DN of the first capture, and variance, DN^2.
    last_root : float
        Root of the electrons from which on all is saturated.
    """

    moments: CubicSpline
    last_root: float

    def at(self, electrons: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return the moments and their slopes.

        Parameters
        ----------
        electrons : ndarray
            Expected electrons of a pixel of full sensitivity.

        Returns
        -------
        mean, variance, mean_per_e, variance_per_e : ndarray of the same shape
            Mean, DN, variance, DN^2, and their derivatives by the electrons.
        """
        root = np.clip(np.sqrt(np.maximum(electrons, 0.0)), _LEAST_ROOT, self.last_root)
        mean, variance = self.moments(root)
        slopes = np.where(root < self.last_root, self.moments(root, 1) / (2 * root), 0.0)
        noisy = variance > _STEPS_DN2
        return mean, np.maximum(variance, _STEPS_DN2), slopes[0], np.where(noisy, slopes[1], 0.0)


@lru_cache(maxsize=16)
def merged_curve(pixel: Pixel, light: tuple[float, ...]) -> MergedCurve:
    """Tabulate the merged value of a pixel; cached.

    Parameters
    ----------
    pixel : Pixel
        HDR pixel.
    light : tuple of float
        Light of each exposure relative to that of a pixel of full sensitivity.

    Returns
    -------
    MergedCurve
        The table.
    """
    from scipy.interpolate import CubicSpline  # noqa: PLC0415  (slow to import: kept off the start-up path)

    of_exposure = np.array(light)
    roots_e, is_node = nodes_of(pixel, of_exposure)
    nodes_e = roots_e[is_node]
    at_nodes = merged(nodes_e * of_exposure[:, None], of_exposure[:, None], pixel)
    roots = np.sqrt(nodes_e)
    return MergedCurve(CubicSpline(roots, np.stack([at_nodes.mean, at_nodes.variance]), axis=1), float(roots[-1]))
