"""Scenes that differ in one number: its name and unit, ranges of it in words, and quantities over it."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..base.types import Bool, BoolArray
from .words import inward, joined
from .words import number as number_of

if TYPE_CHECKING:
    import pandas as pd

_WIDE = 15.0
"""A ratio of numbers from which on an axis is logarithmic."""
_LOG, _EVEN = 4.0, 1.05
"""The same of numbers whose factors from one to the next differ by less than this."""
_LABELS = {
    "distance_m": ("distance", "m"),
    "exposure_s": ("exposure time", "s"),
    "visibility_m": ("visibility", "m"),
    "frequency_hz": ("frequency of the pulses", "Hz"),
    "duty": ("share of the time on", "share"),
    "intensity_cd": ("luminous intensity", "cd"),
    "read_noise_e": ("read noise", "e"),
    "dark_e_per_s": ("dark current", "e/s"),
    "cra_deg": ("chief ray angle", "degrees"),
    "cra_max_deg": ("chief ray angle in the corner", "degrees"),
    "level": ("exposure of the brightest channel on white", "share"),
    "f_number": ("f-number", ""),
    "bits": ("bit depth", "bits"),
    "pitch_um": ("pixel pitch", "µm"),
    "well_e": ("full well", "e"),
    "well_e_per_um2": ("full well per area", "e/µm²"),
    "crosstalk": ("crosstalk", "share"),
    "prnu": ("PRNU", "share"),
    "fill_factor": ("fill factor", "share"),
}


@dataclass(frozen=True)
class Numbers:
    """The numbers of the scenes of `base`, ascending."""

    base: str
    key: str
    x: tuple[float, ...]

    @property
    def name(self) -> str:
        """What the numbers are."""
        return _LABELS.get(self.key, (self.key.replace("_", " "), ""))[0]

    @property
    def unit(self) -> str:
        """Unit as the study states it."""
        return _LABELS.get(self.key, ("", ""))[1]

    @property
    def factor(self) -> float:
        """From the study's unit to that of an axis: seconds to milliseconds, shares to percent."""
        return {"s": 1e3, "share": 100.0}.get(self.unit, 1.0)

    @property
    def axis(self) -> str:
        """Name with the unit of an axis."""
        unit = {"s": "ms", "share": "%"}.get(self.unit, self.unit)
        return f"{self.name} / {unit}" if unit else self.name

    @property
    def drawn(self) -> tuple[float, ...]:
        """Numbers in the unit of an axis."""
        return tuple(self.factor * x for x in self.x)

    @property
    def log(self) -> bool:
        """Return whether the numbers span more than a decade, or grow by factors."""
        if min(self.x) <= 0 or len(self.x) < 2:
            return False
        factors = np.divide(self.x[1:], self.x[:-1])
        return max(self.x) / min(self.x) > (_LOG if factors.max() < _EVEN * factors.min() else _WIDE)

    def with_unit(self, number: float) -> str:
        """Return a number with its unit: `5.56 ms`, `10 %`."""
        unit = {"s": "ms", "share": "%"}.get(self.unit, self.unit)
        text = self.bare(number)
        return f"{text}\u00a0{unit}" if unit else text

    def bare(self, number: float) -> str:
        """Return a number in the unit of an axis, without it."""
        return number_of(self.factor * number)

    def at(self, place: int) -> str:
        """Return one of the numbers with its unit."""
        return self.with_unit(self.x[place])

    def span(self, start: int, stop: int) -> str:
        """Return a range of computed numbers in words."""
        first, last = start == 0, stop == len(self.x) - 1
        if first and last:
            return f"at every {self.name} from {self.at(0)} to {self.at(stop)}"
        if start == stop:
            return f"at {self.at(start)}"
        if first:
            return f"up to {self.at(stop)}"
        return f"from {self.at(start)} on" if last else f"from {self.at(start)} to {self.at(stop)}"

    def between(self, start: int, stop: int, low: float | None, high: float | None) -> str:
        """Return a range in words: refined ends, rounded inward, or computed numbers where none is known."""
        if low is None and high is None:
            return self.span(start, stop)
        first, last = start == 0, stop == len(self.x) - 1
        begin = self.at(start) if low is None else self.with_unit(inward(low, up=True, digits=2))
        end = self.at(stop) if high is None else self.with_unit(inward(high, up=False, digits=2))
        if first and low is None:
            return f"up to {end}"
        return f"from {begin} on" if last and high is None else f"from {begin} to {end}"

    def where(self, mask: Bool[BoolArray, " numbers"]) -> str:
        """Return the computed numbers at which something holds, in words."""
        runs = np.split(np.arange(mask.size), np.flatnonzero(np.diff(mask)) + 1)
        return joined([self.span(int(run[0]), int(run[-1])) for run in runs if mask[run[0]]])


def scene_in_words(scenario: str) -> str:
    """Return a scene's name with its number in words: `lamp at 139 Hz`."""

    def in_words(found: re.Match[str]) -> str:
        numbers = Numbers("", found[1], (float(found[2]),))
        return f" at {numbers.at(0)}" if numbers.unit else f" at {numbers.name} {numbers.at(0)}"

    return re.sub(r" (\w+)=(-?\d[\d.e+-]*)", in_words, scenario)


def over_series(rows: pd.DataFrame, scenarios: Mapping[str, float], column: str) -> dict[str, np.ndarray]:
    """Return a column over a series' numbers for every design with all of them."""
    names = list(scenarios)
    rows = rows[rows["scenario"].isin(names)].dropna(subset=["name"]).astype({"name": str, "scenario": str})
    designs = {str(name): part.set_index("scenario")[column] for name, part in rows.groupby("name", sort=False)}
    return {name: y.reindex(names).to_numpy(dtype=float) for name, y in designs.items() if len(y) == len(names)}
