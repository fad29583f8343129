"""Raw patches of a noisy scene, drawn pixel by pixel, and how often a state is recognized from them."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from scipy.stats import binomtest

from .arrays import FloatArray, IndexArray
from .effects import noise
from .imaging import Imager

MOST_LIKELY = "most_likely"
"""Name of the rule that knows mean and variance of every signal's channels."""
_CONFIDENCE = 0.95
_LEAST_VARIANCE = 1e-6


def _nearest_centroid(_: int) -> Any:
    from sklearn.neighbors import NearestCentroid

    return NearestCentroid()


def _lda(n_states: int) -> Any:
    """Fisher's discriminant; shrinkage (Ledoit and Wolf) keeps it stable with more pixels than patches."""
    from sklearn.discriminant_analysis import LinearDiscriminantAnalysis

    return LinearDiscriminantAnalysis(solver="lsqr", shrinkage="auto", priors=np.full(n_states, 1 / n_states))


CLASSIFIERS: Mapping[str, Callable[[int], Any]] = {"nearest_centroid": _nearest_centroid, "lda": _lda}
"""Classifiers that are trained on raw patches."""
RULES = (MOST_LIKELY, *CLASSIFIERS)


def columns() -> tuple[str, ...]:
    """Names of what `recognize` finds: accuracy of each rule with its 95 % interval, and its worst state's."""
    ends = ("", "_low", "_high", "_worst_state")
    return tuple(f"{rule}_accuracy{end}" for rule in RULES for end in ends)


def recognize(
    imager: Imager, curves: FloatArray, states: Sequence[str], patches: int, rng: np.random.Generator
) -> dict[str, float]:
    """Accuracy of every rule for one design, as `columns` names it; `curves`: ndarray[1, n_modified, n_wavelengths].

    `patches` raw patches (the pixels that the scene's readout takes) of every signal are drawn, each at one of the
    scene's places with its own Poisson electrons and gain errors. The classifiers see raw digital numbers, train on
    one half and are tested on the other. The most likely rule takes the channels' readout and the signal with the
    largest Gaussian likelihood at the patch's place, and says its state. Intervals are Wilson's.
    """
    members = {name: imager.setup.members[name] for name in states}
    signals = np.concatenate(list(members.values()))
    state = np.concatenate([np.full(len(own), name) for name, own in members.items()])
    electrons = imager.pixel_electrons(curves)[0]
    place = rng.integers(len(electrons), size=(patches, len(signals)))
    drawn = noise.draws_dn(electrons[place, signals], imager.pixel, rng)  # [patches, n_signals, n_pixels]
    truth = np.broadcast_to(state, place.shape)
    found = dict(_accuracy(MOST_LIKELY, truth, state[_most_likely(imager, curves, drawn, place, signals)]))
    half = patches // 2
    train, test = (part.reshape(-1, part.shape[-1]) for part in (drawn[:half], drawn[half:]))
    for name, make in CLASSIFIERS.items():
        if np.ptp(train, axis=0).any():
            with warnings.catch_warnings():  # scikit-learn's, where a pixel reads the same in every patch of a state
                warnings.simplefilter("ignore", UserWarning)
                said = make(len(states)).fit(train, truth[:half].ravel()).predict(test)
        else:  # every pixel of every patch reads the same
            said = np.full(len(test), states[0])
        found |= dict(_accuracy(name, truth[half:].ravel(), said))
    return found


def _most_likely(
    imager: Imager, curves: FloatArray, drawn: FloatArray, place: IndexArray, signals: IndexArray
) -> IndexArray:
    """Index among `signals` of the most likely one for each patch, ndarray[n_patches, n_signals]."""
    mean, variance, _ = imager.read_with_noise(curves)
    best = np.empty(place.shape, dtype=np.intp)
    for at in np.unique(place):
        here = place == at
        values = imager.channels_of(drawn[here], int(at) * imager.n_cases // mean.shape[1])  # [n, n_channels]
        m, v = mean[0, at, signals], np.maximum(variance[0, at, signals], _LEAST_VARIANCE)
        likelihood = -0.5 * ((values[:, None] - m) ** 2 / v + np.log(v)).sum(axis=2)
        best[here] = likelihood.argmax(axis=1)
    return best


def _accuracy(rule: str, truth: Any, said: Any) -> Iterator[tuple[str, float]]:
    right = np.asarray(truth == said)
    interval = binomtest(int(right.sum()), right.size).proportion_ci(_CONFIDENCE, method="wilson")
    worst = min(float(right[truth == state].mean()) for state in np.unique(truth))
    values = (float(right.mean()), float(interval.low), float(interval.high), worst)
    yield from zip((name for name in columns() if name.startswith(f"{rule}_accuracy")), values, strict=True)
