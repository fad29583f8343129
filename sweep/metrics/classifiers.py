"""Rules that learn from some raw patches and say the state of others: the nearest centroid, Fisher's discriminant."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from ..base.types import FloatArray, IndexArray


def _nearest_centroid(train: FloatArray, truth: IndexArray, test: FloatArray) -> IndexArray:
    """The state whose mean patch is nearest."""
    from scipy.spatial.distance import cdist

    centers = np.stack([train[truth == state].mean(axis=0, dtype=float) for state in range(truth.max() + 1)])
    return np.asarray(cdist(test, centers).argmin(axis=1))


def _lda(train: FloatArray, truth: IndexArray, test: FloatArray) -> IndexArray:
    """Fisher's linear discriminant with equal priors; shrinkage keeps it stable with more pixels than patches."""
    groups = [train[truth == state].astype(float) for state in range(int(truth.max()) + 1)]
    means = np.stack([group.mean(axis=0) for group in groups])
    covariance = np.mean([_shrunk_covariance(group) for group in groups], axis=0)
    weights = np.linalg.lstsq(covariance, means.T, rcond=None)[0]
    scores = test @ weights - np.einsum("sp,ps->s", means, weights) / 2
    return np.asarray(scores.argmax(axis=1))


def _shrunk_covariance(patches: FloatArray) -> FloatArray:
    """Covariance of patches, ndarray[n, n_pixels], of unit variance shrunk towards a sphere, and scaled back.

    Source: Ledoit and Wolf, J. Multivariate Analysis 88, 365 (2004), lemma 3.3.
    """
    n, n_pixels = patches.shape
    scale = patches.std(axis=0)
    scale[scale == 0] = 1.0
    x = (patches - patches.mean(axis=0)) / scale
    sample = x.T @ x / n
    mean_variance = np.trace(sample) / n_pixels
    distance = ((sample - mean_variance * np.eye(n_pixels)) ** 2).sum()
    noise = min((((x**2).T @ x**2).sum() / n - (sample**2).sum()) / n, distance)
    share = noise / distance if noise > 0 else 0.0
    shrunk = (1 - share) * sample + share * mean_variance * np.eye(n_pixels)
    return np.asarray(scale[:, None] * shrunk * scale, dtype=float)


CLASSIFIERS: Mapping[str, Callable[[FloatArray, IndexArray, FloatArray], IndexArray]] = {
    "nearest_centroid": _nearest_centroid,
    "lda": _lda,
}
"""What patches, ndarray[n, n_pixels], are taken for by rules that are trained on others: numbers of states."""
