"""Flicker of a pulsed LED: how much of its light falls into an exposure depends on when the exposure starts."""

from __future__ import annotations

import numpy as np

from ...base.types import FloatArray
from ..scene import Drive, FixedExposure
from ..shot import Shot
from .base import Change, Chosen, Designs, LinearEffect, Load, ShareChange, Stage

_FINE = 9


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


def scales(shot: Shot, method: str, exposure_s: FloatArray) -> FloatArray:
    """Light relative to the mean in the cases that are looked at, ndarray[n_designs, n_cases]."""
    drive = shot.scenario.drive
    if method == "skip" or drive is None:
        return np.ones((len(exposure_s), 1))
    least, most = extremes(drive, exposure_s)
    share = np.linspace(0.0, 1.0, 2 if method == "ends" else _FINE)
    return np.asarray(least[:, None] + share * (most - least)[:, None], dtype=float)


def goes_dark(shot: Shot) -> bool:
    """Whether a scene's fixed exposure may fall between two pulses."""
    drive, exposure = shot.scenario.drive, shot.scenario.exposure
    if drive is None or not isinstance(exposure, FixedExposure):
        return False
    return smallest(drive, exposure.exposure_s, exposure.exposure_s) == 0


def missed(method: str, least: float, most: float, *, straight: bool) -> float:
    """What a method misses of the light, relative to the `most` light of a pulsed exposure; `least` as `smallest`."""
    below, above = 1 - least, most - 1
    if method == "ends":
        return 0.0 if straight else (below + above) / 2 / most
    return (below if straight else max(below, above)) / most


class Flicker(LinearEffect):
    """A pulse's share of the exposure, of each signal alike."""

    name = "flicker"
    methods = ("skip", "ends", "fine")
    stage = Stage.OPTICS
    order = 4

    def exact(self, shot: Shot) -> str | None:
        """Only a pulsed light flickers."""
        drive = shot.scenario.drive
        return "direct current" if drive is None or drive.duty == 1 else None

    def change(self, shot: Shot, before: str, after: str, designs: Designs, *, straight: bool) -> Change:
        """What the moments that are left out would have shown of the light."""
        lost = missed(after, designs.least_light, designs.most_light, straight=straight)
        return ShareChange(lost, of_background=False)

    def work(self, shot: Shot, methods: Chosen, load: Load) -> Load:
        """Every moment is read."""
        return load._replace(scales=scales(shot, methods.flicker, np.ones(1)).shape[1])
