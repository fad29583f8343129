"""Light in the exposures of a pixel, relative to its mean: steady, or of a pulsed lamp, at any moment."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..base.types import Array, Float, IndexArray, Int, PerDesign
from . import pwm
from .axis import Axis
from .setup import Setup

_FINER, _ROUNDS, _ROUNDS_FINER = 8, 3, 4
"""Factor by which moments of a pulse are finer at one place; rounds around the worst, each so many times finer."""
_DIGITS = 12
Scales = Float[Array, "exposures designs moments"]
Moments = Float[Array, " moments"]


@dataclass(frozen=True)
class Steady:
    """The same light at any moment; `bends`: a value may be worst at any moment between those that are computed."""

    n_exposures: int
    bends = False

    def scales(self, exposure_s: PerDesign, moments: Moments | None = None) -> Scales:  # noqa: ARG002
        """Return the light of each exposure."""
        return np.ones((self.n_exposures, exposure_s.size, 1))


@dataclass(frozen=True)
class Pulsed:
    """A pulse in one exposure; a moment is a number from 0, with least light, to 1, with most.

    Behind a linear readout extremes are at both ends. Behind another one the distance of two signals may be smallest at
    any moment; of whole numbers only where they may clip, too, and the worst places are refined.
    """

    setup: Setup
    bends: bool

    def scales(self, exposure_s: PerDesign, moments: Moments | None = None) -> Scales:
        """Return the light at moments, or at those of the accuracy."""
        assert self.setup.scene.drive is not None
        least, most = pwm.extremes(self.setup.scene.drive, exposure_s)
        if moments is None:
            moments = np.linspace(0.0, 1.0, 2 if self.setup.linear else self.setup.accuracy.pwm_moments)
        return np.asarray(least[:, None] + moments * (most - least)[:, None], dtype=float)[None]

    def axis(self, exposure_s: float) -> Axis:  # noqa: ARG002
        """Return the moments among which the worst one is sought."""
        return Axis.along(np.linspace(0.0, 1.0, self.finer + 1), _ROUNDS, _ROUNDS_FINER)

    @property
    def finer(self) -> int:
        """Steps between moments among which the worst one is sought."""
        return _FINER * (self.setup.accuracy.pwm_moments - 1)


class PulsedExposures(Pulsed):
    """A pulse in several exposures; a moment is a phase, at which the first of them starts, in periods."""

    def scales(self, exposure_s: PerDesign, moments: Moments | None = None) -> Scales:
        """Return the light at phases, or once for each that differs between two at which an exposure begins or ends."""
        if moments is not None:
            phases = np.broadcast_to(moments, (exposure_s.size, moments.size))
            return pwm.exposure_scales(self.setup, exposure_s, phases)
        phases = pwm.phases_of(self.setup, exposure_s, self.setup.accuracy.pwm_moments - 2)
        scales = pwm.exposure_scales(self.setup, exposure_s, phases)
        return scales[..., np.sort(different(scales)[0])]

    def axis(self, exposure_s: float) -> Axis:
        """Return the phases among which the worst one is sought."""
        return Axis.along(pwm.phases_of(self.setup, np.array([exposure_s]), self.finer)[0], _ROUNDS, _ROUNDS_FINER)


Light = Steady | Pulsed


def light_of(setup: Setup) -> Light:
    """Return the light of a scene in the exposures of its pixel."""
    if setup.scene.drive is None or not setup.computes("flicker"):
        return Steady(len(setup.camera.pixel.exposures) if setup.camera.pixel.captures else 1)
    clips = setup.computes("saturation") and setup.accuracy.finest_phase_px > 0
    rounds = setup.scene.noise is None and setup.computes("quantization")
    bends = not setup.linear and (not rounds or clips)
    return (PulsedExposures if setup.camera.pixel.captures else Pulsed)(setup, bends)


def different(scales: Scales) -> tuple[Int[IndexArray, " different"], Int[IndexArray, " moments"]]:
    """Return the first moment of each light in all designs and exposures, and which of these each moment has."""
    flat = np.round(scales.reshape(-1, scales.shape[-1]), _DIGITS)
    _, first, which = np.unique(flat, axis=1, return_index=True, return_inverse=True)
    return first, which.ravel()


def alike(scales: Float[Array, "exposures 1 moments"]) -> list[tuple[list[int], list[float]]]:
    """Return groups of moments whose light differs by one factor in all exposures: brightest first, and the factors."""
    columns = scales.reshape(-1, scales.shape[-1])
    most = columns.max(axis=0)
    kinds = np.round(columns / np.maximum(most, 1e-300), _DIGITS).T.tolist()
    groups: dict[tuple[float, ...], list[int]] = {}
    for moment in np.argsort(-most, kind="stable").tolist():
        lit = most[moment] > 0 or not groups
        groups.setdefault(tuple(kinds[moment]) if lit else next(iter(groups)), []).append(moment)
    return [(numbers, (most[numbers] / (most[numbers[0]] or 1.0)).tolist()) for numbers in groups.values()]
