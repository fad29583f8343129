"""Raw patches of a noisy scene, drawn pixel by pixel, and how often a state is recognized from them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ..base.types import FloatArray, IndexArray
from ..camera.forward import AllPhases
from ..camera.readout import draws_dn
from .classifiers import CLASSIFIERS
from .share import share_interval

MOST_LIKELY = "most_likely"
"""Name of the rule that knows mean and variance of every signal's channels."""
_LEAST_VARIANCE = 1e-6
_MOST_PIXELS = 1024
_AT_ONCE = 4_000_000
"""Pixels that are drawn at once."""
DECIDERS = (MOST_LIKELY, *CLASSIFIERS)


def columns() -> tuple[str, ...]:
    """Names of what `recognize` finds: accuracy of each rule with its 95 % interval, and its worst state's."""
    return tuple(name for rule in DECIDERS for name in _columns_of(rule))


def _columns_of(rule: str) -> tuple[str, ...]:
    return tuple(f"{rule}_accuracy{end}" for end in ("", "_low", "_high", "_worst_state"))


def recognize(
    imager: AllPhases, curves: FloatArray, states: Sequence[str], patches: int, rng: np.random.Generator
) -> dict[str, float]:
    """Accuracy of every rule for one design, as `columns` names it; `curves`: ndarray[1, n_modified, n_wavelengths].

    `patches` raw patches (the pixels that the scene's readout takes) of every signal are drawn, each at one of the
    scene's places with its own Poisson electrons and gain errors. The classifiers see raw digital numbers (of a patch
    with more than 1,024 pixels a random choice of so many, the same for all), train on one half and are tested on the
    other. The most likely rule takes the channels' readout and the signal with the largest Gaussian likelihood at the
    patch's place, and says its state. Intervals: see `share_interval`.
    """
    members = [imager.setup.members[name] for name in states]
    signals = np.concatenate(members)
    state = np.repeat(np.arange(len(states)), [len(own) for own in members])
    electrons = imager.pixel_electrons(curves)[0]
    place = rng.integers(len(electrons), size=(patches, len(signals)))
    truth = np.broadcast_to(state, place.shape)
    n_pixels = electrons.shape[2]
    seen = np.sort(rng.permutation(n_pixels)[:_MOST_PIXELS])
    drawn = np.empty((*place.shape, seen.size), dtype=np.float32)  # [patches, n_signals, pixels that are seen]
    said = np.empty(place.shape, dtype=state.dtype)
    rule = _MostLikely(imager, curves, signals)
    step = max(1, _AT_ONCE // (len(signals) * n_pixels))
    for block in (slice(start, start + step) for start in range(0, patches, step)):
        whole = draws_dn(electrons[place[block], signals], imager.readout.pixel, rng)
        drawn[block] = whole[..., seen]
        said[block] = state[rule.of(whole, place[block])]
    found = dict(_accuracy(MOST_LIKELY, truth, said))
    half = patches // 2
    train, test = (part.reshape(-1, part.shape[-1]) for part in (drawn[:half], drawn[half:]))
    for name, classifier in CLASSIFIERS.items():
        if np.ptp(train, axis=0).any():
            taken_for = classifier(train, truth[:half].ravel(), test)
        else:  # every pixel of every patch reads the same
            taken_for = np.zeros(len(test), dtype=np.intp)
        found |= dict(_accuracy(name, truth[half:].ravel(), taken_for))
    return found


class _MostLikely:
    """The most likely of `signals` for drawn patches of one design."""

    def __init__(self, imager: AllPhases, curves: FloatArray, signals: IndexArray) -> None:
        read = imager.read_with_noise(curves)
        self._model = imager
        mean, variance = (np.moveaxis(of[0][:, signals], 2, 1) for of in (read.mean, read.variance))
        self._mean = np.ascontiguousarray(mean)  # [n_places, n_channels, n_signals]
        self._variance = np.ascontiguousarray(np.maximum(variance, _LEAST_VARIANCE))

    def of(self, drawn: FloatArray, place: IndexArray) -> IndexArray:
        """Its index for each patch, ndarray[n_patches, n_signals]; `drawn` has an axis more, of the pixels."""
        from .compiled_errors import likeliest  # noqa: PLC0415  (compiled: kept off the start-up path)

        best = np.empty(place.shape, dtype=np.intp)
        for at in np.unique(place):
            here = place == at
            kernel = int(at) * self._model.n_cases // len(self._mean)
            values = self._model.channels_of(drawn[here], kernel)  # [n, n_channels]
            found = np.empty(len(values), dtype=np.intp)
            likeliest(values, self._mean[at], self._variance[at], found)
            best[here] = found
        return best


def _accuracy(rule: str, truth: IndexArray, said: IndexArray) -> Iterator[tuple[str, float]]:
    right = np.asarray(truth == said)
    worst = min(float(right[truth == state].mean()) for state in np.unique(truth))
    values = (float(right.mean()), *share_interval(int(right.sum()), right.size), worst)
    yield from zip(_columns_of(rule), values, strict=True)
