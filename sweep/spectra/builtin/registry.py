"""Traffic light data sets that a study can name, collected from `data_sets`."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from ...base.modules import files_in
from ..lights import Lights
from ..spectrum import WavelengthGrid
from . import data_sets
from .data_sets.tl16 import tl16_of_fit
from .surrogate import FITS

BUILT_IN_LIGHTS: dict[str, Callable[[WavelengthGrid], Lights]] = {
    file.__name__.rpartition(".")[2]: file.lights for file in files_in(data_sets)
} | {f"tl16@{number}": partial(tl16_of_fit, number) for number in range(1, FITS + 1)}
"""Data sets by their names; each is a function of the wavelength grid."""
_ENDS = {file.__name__.rpartition(".")[2]: file.range_nm for file in files_in(data_sets) if hasattr(file, "range_nm")}
ENDS: dict[str, Callable[[], tuple[float, float]]] = {
    name: _ENDS[name.partition("@")[0]] for name in BUILT_IN_LIGHTS if name.partition("@")[0] in _ENDS
}
"""Wavelengths of those that end, nm."""
