"""Facts of a file of curves, clean or not: kind of its curves, and possible repairs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ..base.errors import ValidationIssue
from ..base.types import PerSample, PerWavelength
from . import LightUnit
from .read_table import Scan
from .signal_color import VISIBLE, LightColor, light_color
from .spectrum import Unit, WavelengthGrid, photons_from_energy, resample

_NEEDED = WavelengthGrid()
_BROAD_NM = 70.0
"""Equivalent width (integral over peak) from which on a curve is rather a pixel's than an LED's."""
_COARSE_NM = 10.0
_FEWEST_IN_PEAK = 4
_PERCENT = 100.0
_MOST_LETTERS = 100
_NEARLY = 1e-6
NORMALIZED = (
    "the curves are relative (their maximum is 1, or their unit says so), and are taken as QE; electrons, noise, SNR "
    "and what a stated exposure gives are then those of a pixel with that QE; `scale` brings them to the pixel's own"
)
"""A note of curves that `is_normalized_response`."""
EACH_NORMALIZED = (
    "each channel has the same maximum, so the ratios between channels are lost; distances, also of any brightness, "
    "and light are then of a sensor whose channels are equally bright; curves of one scale bring the ratios back"
)
"""A note of several channels with equal tops."""


@dataclass(frozen=True)
class Curve:
    """Curve with its finite samples.

    `wavelength_nm`, `values`: samples, wavelengths increasing; n >= 0.
    """

    name: str
    wavelength_nm: PerWavelength
    values: PerWavelength
    unit: Unit = field(default_factory=Unit)

    @property
    def mean(self) -> float:
        """Mean from 400 to 700 nm, or where it has samples there; NaN without."""
        inside = (self.wavelength_nm >= _NEEDED.start_nm) & (self.wavelength_nm <= _NEEDED.stop_nm)
        wave, values = self.wavelength_nm[inside], self.values[inside]
        return float(np.trapezoid(values, wave) / np.ptp(wave)) if wave.size > 1 else float("nan")

    @property
    def peak(self) -> float:
        """Largest value; 0 without samples."""
        return float(self.values.max(initial=0.0))

    @property
    def peak_nm(self) -> float:
        """Wavelength of the largest value, nm."""
        return float(self.wavelength_nm[np.argmax(self.values)])

    def on(self, grid: WavelengthGrid) -> PerWavelength:
        """Return the curve over its largest value.

        0 where the curve is negative or has no samples.
        """
        if self.values.size < 2 or not self.peak > 0:
            return np.zeros(grid.size)
        return resample(self.wavelength_nm, np.clip(self.values / self.peak, 0, None), grid, "mean", "zero")

    def color(self, quantity: LightUnit) -> LightColor | None:
        """Return the color of the curve as a light of this quantity; None without visible light."""
        relative = self.on(VISIBLE)
        return light_color(photons_from_energy(VISIBLE.nodes_nm, relative) if quantity == "energy" else relative)

    @property
    def width_nm(self) -> float:
        """Equivalent width inside 400 to 700 nm: integral over peak; 0 for a curve that is 0 there."""
        inside = self.on(_NEEDED)
        return float(_NEEDED.integrate(inside) / inside.max()) if inside.max() > 0 else 0.0

    @property
    def samples_in_peak(self) -> int:
        """Consecutive samples around the largest value that are at least half of it."""
        low = np.flatnonzero(self.values < self.peak / 2)
        at = int(np.argmax(self.values))
        left, right = low[low < at], low[low > at]
        return int((right.min() if right.size else self.values.size) - (left.max() + 1 if left.size else 0))


@dataclass(frozen=True)
class Facts:
    """Curves of a file."""

    curves: tuple[Curve, ...]

    @property
    def samples_nm(self) -> PerSample:
        """Wavelengths at which any curve has a sample, nm."""
        return np.unique(np.concatenate([curve.wavelength_nm for curve in self.curves]))

    @property
    def is_likely_qe(self) -> bool:
        """True if heads say so, or if half of the curves are as broad as a pixel's and none exceeds 100 %."""
        lit = [curve for curve in self.curves if curve.peak > 0]
        told = {curve.unit.quantity for curve in lit} - {None}
        if told:
            return bool(told & {"qe", "responsivity", "relative_responsivity"})
        broad = sum(curve.width_nm >= _BROAD_NM for curve in lit)
        fits = 2 * broad >= len(lit) and max((curve.peak for curve in lit), default=0.0) <= _PERCENT
        return bool(lit) and fits

    def colors(self, quantity: LightUnit) -> Mapping[str, LightColor | None]:
        """Return the color of each curve read as a light."""
        return {curve.name: curve.color(quantity) for curve in self.curves}


