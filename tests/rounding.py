"""Tolerances by rounding alone, for what two routes, or blocks of other sizes, compute.

A sum of n products, in any order, is off by at most n u / (1 - n u) times the sum of their absolute values, where u is
half of the machine's eps (N. J. Higham, Accuracy and Stability of Numerical Algorithms, 2nd ed., sec. 3.1). So two such
sums are at most gamma_n times that sum apart, gamma_n = n eps / (1 - n eps). Libraries take the orders of their sums
from a block's size, each processor's in its own way. Only the same route with the same blocks on the same machine gives
equal bits.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
import pandas as pd

from sweep.camera.model import SceneModel
from sweep.camera.setup import Setup

EPS = float(np.finfo(float).eps)
_FACTORS = 16
"""Factors of a product, each rounded (light, lens, filter, QE, area, exposure, gain, ...), and what is added to the sum."""
_LEAST_NOISE_DN = 12**-0.5
"""Noise of rounding to whole digital numbers; all other noise adds to it."""


def gamma(terms: int) -> float:
    """Largest relative difference of two sums of `terms` positive products."""
    return terms * EPS / (1 - terms * EPS)


def rounding(terms: int, magnitude: float) -> float:
    """Largest difference of two sums of `terms` products, whose absolute values add up to `magnitude`."""
    return gamma(terms) * magnitude


def rounding_of_distance(terms: int, magnitude: float, channels: int) -> float:
    """Largest difference of two distances of two points, whose coordinates in `channels` are such sums.

    Each point moves by at most sqrt(channels) times what a coordinate does; the squares' sum and its root are rounded, too.
    """
    return 2 * math.sqrt(channels) * rounding(terms + channels + 2, magnitude)


def terms_of(setup: Setup) -> int:
    """Number of terms of a digital number: the wavelengths of each modified channel; the sum over the others is one."""
    return max(1, len(setup.camera.modified)) * setup.camera.grid.size + _FACTORS


def brightest_dn(setup: Setup, curves: np.ndarray) -> float:
    """The largest value that is read, DN, full scale or more: all its terms are positive, so it is their magnitude."""
    return max(float(setup.camera.pixel.full_scale_dn), float(np.nanmax(np.abs(SceneModel(setup).read(curves)[0]))))


def column_rounding(name: str, values: np.ndarray, setup: Setup, magnitude_dn: float, more: int = 0) -> np.ndarray:
    """Largest change of each value of a column of `evaluate`.

    `magnitude_dn`: see `brightest_dn`; `more`: terms beside `terms_of` the setup.
    """
    terms = terms_of(setup) + more
    distance = rounding_of_distance(terms, magnitude_dn, len(setup.camera.mosaic.channels))
    if "csd" in name:
        return np.full(np.shape(values), distance)
    if name.startswith("dprime"):  # a distance in units of its noise, which is rounded, too
        return np.asarray(distance / _LEAST_NOISE_DN + gamma(terms) * np.abs(values))
    if "error" in name:
        # Of Q(d'/2): the slope of its logarithm in d' is below 5 where it is above 1e-18.
        return np.asarray((5 * distance / _LEAST_NOISE_DN + gamma(terms)) * np.abs(values))
    if name == "exposure_s":
        return np.asarray(gamma(terms) * np.abs(values))
    # Shares, and steps of curves that are at most 1; lengths in nm.
    return np.asarray(gamma(terms) * np.maximum(1.0, np.abs(values)))


def assert_within_rounding(
    name: str, found: np.ndarray, expected: np.ndarray, setup: Setup, magnitude_dn: float, more: int = 0
) -> None:
    """Check that a column of one route or block is that of another one, up to `column_rounding`."""
    finite = np.isfinite(expected)
    np.testing.assert_array_equal(found[~finite], expected[~finite], err_msg=name)
    off = np.abs(found[finite] - expected[finite])
    allowed = column_rounding(name, expected[finite], setup, magnitude_dn, more)
    assert (off <= allowed).all(), f"{name}: up to {np.max(off - allowed)} more apart than by rounding"


def assert_tables_within_rounding(
    found: pd.DataFrame, expected: pd.DataFrame, setup: Setup, magnitude_dn: float, given: Iterable[str] = ()
) -> None:
    """Check rows of one scene: numbers up to `column_rounding`; words, flags, counts and what is `given` are equal."""
    computed = [name for name in expected.select_dtypes(float).columns if name not in set(given)]
    pd.testing.assert_frame_equal(found.drop(columns=computed), expected.drop(columns=computed), check_exact=True)
    assert list(found) == list(expected)
    for name in computed:
        assert_within_rounding(name, found[name].to_numpy(), expected[name].to_numpy(), setup, magnitude_dn)
