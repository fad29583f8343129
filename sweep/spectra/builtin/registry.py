"""Traffic light data sets that a study can name, collected from `data_sets`."""

from __future__ import annotations

from collections.abc import Callable

from ...base.modules import files_in
from ..lights import Lights
from ..spectrum import WavelengthGrid
from . import data_sets

BUILT_IN_LIGHTS: dict[str, Callable[[WavelengthGrid], Lights]] = {
    file.__name__.rpartition(".")[2]: file.lights for file in files_in(data_sets)
}
"""Data sets by their names; each is a function of the wavelength grid."""
ENDS: dict[str, Callable[[], tuple[float, float]]] = {
    file.__name__.rpartition(".")[2]: file.range_nm for file in files_in(data_sets) if hasattr(file, "range_nm")
}
"""Wavelengths of those that end, nm."""
