"""A file of curves, read as far as it can be, and how large one may be."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..base.errors import DataError, Fault
from ..base.types import FloatArray

WAVELENGTH = "wavelength_nm"
"""Name of the first column of the package's own files."""
MOST_BYTES = 40_000_000
MOST_CURVES = 2_000
MOST_SAMPLES = 100_000
MOST_VALUES = 2_000_000
"""Limits of a file of curves: 2,000 curves of 1,000 samples are read in a second or two."""


@dataclass(frozen=True)
class Scan:
    """A file of curves, read as far as it can be.

    `wavelength_nm`: ndarray[n_samples] as the file has it, in nm where it says its unit. `values`: ndarray[n_samples,
    n_curves], a column per name. What is not a number is NaN in both. `faults`: what is wrong, in groups; `read_curves`
    stops at the first group. `notes`: how it was read, where it is not written as `wavelength_nm,...`.
    """

    wavelength_nm: FloatArray
    names: tuple[str, ...]
    values: FloatArray
    faults: tuple[tuple[Fault, ...], ...]
    notes: tuple[str, ...] = ()


def check_size(file: str, line: int | None, n_samples: int, n_curves: int) -> None:
    """Refuse what would take minutes to read, before it is read. Raises DataError."""
    for what, count, most in (
        ("curves", n_curves, MOST_CURVES),
        ("samples", n_samples, MOST_SAMPLES),
        ("values", n_samples * n_curves, MOST_VALUES),
    ):
        if count > most:
            raise DataError(Fault(f"too many {what} in one file", file, line, None, count, f"at most {most:,}"))


def unit_by_size(wave: FloatArray) -> float:
    """Factor that brings wavelengths to nm: light between 100 nm and 20 um in nm, um or m."""
    largest = float(np.nanmax(wave)) if np.isfinite(wave).any() else 0.0
    return 1e9 if 0 < largest < 1e-4 else 1e3 if 0 < largest < 20 else 1.0


def distinct(names: Sequence[str]) -> tuple[str, ...]:
    """Column names, numbered where one is empty or occurs twice."""
    unique: dict[str, None] = {}
    for index, name in enumerate(names):
        candidate = name or f"column ({index + 2})"
        while candidate in unique:
            candidate = f"{candidate} ({index + 2})"
        unique[candidate] = None
    return tuple(unique)
