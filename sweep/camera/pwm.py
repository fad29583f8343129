"""Light of a pulsed LED in an exposure, which depends on the starting time of the exposure."""

from __future__ import annotations

import numpy as np

from ..base.types import Array, Float, PerDesign, PerValue
from .scene import PwmDrive
from .setup import Setup


def extremes(drive: PwmDrive, exposure_s: PerDesign) -> tuple[PerDesign, PerDesign]:
    """Return the least and most light in an exposure relative to the mean, over all starting times.

    The light is on for `duty` of each period, 1 / duty as bright as its mean. In n whole periods and a rest r it is on
    for n duty and, in the rest, for max(0, r - (1 - duty)) to min(r, duty).
    """
    periods = exposure_s * drive.frequency_hz
    whole_periods = np.floor(periods)
    rest = periods - whole_periods
    on = [
        whole_periods * drive.duty + part
        for part in (np.maximum(0, rest - (1 - drive.duty)), np.minimum(rest, drive.duty))
    ]
    least, most = (np.asarray(time / (periods * drive.duty), dtype=float) for time in on)
    return least, most


def smallest(drive: PwmDrive, shortest_s: float, longest_s: float) -> float:
    """Return the least relative light of any exposure in a range: at its ends, or where a dark interval was just added.

    Returns light relative to its mean.
    """
    return float(extremes(drive, _candidates(drive, shortest_s, longest_s, 1 - drive.duty))[0].min())


def largest(drive: PwmDrive, shortest_s: float, longest_s: float) -> float:
    """Return the most relative light of any exposure in a range: at its ends, or where one more pulse just fits.

    Returns light relative to its mean.
    """
    return float(extremes(drive, _candidates(drive, shortest_s, longest_s, drive.duty))[1].max())


def _candidates(drive: PwmDrive, shortest_s: float, longest_s: float, rest: float) -> Float[Array, " candidates"]:
    """Return the ends of a range of exposures, and the first exposures in it of whole periods and a rest."""
    times_s = (np.floor(shortest_s * drive.frequency_hz) + np.arange(3) + rest) / drive.frequency_hz
    return np.array([shortest_s, longest_s, *times_s[(times_s >= shortest_s) & (times_s <= longest_s)]])


def on_time(drive: PwmDrive, periods: Float[Array, " *batch"] | float) -> Float[Array, " ..."]:
    """Return how long the light has been on since it was switched on, at the start of a period."""
    whole_periods = np.floor(periods)
    return np.asarray(whole_periods * drive.duty + np.minimum(periods - whole_periods, drive.duty), dtype=float)


def light_in(
    drive: PwmDrive, start: Float[Array, " *batch"] | float, length: Float[Array, " ..."]
) -> Float[Array, " ..."]:
    """Return the light in an exposure relative to its mean.

    `start`: start of the exposure after the start of a pulse, periods; `length`: exposure time, periods.
    """
    return np.asarray((on_time(drive, start + length) - on_time(drive, start)) / (length * drive.duty), dtype=float)


def _windows(
    setup: Setup, exposure_s: PerValue
) -> tuple[Float[Array, "windows values"], Float[Array, "windows values"]]:
    """Return start and length of each exposure of an HDR pixel, periods."""
    drive = setup.scene.drive
    assert drive is not None
    captures = [exposure.capture for exposure in setup.camera.pixel.exposures]
    periods = exposure_s * drive.frequency_hz
    starts, lengths = ([getattr(capture, name) for capture in captures] for name in ("start_ratio", "exposure_ratio"))
    return np.array(starts)[:, None] * periods, np.array(lengths)[:, None] * periods


def phases_of(setup: Setup, exposure_s: PerDesign, between: int) -> Float[Array, "designs phases"]:
    """Return phases of a pulse: those at which an exposure begins or ends with a pulse, and some between them.

    The light in each exposure is linear between two such phases, so that its extremes are at them.

    `setup`: drive and HDR pixel. Returns start of the first exposure after the start of a pulse, periods, ascending.
    """
    drive = setup.scene.drive
    assert drive is not None
    starts, lengths = _windows(setup, exposure_s)
    ends = np.stack([starts, starts + lengths])[None] - np.array([0.0, drive.duty])[:, None, None, None]
    corners = np.sort(np.mod(-ends, 1.0).reshape(-1, starts.shape[1]), axis=0)
    gaps = np.diff(np.concatenate([corners, corners[:1] + 1.0]), axis=0)
    steps = np.arange(between + 1) / (between + 1)
    return np.asarray((corners[:, None] + gaps[:, None] * steps[:, None]).reshape(-1, starts.shape[1]).T, dtype=float)


def exposure_scales(
    setup: Setup, exposure_s: PerDesign, phases: Float[Array, "designs phases"]
) -> Float[Array, "exposures designs phases"]:
    """Return the light in each exposure of an HDR pixel relative to its mean, at phases of the pulse.

    `setup`: drive and pixel; `phases`: start of the first exposure after the start of a pulse, periods.
    """
    drive = setup.scene.drive
    assert drive is not None
    starts, lengths = _windows(setup, exposure_s)
    return light_in(drive, phases + starts[:, :, None], lengths[:, :, None])
