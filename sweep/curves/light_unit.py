"""What the numbers of a light's spectrum are."""

from typing import Literal

LightUnit = Literal["energy", "photons"]
