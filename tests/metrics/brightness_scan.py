"""Scans of lamps of every brightness: no walk along brightness curves, but readings by the same law of the pixel."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sweep.camera.brightness import LampReadings

from ..margin import near_squared_dprime

_FACTORS = np.concatenate([[0.0], np.geomspace(1e-6, 1e7, 6000)])
_BASINS, _FINER = 24, 101
LEAST_DN2 = 1e-9


def squared(
    mean: np.ndarray, spread: np.ndarray, reading: np.ndarray, noise: np.ndarray | None, most: float = np.inf
) -> np.ndarray:
    """Squared distances of one reading, and its variance, from readings of another lamp, [..., channels]."""
    if noise is None:
        return ((mean - reading) ** 2).sum(axis=-1)
    return near_squared_dprime(mean - reading, np.maximum(spread, LEAST_DN2), np.maximum(noise, LEAST_DN2), most)


def nearest(
    lamps: LampReadings, first: np.ndarray, second: np.ndarray, *, noise: bool
) -> tuple[float, int, int, float]:
    """Smallest distance of a lamp of one type as it is to one of the other of 6,000 brightnesses, then between these.

    Returns the distance, the lamp that is read, the other one and its brightness.
    """
    found, upper = list[tuple[float, int, int, int]](), np.inf
    for own, other in ((first, second), (second, first)):
        means, spreads = (values[:, 0] for values in lamps.moments(own, np.ones((own.size, 1))))
        for curve in other:
            mean, spread = (values[0] for values in lamps.moments(np.array([curve]), _FACTORS[None]))
            for reading, at, variance in zip(own, means, spreads, strict=True):
                distances = squared(mean, spread, at, variance if noise else None, upper)
                best = int(distances.argmin())
                upper = min(upper, 4 * float(distances[best]))
                found.append((float(distances[best]), int(reading), int(curve), best))
    least = (np.inf, -1, -1, 0.0)
    for value, reading, curve, best in sorted(found)[:_BASINS]:
        at, variance = (values[0, 0] for values in lamps.moments(np.array([reading]), np.ones((1, 1))))
        ends = _FACTORS[max(best - 1, 0)], _FACTORS[min(best + 1, _FACTORS.size - 1)]
        least = min(least, (value, reading, curve, float(_FACTORS[best])))
        for _ in range(4):
            factors = np.linspace(*ends, _FINER)
            mean, spread = (values[0] for values in lamps.moments(np.array([curve]), factors[None]))
            distances = squared(mean, spread, at, variance if noise else None)
            place = int(distances.argmin())
            least = min(least, (float(distances[place]), reading, curve, float(factors[place])))
            ends = factors[max(place - 1, 0)], factors[min(place + 1, _FINER - 1)]
    return float(np.sqrt(least[0])), *least[1:]


def smallest(cases: Sequence[LampReadings], first: np.ndarray, second: np.ndarray, *, noise: bool) -> float:
    """Smallest distance over several cases."""
    return min(nearest(lamps, first, second, noise=noise)[0] for lamps in cases)
