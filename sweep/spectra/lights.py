"""Lights on the wavelength grid, grouped into signal types."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from ..base.types import Array, Float, MemberNumbers, PerWavelength
from .population import Population
from .spectrum import WavelengthGrid, equal_photons

Pair = tuple[str, str]
"""Two signal types."""


def class_pairs(classes: Sequence[str]) -> tuple[Pair, ...]:
    """Return all unordered pairs of signal types.

    Parameters
    ----------
    classes : sequence of str
        Signal types.

    Returns
    -------
    tuple of pair
        Pairs in the order of the types.
    """
    return tuple(combinations(classes, 2))


def pair_name(what: str, pair: Pair) -> str:
    """Return the column name of a pair: `what_a_b`.

    Parameters
    ----------
    what : str
        Metric.
    pair : tuple of str
        Signal types.

    Returns
    -------
    str
        Text.
    """
    return f"{what}_{pair[0]}_{pair[1]}"


@dataclass(frozen=True)
class Lights:
    """Signals with equal photon counts.

    Parameters
    ----------
    name : str
        Data set.
    names, types : tuple of str
        Name and signal type of each signal, grouped by type.
    photons : ndarray of shape (n_signals, n_wavelengths)
        Spectra that integrate to 1.
    photon_ratio : float
        Photons of a signal patch over those of the white patch (K).
    source : str
        Source.
    surrogate : bool
        True for modeled spectra.
    population : Population, optional
        Lamps that they stand for.
    """

    name: str
    names: tuple[str, ...]
    types: tuple[str, ...]
    photons: Float[Array, "signals wavelengths"]
    photon_ratio: float
    source: str
    surrogate: bool
    population: Population | None = None

    @property
    def classes(self) -> tuple[str, ...]:
        """Distinct signal types, in order."""
        return tuple(dict.fromkeys(self.types))

    @property
    def members(self) -> dict[str, MemberNumbers]:
        """Indices of the signals of each type."""
        types = np.asarray(self.types)
        return {name: np.flatnonzero(types == name) for name in self.classes}


def peak_normalized_ratio(grid: WavelengthGrid, photons: Float[Array, "signals wavelengths"]) -> float:
    """Return K for peak-normalized spectra, the median over the signals.

    Photons of a spectrum with peak 1 over those of a flat white of height 1 on the same grid: equivalent bandwidth
    over the span of the grid.

    Parameters
    ----------
    grid : WavelengthGrid
        Wavelengths, nm.
    photons : ndarray of shape (n_signals, n_wavelengths)
        Spectra in any scale.

    Returns
    -------
    float
        K.
    """
    peak_one = photons / photons.max(axis=1, keepdims=True)
    return float(np.median(grid.integrate(peak_one))) / (grid.size * grid.step_nm)


def make_lights(
    grid: WavelengthGrid,
    name: str,
    signals: list[tuple[str, str, PerWavelength]],
    source: str,
    *,
    photon_ratio: float | None = None,
    surrogate: bool = False,
) -> Lights:
    """Group photon spectra into a data set with equal photon counts.

    Parameters
    ----------
    grid : WavelengthGrid
        Wavelengths, nm.
    name : str
        Data set.
    signals : list of (name, type, ndarray of shape (n_wavelengths,))
        Spectra.
    source : str
        Source.
    photon_ratio : float, optional
        K; left out, that of peak-normalized spectra.
    surrogate : bool
        True for modeled spectra.

    Returns
    -------
    Lights
        Lights.

    Raises
    ------
    DataError
        If a light has no photons on the grid.
    """
    photons = equal_photons(grid, np.stack([spectrum for _, _, spectrum in signals]))
    ratio = peak_normalized_ratio(grid, photons) if photon_ratio is None else photon_ratio
    names, types = tuple(n for n, _, _ in signals), tuple(t for _, t, _ in signals)
    return Lights(name, names, types, photons, ratio, source, surrogate)
