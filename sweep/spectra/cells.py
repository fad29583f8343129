"""Numbers, wavelength units and column names in the cells of tables."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

import numpy as np

from ..base.types import FloatArray

_NUMBER = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?")


def number_of(cell: str) -> float | None:
    """Return a finite number as tables have it, without Python's underscores and other scripts' digits.

    Parameters
    ----------
    cell : str
        Cell.

    Returns
    -------
    float or None
        None if it is none.
    """
    number = float(cell) if _NUMBER.fullmatch(cell.strip()) else math.nan
    return number + 0.0 if math.isfinite(number) else None


def unit_by_size(wave: FloatArray) -> float:
    """Return the factor from wavelengths to nm by their size: light between 100 nm and 20 um in nm, um or m.

    Parameters
    ----------
    wave : ndarray of shape (n_samples,)
        Wavelengths.

    Returns
    -------
    float
        Factor.
    """
    largest = float(np.nanmax(wave)) if np.isfinite(wave).any() else 0.0
    return 1e9 if 0 < largest < 1e-4 else 1e3 if 0 < largest < 20 else 1.0


def distinct(names: Sequence[str]) -> tuple[str, ...]:
    """Return column names, numbered if empty or repeated.

    Parameters
    ----------
    names : sequence of str
        Names.

    Returns
    -------
    tuple of str
        Names.
    """
    unique: dict[str, None] = {}
    for index, name in enumerate(names):
        candidate = name or f"column ({index + 2})"
        while candidate in unique:
            candidate = f"{candidate} ({index + 2})"
        unique[candidate] = None
    return tuple(unique)
