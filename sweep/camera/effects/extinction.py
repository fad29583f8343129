"""Extinction by haze and fog: the light that is scattered out of the line of sight."""

from __future__ import annotations

import math

import numpy as np

from ...base.types import FloatArray, Meters
from ..scene import Scene
from ..shot import Shot
from .base import LightEffect, SceneOptions

_REFERENCE_NM = 550.0
_CONTRAST = 0.02


def size_exponent(visibility_m: float) -> float:
    """Exponent q of the wavelength in extinction (Kim, McArthur, Korevaar 2001): 0 in dense fog, 1.6 in clear air."""
    km = visibility_m / 1000
    if km < 0.5:
        return 0.0
    if km < 1:
        return km - 0.5
    if km < 6:
        return 0.16 * km + 0.34
    return 1.3 if km < 50 else 1.6


class Options(SceneOptions):
    """`visibility_m`: the distance at which the air leaves 2 % (Koschmieder's meteorological range)."""

    visibility_m: Meters | None = None


class Extinction(LightEffect):
    """It dims a target, and not the background, which is nearer."""

    name = "extinction"
    methods = ("skip", "gray", "spectral")
    order = 3
    Options = Options
    dims_background = False

    def exact(self, shot: Shot) -> str | None:
        """Nothing is scattered in clear air."""
        return "clear air" if Options.of(shot.scenario).visibility_m is None else None

    def refused(self, scene: Scene) -> str | None:
        """The way through the air is that to a target."""
        missing = Options.of(scene).visibility_m is not None and scene.target is None
        return "visibility_m needs a target with a distance" if missing else None

    def transmittance(self, shot: Shot, method: str, wavelength_nm: FloatArray) -> FloatArray:
        """exp(-beta D), ndarray[n_wavelengths]; beta = ln(1 / 0.02) / visibility (lambda / 550 nm)^-q (Koschmieder)."""
        visibility_m, target = Options.of(shot.scenario).visibility_m, shot.scenario.target
        if method == "skip" or visibility_m is None or target is None:
            return np.ones(wavelength_nm.size)
        exponent = size_exponent(visibility_m) if method == "spectral" else 0.0
        per_m = -math.log(_CONTRAST) / visibility_m * (wavelength_nm / _REFERENCE_NM) ** -exponent
        return np.asarray(np.exp(-per_m * target.distance_m), dtype=float)