def facts_of(scan: Scan) -> Facts:
    """Return the curves of a file with their usable samples."""
    cut = [name if len(name) <= _MOST_LETTERS else f"{name[: _MOST_LETTERS - 3]}..." for name in scan.names]
    # Nothing that steers a terminal or fills it; two names that then look the same stay two.
    shown: list[str] = []
    for at, name in enumerate(name if name.isprintable() else repr(name)[1:-1] for name in cut):
        shown.append(name if name and name not in shown else f"{name or 'column'} ({at + 2})")
    known = np.isfinite(scan.values)
    # What says nm, and is um, is refused; its picture is of what was meant.
    nm = scan.wavelength_nm * (1e3 if 0 < scan.wavelength_nm.max(initial=0.0) < 20 else 1.0)
    columns = zip(shown, known.T, scan.values.T, scan.units, strict=True)
    return Facts(tuple(Curve(name, nm[at], values[at], unit) for name, at, values, unit in columns))


def notes(facts: Facts, *, as_qe: bool) -> list[str]:
    """Return notes on readable curves."""
    lines = []
    wave = facts.samples_nm
    if wave.size and (wave[0] > _NEEDED.start_nm or wave[-1] < _NEEDED.stop_nm):
        lines.append(
            f"the wavelengths do not cover {_NEEDED.start_nm:g} to {_NEEDED.stop_nm:g} nm, a study's usual range: "
            + ("give the study `wavelengths:` of its own" if as_qe else "`outside: zero` takes 0 there")
        )
    gap = float(np.diff(wave).max(initial=0.0))
    if gap > _COARSE_NM:
        lines.append(f"sparse samples: up to {gap:g} nm apart; between them the curves are taken as straight lines")
    coarse = [c for c in facts.curves if c.peak > 0 and c.samples_in_peak < _FEWEST_IN_PEAK]
    if coarse:
        worst = min(coarse, key=lambda curve: curve.samples_in_peak)
        samples = "1 sample" if worst.samples_in_peak == 1 else f"{worst.samples_in_peak} samples"
        finding = f"only {samples} of half its height or more around its peak at {worst.peak_nm:g} nm"
        lines.append(
            f"{worst.name} has {finding}" + (f", and {len(coarse) - 1} more curves likewise" if coarse[1:] else "")
        )
    dark = [curve.name for curve in facts.curves if not curve.peak > 0]
    if dark:
        lines.append(f"no value is above 0: {', '.join(dark)}")
    if as_qe and is_normalized_response(max(curve.peak for curve in facts.curves)):
        lines.append(NORMALIZED)
    if as_qe and is_each_normalized([curve.peak for curve in facts.curves]):
        lines.append(EACH_NORMALIZED)
    return lines


def is_each_normalized(tops: Sequence[float]) -> bool:
    """Return whether several channels have one maximum."""
    return len(tops) > 1 and 0 < max(tops) <= min(tops) * (1 + _NEARLY)


def is_normalized_response(top: float) -> bool:
    """Return whether QE curves are relative responses: no pixel has a QE of just 1."""
    return abs(top - 1) <= _NEARLY


def merge_equal_issues(issues: Sequence[ValidationIssue]) -> list[ValidationIssue]:
    """Combine equal issues of many columns to one, with their number and the first place."""
    alike: dict[tuple[str, str | None], list[ValidationIssue]] = {}
    for issue in issues:
        alike.setdefault((issue.problem, issue.key), []).append(issue)
    by_place: dict[tuple[str, int | None, str], list[ValidationIssue]] = {}
    for (problem, _), group in alike.items():
        more = f"{problem}, and {len(group) - 1:,} more like it" if len(group) > 1 else problem
        by_place.setdefault((more, group[0].line, repr(group[0].value)), []).append(replace(group[0], problem=more))
    return [_joined(group) for group in by_place.values()]


def _joined(group: Sequence[ValidationIssue]) -> ValidationIssue:
    names = [issue.key or "" for issue in group]
    shown = ", ".join(names[:5]) + (f" and {len(names) - 5} more" if len(names) > 5 else "")
    return replace(group[0], key=shown or None)
