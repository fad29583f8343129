"""Lights on the wavelength grid, grouped into signal types."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from ..base.types import FloatArray, IndexArray
from .population import Population
from .spectrum import WavelengthGrid, equal_photons

Pair = tuple[str, str]
"""Two signal types."""


def class_pairs(classes: Sequence[str]) -> tuple[Pair, ...]:
    """Return all unordered pairs of signal types, in the order of `classes`."""
    return tuple(combinations(classes, 2))


def pair_name(what: str, pair: Pair) -> str:
    """Return the name of something measured of a pair: `what_a_b`."""
    return f"{what}_{pair[0]}_{pair[1]}"


@dataclass(frozen=True)
class Lights:
    """Signals with equal photon counts.

    `photons`: ndarray[n_signals, n_wavelengths], each integrates to 1. `types`: signal type of each, grouped in the
    order of `classes`. `photon_ratio`: K, the photons of a signal patch over those of the white patch. `population`:
    the lamps that they stand for, where a study asks for worst cases over these.
    """

    name: str
    names: tuple[str, ...]
    types: tuple[str, ...]
    photons: FloatArray
    photon_ratio: float
    source: str
    surrogate: bool
    population: Population | None = None

    @property
    def classes(self) -> tuple[str, ...]:
        """The distinct signal types, in order."""
        return tuple(dict.fromkeys(self.types))

    @property
    def members(self) -> dict[str, IndexArray]:
        """Signal type -> indices of its signals."""
        types = np.asarray(self.types)
        return {name: np.flatnonzero(types == name) for name in self.classes}


def peak_normalized_ratio(grid: WavelengthGrid, photons: FloatArray) -> float:
    """Return K for spectra normalized to their peaks, as the median over the signals.

    The photons of a spectrum with peak 1 over those of a flat white of height 1 on the same grid: equivalent
    bandwidth / grid span. `photons`: ndarray[n_signals, n_wavelengths], in any scale.
    """
    peak_one = photons / photons.max(axis=1, keepdims=True)
    return float(np.median(grid.integrate(peak_one))) / (grid.size * grid.step_nm)


def make_lights(
    grid: WavelengthGrid,
    name: str,
    signals: list[tuple[str, str, FloatArray]],
    source: str,
    *,
    photon_ratio: float | None = None,
    surrogate: bool = False,
) -> Lights:
    """Group (name, type, photon spectrum on the grid) into a data set with equal photon counts.

    Raises DataError when a light has no photons on the grid.
    """
    photons = equal_photons(grid, np.stack([spectrum for _, _, spectrum in signals]))
    ratio = peak_normalized_ratio(grid, photons) if photon_ratio is None else photon_ratio
    names, types = tuple(n for n, _, _ in signals), tuple(t for _, t, _ in signals)
    return Lights(name, names, types, photons, ratio, source, surrogate)
