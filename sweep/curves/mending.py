"""What needs a decision in a file of curves, decided: small negatives, single missing samples, repeated rows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..base.errors import Fault
from ..base.types import FloatArray
from .isetcam import csv_text
from .scan import Scan
from .spectrum import sample_faults

_SMALL = 0.02
"""Negatives up to this share of a curve's largest value are noise around 0."""


@dataclass(frozen=True)
class Mended:
    """Curves as `Scan` has them, in rising order; `changes`: what was changed; `faults`: what no rule here mends."""

    wavelength_nm: FloatArray
    names: tuple[str, ...]
    values: FloatArray
    changes: tuple[str, ...]
    faults: tuple[Fault, ...]

    def text(self, file: str, notes: tuple[str, ...]) -> str:
        """A clean CSV that says what was changed in its first lines."""
        said = [f"# from {file}", *(f"# read: {note}" for note in notes), *(f"# changed: {c}" for c in self.changes)]
        lines = [" ".join(line.split()) for line in said]
        return "\n".join(lines) + "\n" + csv_text(self.wavelength_nm, dict(zip(self.names, self.values.T, strict=True)))


def mended(scan: Scan) -> Mended:
    """The curves of a scan with negatives of up to 2 % of the peak at 0, single gaps between two samples filled by the
    straight line, and rows that say the same twice said once. Everything else stays, and is a fault.
    """
    changes: list[str] = []
    wave, values = scan.wavelength_nm, scan.values.copy()
    kept = np.isfinite(wave)
    if not kept.all():
        changes.append(f"{np.count_nonzero(~kept)} rows without a wavelength were left out")
    wave, values = wave[kept], values[kept]
    order = np.argsort(wave, kind="stable")
    if (order != np.arange(order.size)).any():
        changes.append("rows were sorted by wavelength")
    wave, values = _once(wave[order], values[order], changes)
    for at, name in enumerate(scan.names):
        _mend(wave, values[:, at], name, changes)
    groups = sample_faults("", wave, scan.names, values) if wave.size > 1 else [[Fault("fewer than two samples")]]
    return Mended(wave, scan.names, values, tuple(changes), tuple(fault for group in groups for fault in group))


def _once(wave: FloatArray, values: FloatArray, changes: list[str]) -> tuple[FloatArray, FloatArray]:
    """Without rows that repeat the one before."""
    same = np.zeros(wave.size, dtype=bool)
    same[1:] = (wave[1:] == wave[:-1]) & (values[1:] == values[:-1]).all(axis=1)
    if same.any():
        changes.append(f"{np.count_nonzero(same)} rows that repeat another were left out")
    return wave[~same], values[~same]


def _mend(wave: FloatArray, column: FloatArray, name: str, changes: list[str]) -> None:
    """Change a curve in place."""
    finite = np.isfinite(column)
    top = float(column[finite].max(initial=0.0))
    low = finite & (column < 0) & (column >= -_SMALL * top)
    if low.any():
        changes.append(f"{name}: {np.count_nonzero(low)} negatives down to {column[low].min():.3g} were set to 0")
        column[low] = 0.0
    inside = np.flatnonzero(~finite[1:-1]) + 1
    for at in inside:
        if finite[at - 1] and finite[at + 1]:
            column[at] = np.interp(wave[at], wave[[at - 1, at + 1]], column[[at - 1, at + 1]])
            place = f"the missing value at {wave[at]:g} nm"
            changes.append(f"{name}: {place} is {column[at]:.6g}, by a straight line")
