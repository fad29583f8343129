"""Lights on the wavelength grid, grouped into signal types."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np

from ..base.types import Array, Float, MemberNumbers, PerWavelength
from .population import Population
from .spectrum import WavelengthGrid, equal_photons

Pair = tuple[str, str]
"""Two signal types."""


_COLORS = ("green", "yellow", "orange", "red")


def class_pairs(classes: Sequence[str]) -> tuple[Pair, ...]:
    """Return all unordered pairs of signal types."""
    return tuple(combinations(classes, 2))


def in_order(types: Iterable[str]) -> list[str]:
    """Return signal types in the order in which columns name them: colors of signals, then others by name."""
    return sorted(types, key=lambda kind: (_COLORS.index(kind) if kind in _COLORS else len(_COLORS), kind))


def pair_name(what: str, pair: Pair) -> str:
    """Return the column name of a pair: `what_a_b`."""
    return f"{what}_{pair[0]}_{pair[1]}"


@dataclass(frozen=True)
class Lights:
    """Signals with equal photon counts.

    `photons`: spectra that integrate to 1; `photon_ratio`: photons of a signal patch over those of the white patch (K);
    `surrogate`: True for modeled spectra.
    """

    name: str
    names: tuple[str, ...]
    types: tuple[str, ...]
    photons: Float[Array, "signals wavelengths"]
    photon_ratio: float
    source: str
    surrogate: bool
    population: Population | None = None

    @cached_property
    def classes(self) -> tuple[str, ...]:
        """Distinct signal types, in order."""
        return tuple(dict.fromkeys(self.types))

    @cached_property
    def members(self) -> dict[str, MemberNumbers]:
        """Indices of the signals of each type."""
        types = np.asarray(self.types)
        return {name: np.flatnonzero(types == name) for name in self.classes}


def peak_normalized_ratio(grid: WavelengthGrid, photons: Float[Array, "signals wavelengths"]) -> float:
    """Return K for peak-normalized spectra, the median over the signals.

    Photons of a spectrum with peak 1 over those of a flat white of height 1 on the same grid: equivalent bandwidth
    over the span of the grid.
    """
    peak_one = photons / photons.max(axis=1, keepdims=True)
    return float(np.median(grid.integrate(peak_one))) / grid.span_nm


def make_lights(
    grid: WavelengthGrid,
    name: str,
    signals: list[tuple[str, str, PerWavelength]],
    source: str,
    *,
    photon_ratio: float | None = None,
    surrogate: bool = False,
) -> Lights:
    """Group photon spectra into a data set with equal photon counts, type by type in the order of `in_order`.

    `photon_ratio`: K; left out, that of peak-normalized spectra; `surrogate`: True for modeled spectra. Raises
    DataError if a light has no photons on the grid.
    """
    types_in_order = in_order({kind for _, kind, _ in signals})
    signals = sorted(signals, key=lambda signal: types_in_order.index(signal[1]))
    photons = equal_photons(grid, np.stack([spectrum for _, _, spectrum in signals]))
    ratio = peak_normalized_ratio(grid, photons) if photon_ratio is None else photon_ratio
    names, types = tuple(n for n, _, _ in signals), tuple(t for _, t, _ in signals)
    return Lights(name, names, types, photons, ratio, source, surrogate)
