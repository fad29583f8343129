"""Raw patches of a noisy scene, drawn pixel by pixel, and the accuracy of classifiers on them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np

from ..base.types import FloatArray, IndexArray
from ..camera.forward import AllPhases
from ..camera.readout import draws_dn
from .share import share_interval


def _nearest_centroid(train: FloatArray, truth: IndexArray, test: FloatArray) -> IndexArray:
    """Return the state with the nearest mean patch."""
    from scipy.spatial.distance import cdist  # noqa: PLC0415  (few studies need it)

    centers = np.stack([train[truth == state].mean(axis=0, dtype=float) for state in range(truth.max() + 1)])
    return np.asarray(cdist(test, centers).argmin(axis=1))


def _lda(train: FloatArray, truth: IndexArray, test: FloatArray) -> IndexArray:
    """Return the state by Fisher's linear discriminant with equal priors and a shrunk covariance."""
    groups = [train[truth == state].astype(float) for state in range(int(truth.max()) + 1)]
    means = np.stack([group.mean(axis=0) for group in groups])
    covariance = np.mean([_shrunk_covariance(group) for group in groups], axis=0)
    weights = np.linalg.lstsq(covariance, means.T, rcond=None)[0]
    scores = test @ weights - np.einsum("sp,ps->s", means, weights) / 2
    return np.asarray(scores.argmax(axis=1))


def _shrunk_covariance(patches: FloatArray) -> FloatArray:
    """Return the covariance of patches, ndarray of shape (n, n_pixels), shrunk toward a sphere at unit variance.

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

MOST_LIKELY = "most_likely"
"""Name of the rule that knows mean and variance of every signal's channels."""
_LEAST_VARIANCE = 1e-6
_MOST_PIXELS = 1024
_AT_ONCE = 4_000_000
"""Pixels that are drawn at once."""
DECIDERS = (MOST_LIKELY, *CLASSIFIERS)


def columns() -> tuple[str, ...]:
    """Return the names of the results of `recognize`.

    Returns
    -------
    tuple of str
        Accuracy of each rule with its 95 % interval, and that of its worst state.
    """
    return tuple(name for rule in DECIDERS for name in _columns_of(rule))


def _columns_of(rule: str) -> tuple[str, ...]:
    return tuple(f"{rule}_accuracy{end}" for end in ("", "_low", "_high", "_worst_state"))


def recognize(
    imager: AllPhases, curves: FloatArray, states: Sequence[str], patches: int, rng: np.random.Generator
) -> dict[str, float]:
    """Train and test classifiers on raw patches of one design.

    `patches` raw patches of every signal are drawn, each at a phase of the scene with its own Poisson electrons and
    gain errors. The classifiers take raw digital numbers (at most 1,024 pixels, chosen at random), train on one half
    and are tested on the other. The maximum likelihood rule takes the channels' readout and the signal with the
    largest Gaussian likelihood at the patch's phase.

    Parameters
    ----------
    imager : AllPhases
        Model of the scene.
    curves : ndarray of shape (1, n_modified, n_wavelengths)
        QE of the modified channels.
    states : sequence of str
        Signal types.
    patches : int
        Patches of every signal.
    rng : numpy.random.Generator
        Source of random numbers.

    Returns
    -------
    dict of str to float
        Accuracies by the names of `columns`; intervals as of `share_interval`.
    """
    members = [imager.setup.members[name] for name in states]
    signals = np.concatenate(members)
    state = np.repeat(np.arange(len(states)), [len(type_signals) for type_signals in members])
    electrons = imager.pixel_electrons(curves)[0]
    place = rng.integers(len(electrons), size=(patches, len(signals)))
    truth = np.broadcast_to(state, place.shape)
    n_pixels = electrons.shape[2]
    chosen_pixels = np.sort(rng.permutation(n_pixels)[:_MOST_PIXELS])
    drawn = np.empty((*place.shape, chosen_pixels.size), dtype=np.float32)  # [patches, n_signals, pixels that are seen]
    answered = np.empty(place.shape, dtype=state.dtype)
    read = imager.read_with_noise(curves)
    mean = read.mean[0][:, signals]  # [n_places, n_signals, n_channels]
    variance = np.maximum(read.variance[0][:, signals], _LEAST_VARIANCE)
    step = max(1, _AT_ONCE // (len(signals) * n_pixels))
    for block in (slice(start, start + step) for start in range(0, patches, step)):
        whole = draws_dn(electrons[place[block], signals], imager.readout.pixel, rng)
        drawn[block] = whole[..., chosen_pixels]
        for at in np.unique(place[block]):
            here = place[block] == at
            values = imager.channels_of(whole[here], int(at) * imager.n_cases // len(mean))  # [n, n_channels]
            answered[block][here] = state[_likeliest(values, mean[at], variance[at])]
    accuracy = dict(_accuracy(MOST_LIKELY, truth, answered))
    half = patches // 2
    train, test = (part.reshape(-1, part.shape[-1]) for part in (drawn[:half], drawn[half:]))
    for name, classifier in CLASSIFIERS.items():
        if np.ptp(train, axis=0).any():
            taken_for = classifier(train, truth[:half].ravel(), test)
        else:  # every pixel of every patch reads the same
            taken_for = np.zeros(len(test), dtype=np.intp)
        accuracy |= dict(_accuracy(name, truth[half:].ravel(), taken_for))
    return accuracy


def _likeliest(values: FloatArray, mean: FloatArray, variance: FloatArray) -> IndexArray:
    """Return the signal with the largest Gaussian likelihood at readouts, ndarray of shape (n, n_channels)."""
    unlike = np.zeros((len(values), len(mean)))
    for c in range(values.shape[1]):
        unlike += (values[:, None, c] - mean[:, c]) ** 2 / variance[:, c] + np.log(variance[:, c])
    return np.asarray(unlike.argmin(axis=1))


def _accuracy(rule: str, truth: IndexArray, answered: IndexArray) -> Iterator[tuple[str, float]]:
    right = np.asarray(truth == answered)
    worst = min(float(right[truth == state].mean()) for state in np.unique(truth))
    values = (float(right.mean()), *share_interval(int(right.sum()), right.size), worst)
    yield from zip(_columns_of(rule), values, strict=True)
