"""Classifiers and bounds of Gaussian noise, against the formulas of textbooks."""

from __future__ import annotations

import numpy as np
from scipy.stats import norm

from sweep.metrics.discrimination import error_bounds
from sweep.metrics.recognition import _most_likely_signal


def test_the_most_likely_signal_has_the_largest_gaussian_likelihood() -> None:
    mean, variance = np.array([[0.0], [1.0]]), np.array([[1.0], [100.0]])
    channels = np.linspace(-30, 30, 61)[:, None]
    likely = norm.logpdf(channels[:, None], mean, np.sqrt(variance)).sum(axis=2).argmax(axis=1)
    assert {*likely} == {0, 1}
    np.testing.assert_array_equal(_most_likely_signal(channels, mean, variance), likely)


def test_the_error_bound_of_two_gaussians_is_their_bhattacharyya_coefficient() -> None:
    mean, variance = np.array([[[0.0], [3.0]]]), np.full((1, 2, 1), 2.0)
    members = {"red": np.array([0]), "green": np.array([1])}
    by_pair, _ = error_bounds(mean, variance, members)
    (bound,) = by_pair.values()
    np.testing.assert_allclose(bound, np.exp(-(3.0**2) / (8 * 2.0)), rtol=1e-12)
