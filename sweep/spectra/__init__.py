"""Spectra and curves over wavelength: sampled, read from files, written, colored, built in."""

from typing import Literal

LightUnit = Literal["energy", "photons"]
"""Quantities of a light's spectrum."""
