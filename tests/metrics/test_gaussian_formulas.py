"""Bounds of Gaussian noise, against the formulas of textbooks."""

from __future__ import annotations

import numpy as np

from sweep.metrics.discrimination import error_bounds


def test_the_error_bound_of_two_gaussians_is_their_bhattacharyya_coefficient() -> None:
    mean, variance = np.array([[[0.0], [3.0]]]), np.full((1, 2, 1), 2.0)
    members = {"red": np.array([0]), "green": np.array([1])}
    by_pair, _ = error_bounds(mean, variance, members)
    (bound,) = by_pair.values()
    np.testing.assert_allclose(bound, np.exp(-(3.0**2) / (8 * 2.0)), rtol=1e-12)
