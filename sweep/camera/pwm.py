"""A pulsed LED: how much of its light falls into an exposure depends on when the exposure starts."""

from __future__ import annotations

import numpy as np

from ..base.types import FloatArray
from .scene import Drive
from .setup import Setup


def extremes(drive: Drive, exposure_s: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Least and most light in an exposure relative to the mean, over all starting times, ndarray[...] each.

    The light is on for `duty` of each period, `1 / duty` as bright as its mean. n whole periods and a rest r give
    n duty and, of the rest, between max(0, r - (1 - duty)) and min(r, duty).
    """
    periods = exposure_s * drive.frequency_hz
    whole = np.floor(periods)
    rest = periods - whole
    on = [whole * drive.duty + part for part in (np.maximum(0, rest - (1 - drive.duty)), np.minimum(rest, drive.duty))]
    least, most = (np.asarray(time / (periods * drive.duty), dtype=float) for time in on)
    return least, most


def smallest(drive: Drive, shortest_s: float, longest_s: float) -> float:
    """The least light for any exposure of a range: at its ends, or where a dark interval has just been added."""
    return float(extremes(drive, _candidates(drive, shortest_s, longest_s, 1 - drive.duty))[0].min())


def largest(drive: Drive, shortest_s: float, longest_s: float) -> float:
    """The most light for any exposure of a range: at its ends, or where one more pulse just fits."""
    return float(extremes(drive, _candidates(drive, shortest_s, longest_s, drive.duty))[1].max())


def _candidates(drive: Drive, shortest_s: float, longest_s: float, rest: float) -> FloatArray:
    """Ends of a range of exposures, and the first ones in it that are whole periods and a rest of one."""
    times_s = (np.floor(shortest_s * drive.frequency_hz) + np.arange(3) + rest) / drive.frequency_hz
    return np.array([shortest_s, longest_s, *times_s[(times_s >= shortest_s) & (times_s <= longest_s)]])


def scales(setup: Setup, exposure_s: FloatArray, moments: FloatArray | None = None) -> FloatArray:
    """Light relative to its mean at the moments that are computed, ndarray[n_designs, n_moments].

    Behind a linear readout the two ends are the extremes. Behind one that clips the distance of two signals may be
    smallest at any moment between them. `moments`: from 0 (least light) to 1 (most), ndarray[n_moments], instead of
    those of the accuracy.
    """
    drive = setup.scene.drive
    if drive is None or not setup.computes("flicker"):
        return np.ones((len(exposure_s), 1))
    least, most = extremes(drive, exposure_s)
    share = np.linspace(0.0, 1.0, 2 if setup.linear else setup.accuracy.pwm_moments) if moments is None else moments
    return np.asarray(least[:, None] + share * (most - least)[:, None], dtype=float)
