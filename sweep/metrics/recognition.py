"""Accuracy of classifiers on simulated raw patches with noise (Monte Carlo)."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np

from ..base.types import FloatArray, IndexArray
from ..camera import merge
from ..camera.forward import AllPhases
from ..camera.readout import draws_dn
from .share import share_interval

_MIN_VARIANCE_DN2 = 1e-6
"""Lower limit of a channel's variance, so that a channel without noise has a likelihood, DN^2."""
_MAX_PIXELS = 1024
"""Pixels of a patch that the classifiers use, at most."""
_BLOCK_PIXELS = 4_000_000
"""Pixels drawn in one block, which limits the memory."""


def _nearest_centroid(train: FloatArray, truth: IndexArray, test: FloatArray) -> IndexArray:
    """Classify each test patch by the nearest class mean of the training patches."""
    from scipy.spatial.distance import cdist  # noqa: PLC0415  (few studies need it)

    centers = np.stack([train[truth == state].mean(axis=0, dtype=float) for state in range(truth.max() + 1)])
    return np.asarray(cdist(test, centers).argmin(axis=1))


def _lda(train: FloatArray, truth: IndexArray, test: FloatArray) -> IndexArray:
    """Classify each test patch by linear discriminant analysis: equal priors, Ledoit-Wolf covariance within classes."""
    groups = [train[truth == state].astype(float) for state in range(int(truth.max()) + 1)]
    means = np.stack([group.mean(axis=0) for group in groups])
    covariance = np.mean([_shrunk_covariance(group) for group in groups], axis=0)
    weights = np.linalg.lstsq(covariance, means.T, rcond=None)[0]
    half_norms = np.einsum("sp,ps->s", means, weights) / 2  # m^T C^-1 m / 2 of each class mean m
    scores = test @ weights - half_norms
    return np.asarray(scores.argmax(axis=1))


def _shrunk_covariance(patches: FloatArray) -> FloatArray:
    """Return the Ledoit-Wolf covariance estimate of patches, ndarray of shape (n_pixels, n_pixels).

    Pixels are scaled to unit variance, their sample covariance is shrunk toward a multiple of the identity, and the
    scale is undone. `patches`: (n, n_pixels). Source: Ledoit and Wolf, J. Multivariate Analysis 88, 365 (2004),
    lemma 3.3: d^2 and b^2 as there, without their common factor 1 / n_pixels.
    """
    n, n_pixels = patches.shape
    deviation = patches.std(axis=0)
    deviation[deviation == 0] = 1.0
    standardized = (patches - patches.mean(axis=0)) / deviation
    sample = standardized.T @ standardized / n
    target = np.trace(sample) / n_pixels * np.eye(n_pixels)
    d_squared = ((sample - target) ** 2).sum()
    squares = standardized**2
    b_squared = min(((squares.T @ squares).sum() / n - (sample**2).sum()) / n, d_squared)
    shrinkage = b_squared / d_squared if b_squared > 0 else 0.0
    shrunk = (1 - shrinkage) * sample + shrinkage * target
    return np.asarray(deviation[:, None] * shrunk * deviation, dtype=float)


CLASSIFIERS: Mapping[str, Callable[[FloatArray, IndexArray, FloatArray], IndexArray]] = {
    "nearest_centroid": _nearest_centroid,
    "lda": _lda,
}
"""Trained classifiers: each takes training patches (n_train, n_pixels), their classes (n_train,) and test patches
(n_test, n_pixels), and returns the class indices (n_test,)."""

MOST_LIKELY = "most_likely"
"""Name of the maximum-likelihood classifier, which knows mean and variance of each channel for every signal."""
CLASSIFIER_NAMES = (MOST_LIKELY, *CLASSIFIERS)
"""All classifiers, in the order of the columns."""


def columns() -> tuple[str, ...]:
    """Return the names of the results of `recognize`.

    Returns
    -------
    tuple of str
        For each classifier: accuracy, both ends of its 95 % interval, and the accuracy of the worst state.
    """
    return tuple(name for classifier in CLASSIFIER_NAMES for name in _columns_of(classifier))


def _columns_of(classifier: str) -> tuple[str, ...]:
    """Return the column names of one classifier, in the order of the values in `_accuracy`."""
    return tuple(f"{classifier}_accuracy{end}" for end in ("", "_low", "_high", "_worst_state"))


