"""Traffic light data sets: spectra with their signal types."""

from __future__ import annotations

from collections.abc import Callable

from ..lights import Lights
from ..spectrum import WavelengthGrid
from .surrogate import surrogate_parameters
from .tl16 import tl16

BUILT_IN_LIGHTS: dict[str, Callable[[WavelengthGrid], Lights]] = {
    "tl16": lambda grid: tl16(grid, surrogate_parameters())
}
"""Data sets that a study can name; each is a function of the wavelength grid."""
