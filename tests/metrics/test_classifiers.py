"""The linear discriminant against scikit-learn's."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from sweep.metrics.recognition import CLASSIFIERS


@pytest.mark.parametrize(("n_patches", "n_pixels"), [(12, 40), (200, 16), (60, 4), (3, 9)])
def test_the_discriminant_says_the_states_that_scikit_learn_says(n_patches: int, n_pixels: int) -> None:
    discriminant = pytest.importorskip("sklearn.discriminant_analysis")
    rng = np.random.default_rng([n_patches, n_pixels])
    centers = rng.normal(scale=20.0, size=(4, n_pixels))
    truth = np.repeat(np.arange(4), n_patches)
    mixed = rng.normal(size=(n_pixels, n_pixels))

    def patches() -> np.ndarray:
        drawn = np.round(200 + centers[truth] + 10 * rng.normal(size=(truth.size, n_pixels)) @ mixed)
        drawn[:, 0] = 17  # a pixel that always reads the same
        return drawn

    train, test = patches(), patches()
    rule = discriminant.LinearDiscriminantAnalysis(solver="lsqr", shrinkage="auto", priors=np.full(4, 0.25))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        expected = rule.fit(train, truth).predict(test)
    found = CLASSIFIERS["lda"](train, truth, test)
    assert (expected == truth).mean() > 0.3
    assert (found == expected).mean() == 1
