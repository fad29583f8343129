"""Rules that learn from some raw patches and say the state of others: the nearest centroid, Fisher's discriminant."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping

import numpy as np

from ..base.types import FloatArray, IndexArray


def _nearest_centroid(train: FloatArray, truth: IndexArray, test: FloatArray) -> IndexArray:
    """The state whose mean patch is nearest."""
    from scipy.spatial.distance import cdist

    centers = np.stack([train[truth == state].mean(axis=0, dtype=float) for state in range(truth.max() + 1)])
    return np.asarray(cdist(test, centers).argmin(axis=1))


def _lda(train: FloatArray, truth: IndexArray, test: FloatArray) -> IndexArray:
    """Fisher's discriminant; shrinkage (Ledoit and Wolf) keeps it stable with more pixels than patches."""
    from sklearn.discriminant_analysis import LinearDiscriminantAnalysis

    n_states = int(truth.max()) + 1
    rule = LinearDiscriminantAnalysis(solver="lsqr", shrinkage="auto", priors=np.full(n_states, 1 / n_states))
    with warnings.catch_warnings():  # scikit-learn's, where a pixel reads the same in every patch of a state
        warnings.simplefilter("ignore", UserWarning)
        return np.asarray(rule.fit(train, truth).predict(test))


CLASSIFIERS: Mapping[str, Callable[[FloatArray, IndexArray, FloatArray], IndexArray]] = {
    "nearest_centroid": _nearest_centroid,
    "lda": _lda,
}
"""What patches, ndarray[n, n_pixels], are taken for by rules that are trained on others: numbers of states."""
