"""Curves over wavelength: sampled, read from any file, written, colored, built in."""

from typing import Literal

LightUnit = Literal["energy", "photons"]
"""Quantities of a light's spectrum."""
