"""Rules that learn from some raw patches and say the state of others: the nearest centroid, Fisher's discriminant.

scikit-learn says the same of every patch (`tests/metrics/test_classifiers.py`). It is not used here: each worker would
load SciPy's statistics and pandas with it, which takes longer than all fits of a study.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from ..base.types import FloatArray, IndexArray


def _by_state(train: FloatArray, truth: IndexArray) -> list[FloatArray]:
    """Patches of each state, ndarray[n, n_pixels]."""
    return [train[truth == state].astype(float) for state in range(int(truth.max()) + 1)]


def _nearest_centroid(train: FloatArray, truth: IndexArray, test: FloatArray) -> IndexArray:
    """The state whose mean patch is nearest."""
    from scipy.spatial.distance import cdist  # noqa: PLC0415  (slow to import, and few studies need it)

    centers = np.stack([own.mean(axis=0) for own in _by_state(train, truth)])
    return np.asarray(cdist(test, centers).argmin(axis=1))


def _lda(train: FloatArray, truth: IndexArray, test: FloatArray) -> IndexArray:
    """Fisher's discriminant of states that are equally likely."""
    states = _by_state(train, truth)
    means = np.stack([own.mean(axis=0) for own in states])
    covariance = np.mean([_shrunk(own - mean) for own, mean in zip(states, means, strict=True)], axis=0)
    weights = np.linalg.lstsq(covariance, means.T, rcond=None)[0]  # [n_pixels, n_states]
    return np.asarray((test @ weights - 0.5 * (means * weights.T).sum(axis=1)).argmax(axis=1))


def _shrunk(apart: FloatArray) -> FloatArray:
    """Covariance of patches less their mean, ndarray[n, n_pixels], that stays stable with more pixels than patches.

    That of the pixels in units of their deviations is mixed with the mean of its diagonal, in the share of which the
    mean squared error is least (Ledoit and Wolf, J. Multivariate Analysis 88, 365, 2004).
    """
    n, pixels = apart.shape
    deviation = np.sqrt(np.square(apart).mean(axis=0))
    deviation[deviation == 0] = 1.0  # a pixel that reads the same in every patch
    apart = apart / deviation
    found = apart.T @ apart / n
    level, squares = np.trace(found) / pixels, np.square(found).sum()
    unlike = squares / pixels - level**2
    noise = min((np.square(np.square(apart).sum(axis=1)).sum() / n - squares) / (n * pixels), unlike)
    share = noise / unlike if noise > 0 else 0.0
    found *= 1 - share
    found[np.diag_indices(pixels)] += share * level
    return np.asarray(found * np.outer(deviation, deviation))


CLASSIFIERS: Mapping[str, Callable[[FloatArray, IndexArray, FloatArray], IndexArray]] = {
    "nearest_centroid": _nearest_centroid,
    "lda": _lda,
}
"""What patches, ndarray[n, n_pixels], are taken for by rules that are trained on others: numbers of states."""
