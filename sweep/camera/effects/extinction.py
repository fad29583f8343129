"""Extinction by haze and fog: the light that is scattered out of the line of sight."""

from __future__ import annotations

import math

import numpy as np

from ...types import FloatArray
from ..view import Setup

METHODS = ("skip", "gray", "spectral")
_REFERENCE_NM = 550.0
_CONTRAST = 0.02


def skip_is_exact(setup: Setup) -> str | None:
    """Why leaving it out changes nothing; None when it does."""
    return "clear air" if setup.scenario.visibility_m is None else None


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


def transmittance(setup: Setup, method: str, wavelength_nm: FloatArray) -> FloatArray:
    """exp(-beta D), ndarray[n_wavelengths]; beta = ln(1 / 0.02) / visibility (lambda / 550 nm)^-q (Koschmieder)."""
    scenario = setup.scenario
    if method == "skip" or scenario.visibility_m is None or scenario.target is None:
        return np.ones(wavelength_nm.size)
    exponent = size_exponent(scenario.visibility_m) if method == "spectral" else 0.0
    per_m = -math.log(_CONTRAST) / scenario.visibility_m * (wavelength_nm / _REFERENCE_NM) ** -exponent
    return np.asarray(np.exp(-per_m * scenario.target.distance_m), dtype=float)
