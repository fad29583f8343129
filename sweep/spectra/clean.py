"""Samples of a curve, cleaned of what has one meaning: order, repeated wavelengths, gaps of one, noise below 0."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ..base.errors import ValidationIssue
from ..base.types import Array, Float, IndexArray, PerSample

_NOISE_SHARE = 0.02
"""Negatives up to this share of a curve's largest value are noise around 0."""
_ALIKE_SHARE = 0.05
"""Repeated samples that are mostly farther apart, relative to the peak, are of two spectra."""


_FEWEST_STACKED, _MOSTLY = 5, 0.9
"""Samples of one of several spectra in a column, and their share of all: rows in no order have short runs."""


def several(names: Sequence[str]) -> str:
    """Return up to five names, and how many more there are; with nothing that steers a terminal."""
    text = f"{', '.join(names[:5])}{f' and {len(names) - 5} more' if names[5:] else ''}"
    return text if text.isprintable() else repr(text)[1:-1]


@dataclass
class Cleaner:
    """Repairs that have one meaning, with a note for each; adds an issue for anything else."""

    file: str
    issues: list[ValidationIssue]
    _said: dict[str, list[str]] = field(default_factory=dict)

    @property
    def notes(self) -> list[str]:
        """What was done, each with the curves that it was done to."""
        return [f"{several(names)}: {note}" if names[0] else note for note, names in self._said.items()]

    def _note(self, name: str, note: str) -> None:
        self._said.setdefault(note, []).append(name)

    def _fault(self, name: str, problem: str, value: object, allowed: str) -> None:
        self.issues.append(ValidationIssue(problem, self.file, None, name, value, allowed))

    def cleaned(
        self, name: str, wave: PerSample, values: PerSample, *, noise: float, faulty: bool
    ) -> tuple[Float[Array, " kept"], Float[Array, " kept"]]:
        """Return samples in rising order, each wavelength once, without gaps and without negatives.

        `noise`: negatives down to so much are noise in any case; none is set to 0 if it is infinite. `faulty`: of
        samples with issues already, so that what follows from these is none.
        """
        known = np.isfinite(wave)
        order = np.flatnonzero(known)[np.argsort(wave[known], kind="stable")]
        steps = np.diff(wave[known])
        if not faulty:
            self._refuse_stacked(name, wave[known])
        if (steps < 0).all() and steps.size:
            self._note("", "falling wavelengths were turned round")
        elif (steps < 0).any():
            self._note("", "rows were sorted by wavelength")
        wave, values = wave[order], values[order].copy()
        if faulty:
            wave, values = wave[np.isfinite(values)], values[np.isfinite(values)]
        wave, values = self._averaged(name, wave, values)
        wave, values = self._without_gaps(name, wave, values)
        low = values < 0
        if low.any() and np.isfinite(noise):
            if -values.min() <= max(_NOISE_SHARE * values.max(), noise):
                lowest, whole = values.min(), np.trapezoid(values, wave)
                values[low] = 0.0
                added = f"{np.trapezoid(values, wave) / whole - 1:.1%}" if whole > 0 else "all"
                done = f"negatives of noise, down to {lowest:.3g}, were set to 0"
                self._note(name, f"{done}, which adds {added} to its sum")
            elif not faulty:
                at = int(np.argmin(values))
                allowed = ">= 0, or noise of up to 2 % of the peak"
                self._fault(name, f"negative value at {wave[at]:g} nm", float(values[at]), allowed)
        return wave, values

    def _refuse_stacked(self, name: str, wave: PerSample) -> None:
        """Add an issue for spectra one below the other: wavelengths that begin again and go over most of them."""
        steps = np.diff(wave)
        falls = steps < 0 if np.count_nonzero(steps > 0) >= np.count_nonzero(steps < 0) else steps > 0
        runs = np.split(wave, 1 + np.flatnonzero(falls))
        most = [run for run in runs if run.size >= _FEWEST_STACKED and np.ptp(run) > np.ptp(wave) / 2]
        if len(most) > 1 and sum(run.size for run in most) > _MOSTLY * wave.size:
            at = float(most[1][0])
            self._fault(name, "wavelengths begin again: several spectra?", at, "one spectrum in a column")

    def _averaged(
        self, name: str, wave: PerSample, values: PerSample
    ) -> tuple[Float[Array, " kept"], Float[Array, " kept"]]:
        """Average samples at one wavelength; two spectra one after the other are an issue."""
        unique, first, counts = np.unique(wave, return_index=True, return_counts=True)
        if unique.size == wave.size:
            return wave, values
        with np.errstate(invalid="ignore"):
            known = np.isfinite(values)
            index = np.repeat(np.arange(unique.size), counts)
            total, number = (np.bincount(index[known], weights, unique.size) for weights in (values[known], None))
            mean = np.divide(total, number, out=np.full(unique.size, np.nan), where=number > 0)
            spread = np.maximum.reduceat(np.where(known, np.abs(values - mean[index]), 0.0), first)
        contradicting = (counts > 1) & (spread > _ALIKE_SHARE / 2 * np.nanmax(np.abs(values), initial=0.0))
        if 4 * np.count_nonzero(contradicting) > unique.size:
            at = float(unique[np.argmax(contradicting)])
            self._fault(name, "wavelengths occur twice, with other values", at, "one spectrum in a column")
        repeated = int(np.count_nonzero(counts > 1))
        self._note(
            "", f"samples at the same wavelength were averaged, at {repeated} wavelength{'s' if repeated > 1 else ''}"
        )
        return unique, mean

    def _without_gaps(
        self, name: str, wave: PerSample, values: PerSample
    ) -> tuple[Float[Array, " kept"], Float[Array, " kept"]]:
        """Drop missing values at the ends, and fill one between two samples by a straight line."""
        known: IndexArray = np.flatnonzero(np.isfinite(values))
        if known.size == values.size or not known.size:
            return wave[known], values[known]
        inside = slice(known[0], known[-1] + 1)
        if inside != slice(0, values.size):
            self._note(name, f"there are no values beyond {wave[known[0]]:g} to {wave[known[-1]]:g} nm")
        wave, values = wave[inside], values[inside]
        gaps = np.flatnonzero(~np.isfinite(values))
        if (np.diff(gaps) == 1).any():
            at = gaps[:-1][np.diff(gaps) == 1][0]
            start = f"from {wave[at]:g} nm on"
            self._fault(name, "several values in a row are missing", start, "at most one between two")
        for at in gaps:
            filled = np.interp(wave[at], wave[np.isfinite(values)], values[np.isfinite(values)])
            self._note(name, f"the missing value at {wave[at]:g} nm is {filled:.6g}, by a straight line")
            values[at] = filled
        return wave, values
