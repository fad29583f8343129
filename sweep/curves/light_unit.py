"""Quantities of a light's spectrum."""

from typing import Literal

LightUnit = Literal["energy", "photons"]