def recognize(
    model: AllPhases, curves: FloatArray, states: Sequence[str], patches: int, rng: np.random.Generator
) -> dict[str, float]:
    """Train and test classifiers on simulated raw patches of one design.

    For each signal, `patches` patches are drawn. Each has a random sampling phase, field position and moment, and
    its own photon noise, read noise and PRNU. The trained classifiers use raw digital numbers of up to 1,024 random
    pixels: the first half of the patches is the training set, the second half the test set. The maximum-likelihood
    classifier is tested on all patches: it reads out the channels, and picks the signal with the largest Gaussian
    likelihood at the known phase.

    Parameters
    ----------
    model : AllPhases
        Forward model of the scene.
    curves : ndarray of shape (1, n_modified, n_wavelengths)
        QE of the modified channels.
    states : sequence of str
        Signal types, which are the classes.
    patches : int
        Number of patches of each signal.
    rng : numpy.random.Generator
        Source of random numbers.

    Returns
    -------
    dict of str to float
        Accuracies, 0 to 1, by the names of `columns`; the 95 % intervals are those of `share_interval`.
    """
    class_signals = [model.setup.members[name] for name in states]
    signals = np.concatenate(class_signals)
    class_of_signal = np.repeat(np.arange(len(states)), [len(indices) for indices in class_signals])
    electrons = model.pixel_electrons(curves)[..., 0, :, :, :]
    cases = rng.integers(electrons.shape[-3], size=(patches, len(signals)))  # phase, field position and moment
    truth = np.broadcast_to(class_of_signal, cases.shape)
    n_pixels = electrons.shape[-1]
    used_pixels = np.sort(rng.permutation(n_pixels)[:_MAX_PIXELS])
    raw_dn = np.empty((*cases.shape, used_pixels.size), dtype=np.float32)
    predicted = np.empty(cases.shape, dtype=class_of_signal.dtype)
    readout = model.read_with_noise(curves)
    mean = readout.mean[0][:, signals]  # [n_cases x n_moments, n_signals, n_channels]
    variance = np.maximum(readout.variance[0][:, signals], _MIN_VARIANCE_DN2)
    block_size = max(1, _BLOCK_PIXELS // (len(signals) * n_pixels))
    for block in (slice(start, start + block_size) for start in range(0, patches, block_size)):
        drawn, light = electrons[..., cases[block], signals, :], model.capture_light
        if light is None:
            block_dn = draws_dn(drawn, model.readout.pixel, rng)
        else:
            block_dn = merge.draws(drawn, light[:, None, None], model.readout.pixel, rng)
        raw_dn[block] = block_dn[..., used_pixels]
        for case in np.unique(cases[block]):
            here = cases[block] == case
            without_moment = int(case) * model.n_cases // len(mean)
            channels = model.channels_of(block_dn[here], without_moment)
            predicted[block][here] = class_of_signal[_most_likely_signal(channels, mean[case], variance[case])]
    accuracy = dict(_accuracy(MOST_LIKELY, truth, predicted))
    half = patches // 2
    train, test = (part.reshape(-1, part.shape[-1]) for part in (raw_dn[:half], raw_dn[half:]))
    for name, classifier in CLASSIFIERS.items():
        if np.ptp(train, axis=0).any():
            test_predicted = classifier(train, truth[:half].ravel(), test)
        else:  # every pixel of every patch reads the same
            test_predicted = np.zeros(len(test), dtype=np.intp)
        accuracy |= dict(_accuracy(name, truth[half:].ravel(), test_predicted))
    return accuracy


def _most_likely_signal(channels: FloatArray, mean: FloatArray, variance: FloatArray) -> IndexArray:
    """Return the index of the signal with the largest Gaussian likelihood for each readout.

    `channels`: (n, n_channels), DN; `mean`, `variance`: (n_signals, n_channels), DN and DN^2.
    """
    deviance = np.zeros((len(channels), len(mean)))  # -2 log likelihood, up to a constant
    for c in range(channels.shape[1]):
        deviance += (channels[:, None, c] - mean[:, c]) ** 2 / variance[:, c] + np.log(variance[:, c])
    return np.asarray(deviance.argmin(axis=1))


def _accuracy(classifier: str, truth: IndexArray, predicted: IndexArray) -> Iterator[tuple[str, float]]:
    """Yield column name and value: accuracy, its 95 % interval, accuracy of the worst class."""
    correct = np.asarray(truth == predicted)
    worst = min(float(correct[truth == index].mean()) for index in np.unique(truth))
    values = (float(correct.mean()), *share_interval(int(correct.sum()), correct.size), worst)
    yield from zip(_columns_of(classifier), values, strict=True)
