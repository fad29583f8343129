"""Surrogate spectra of vehicle lamps, of lamps that no search has seen and of sign sheeting: modeled, not measured.

No open spectra of them exist. Each lies inside its regulation's color region, which `tests/spectra/test_tasks_data.py`
tests: lamps by their own light, sheeting under D65.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ...base.types import PerWavelength
from ..color import LAMP_REGIONS, REGIONS, SHEETING_REGIONS, ColorRegion
from ..spectrum import WavelengthGrid
from .led import led_photons
from .spectra import Card, gridded, spectrum_of
from .surrogate import BUILT_IN_RANGE_NM

_RISE = 4.394
"""ln 81: the 10 to 90 % width of a logistic edge over its decay length."""


@dataclass(frozen=True)
class LedShape:
    """LED by its peak and its decay toward blue and red, see `led_photons`."""

    peak_nm: float
    blue_nm: float
    red_nm: float

    def on(self, grid: WavelengthGrid) -> PerWavelength:
        """Return relative photons."""
        return led_photons(grid.nodes_nm, self.peak_nm, self.blue_nm, self.red_nm)


@dataclass(frozen=True)
class EdgeShape:
    """Curve that rises from `low` to `high` by a logistic edge with a 10 to 90 % width.

    It is a reflectance, or, `lit`, the light of a filament (illuminant A) behind a lens of that transmission.
    """

    low: float
    high: float
    middle_nm: float
    width_nm: float
    lit: bool = False

    def on(self, grid: WavelengthGrid) -> PerWavelength:
        """Return the reflectance, or the lens's relative photons."""
        edge = 1 / (1 + np.exp(-(grid.nodes_nm - self.middle_nm) * _RISE / self.width_nm))
        return _behind(grid, self.low + (self.high - self.low) * edge, lit=self.lit)


@dataclass(frozen=True)
class BandShape:
    """Curve with a Gaussian band, `width_nm` wide at half its height; see `EdgeShape`."""

    low: float
    high: float
    middle_nm: float
    width_nm: float
    lit: bool = False

    def on(self, grid: WavelengthGrid) -> PerWavelength:
        """Return the reflectance, or the lens's relative photons."""
        shape = np.exp(-4 * np.log(2) * ((grid.nodes_nm - self.middle_nm) / self.width_nm) ** 2)
        return _behind(grid, self.low + (self.high - self.low) * shape, lit=self.lit)


def _behind(grid: WavelengthGrid, curve: PerWavelength, *, lit: bool) -> PerWavelength:
    return curve * gridded(grid, spectrum_of("cie_illuminants", "A")) if lit else curve


StandIn = LedShape | EdgeShape | BandShape
SURROGATES: Mapping[str, tuple[StandIn, ...]] = {
    "brake red": (
        LedShape(620, 8, 6),
        LedShape(630, 8, 6),
        LedShape(640, 8, 6),
        EdgeShape(0.002, 0.85, 605, 25, lit=True),
    ),
    "turn amber": (
        LedShape(590, 7, 8),
        LedShape(593, 7, 8),
        LedShape(596, 7, 8),
        EdgeShape(0.002, 0.9, 552, 25, lit=True),
    ),
    "emergency blue": (LedShape(458, 7, 9), LedShape(464, 7, 9), LedShape(470, 7, 9)),
    "unseen green": (LedShape(497, 9, 15), LedShape(505, 9, 17), BandShape(0, 0.5, 503, 75, lit=True)),
    "unseen yellow": (LedShape(590, 7, 8), LedShape(597, 7, 8), EdgeShape(0.003, 0.9, 560, 25, lit=True)),
    "unseen red": (LedShape(627, 8, 6), LedShape(640, 8, 6), EdgeShape(0.002, 0.85, 614, 25, lit=True)),
    "white sheeting": (EdgeShape(0.1, 0.75, 410, 20), EdgeShape(0.3, 0.6, 420, 40)),
    "red sheeting": (EdgeShape(0.012, 0.5, 611, 25), EdgeShape(0.018, 0.45, 605, 22)),
    "orange sheeting": (EdgeShape(0.03, 0.62, 575, 35), EdgeShape(0.04, 0.55, 572, 40)),
    "yellow sheeting": (EdgeShape(0.045, 0.68, 526, 35), EdgeShape(0.06, 0.6, 524, 38)),
    "green sheeting": (BandShape(0.02, 0.22, 505, 60), BandShape(0.03, 0.2, 510, 70)),
    "blue sheeting": (BandShape(0.01, 0.2, 455, 70), BandShape(0.02, 0.25, 460, 70)),
}
"""Every group of surrogates, from the limits of lamps on the road to their middle."""


def region(group: str) -> ColorRegion:
    """Return the color region of a group by its regulation."""
    first, _, second = group.partition(" ")
    if second == "sheeting":
        return SHEETING_REGIONS[first]
    return REGIONS[second] if first == "unseen" else LAMP_REGIONS[second]


def is_sheeting(group: str) -> bool:
    """Return whether a group has surfaces.

    False for lamps.
    """
    return group.endswith("sheeting")


def surrogate_cards() -> list[Card]:
    """Return the cards of lamps and sheeting, with digests of the stated numbers."""
    cards = []
    for name, kind, source in (
        (
            "lamp_surrogates",
            "emission",
            "modeled: LEDs, and filaments behind lenses, inside the color regions of lamps",
        ),
        ("sheeting_surrogates", "reflectance", "modeled: a band or an edge, inside the color region of 23 CFR 655"),
    ):
        of_kind = {
            group: shapes for group, shapes in SURROGATES.items() if is_sheeting(group) == (kind == "reflectance")
        }
        sizes = {group: len(shapes) for group, shapes in of_kind.items()}
        stated = hashlib.sha256(repr(of_kind).encode()).hexdigest()
        thanks = "the authors of sweep"
        cards.append(Card(name, source, "MIT", thanks, kind, sizes, *BUILT_IN_RANGE_NM, stated, surrogate=True))
    return cards
