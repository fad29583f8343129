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
    """The least light for any exposure from `shortest_s` to `longest_s`.

    It is smallest where a dark interval has just been added: at the ends or where r = 1 - duty.
    """
    first = np.floor(shortest_s * drive.frequency_hz)
    candidates = (first + np.arange(3) + 1 - drive.duty) / drive.frequency_hz
    inside = candidates[(candidates >= shortest_s) & (candidates <= longest_s)]
    return float(extremes(drive, np.array([shortest_s, longest_s, *inside]))[0].min())


def largest(drive: Drive, shortest_s: float, longest_s: float) -> float:
    """The most light for any exposure in a range: at its ends or where one more pulse just fits, r = duty."""
    first = np.floor(shortest_s * drive.frequency_hz)
    candidates = (first + np.arange(3) + drive.duty) / drive.frequency_hz
    inside = candidates[(candidates >= shortest_s) & (candidates <= longest_s)]
    return float(extremes(drive, np.array([shortest_s, longest_s, *inside]))[1].max())


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
