"""Classifiers of raw patches, against scikit-learn's."""

from __future__ import annotations

import subprocess
import sys
import warnings

import numpy as np
import pytest

from sweep.metrics.classifiers import CLASSIFIERS


def patches(n_pixels: int, n_states: int, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Patches to train on, of which state each is, and patches to test; the last pixel of several reads the same."""
    rng = np.random.default_rng(seed)
    means = rng.uniform(100, 130, (n_states, n_pixels))
    truth = np.repeat(np.arange(n_states), rng.integers(20, 60, n_states))
    train, test = (
        np.floor(means[truth] + rng.standard_normal((truth.size, n_pixels)) * rng.uniform(1, 30, n_pixels))
        for _ in range(2)
    )
    if n_pixels > 1:
        train[:, -1] = 7.0
    return train.astype(np.float32), truth, test.astype(np.float32)


@pytest.mark.parametrize("n_states", [2, 3, 5])
@pytest.mark.parametrize("n_pixels", [1, 4, 30, 300])
def test_patches_are_taken_for_what_scikit_learn_says(n_pixels: int, n_states: int) -> None:
    from sklearn.discriminant_analysis import LinearDiscriminantAnalysis
    from sklearn.neighbors import NearestCentroid

    oracles = {
        "lda": LinearDiscriminantAnalysis(solver="lsqr", shrinkage="auto", priors=np.full(n_states, 1 / n_states)),
        "nearest_centroid": NearestCentroid(),
    }
    assert oracles.keys() == CLASSIFIERS.keys()
    train, truth, test = patches(n_pixels, n_states, seed=n_pixels + n_states)
    for name, oracle in oracles.items():
        said = CLASSIFIERS[name](train, truth, test)
        with warnings.catch_warnings():  # where a pixel reads the same in every patch
            warnings.simplefilter("ignore", UserWarning)
            expected = oracle.fit(train.astype(float), truth).predict(test.astype(float))
        assert np.array_equal(said, expected)
        assert len(np.unique(said)) == n_states


CODE = """
import sys
import numpy as np
from sweep.metrics.classifiers import CLASSIFIERS

train, truth = np.arange(12.0).reshape(6, 2), np.repeat([0, 1], 3)
for classifier in CLASSIFIERS.values():
    classifier(train, truth, train)
print(*({"pandas", "scipy.stats", "sklearn"} & sys.modules.keys()))
"""


def test_a_worker_loads_no_statistics_to_classify() -> None:
    ran = subprocess.run([sys.executable, "-c", CODE], capture_output=True, text=True, check=True)
    assert ran.stdout.split() == []
