"""Decide what needs a decision in a file of curves: small negatives, single missing samples, repeated rows."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import chain

import numpy as np

from ..base.errors import Fault
from ..base.types import FloatArray
from .filter_files import csv_text
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
        lines = [f"from {file}", *(f"read: {note}" for note in notes), *(f"changed: {c}" for c in self.changes)]
        head = "".join(f"# {' '.join(line.split())}\n" for line in lines)
        return head + csv_text(self.wavelength_nm, dict(zip(self.names, self.values.T, strict=True)))


def mended(scan: Scan) -> Mended:
    """The curves of a scan with negatives of up to 2 % of the peak at 0, single gaps between two samples filled by the
    straight line, and rows that say the same twice said once. Everything else stays, and is a fault.
    """
    changes: list[str] = []
    order = np.argsort(scan.wavelength_nm, kind="stable")  # puts NaN last
    kept = order[np.isfinite(scan.wavelength_nm[order])]
    if kept.size < order.size:
        changes.append(f"{order.size - kept.size} rows without a wavelength were left out")
    if (np.diff(kept) < 0).any():
        changes.append("rows were sorted by wavelength")
    wave, values = scan.wavelength_nm[kept], scan.values[kept]
    again = np.zeros(wave.size, dtype=bool)
    again[1:] = (wave[1:] == wave[:-1]) & (values[1:] == values[:-1]).all(axis=1)
    if again.any():
        changes.append(f"{np.count_nonzero(again)} rows that repeat another were left out")
    wave, values = wave[~again], values[~again]
    for name, column in zip(scan.names, values.T, strict=True):
        changes += _mend(wave, column, name)
    groups = sample_faults("", wave, scan.names, values) if wave.size > 1 else [[Fault("fewer than two samples")]]
    return Mended(wave, scan.names, values, tuple(changes), tuple(chain.from_iterable(groups)))


def _mend(wave: FloatArray, column: FloatArray, name: str) -> list[str]:
    """Change a curve in place, and say how."""
    changes = []
    finite = np.isfinite(column)
    low = finite & (column < 0) & (column >= -_SMALL * column[finite].max(initial=0.0))
    if low.any():
        changes.append(f"{name}: {np.count_nonzero(low)} negatives down to {column[low].min():.3g} were set to 0")
        column[low] = 0.0
    for at in np.flatnonzero(~finite[1:-1] & finite[:-2] & finite[2:]) + 1:
        column[at] = np.interp(wave[at], wave[[at - 1, at + 1]], column[[at - 1, at + 1]])
        changes.append(f"{name}: the missing value at {wave[at]:g} nm is {column[at]:.6g}, by a straight line")
    return changes
