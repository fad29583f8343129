"""Design spaces: the designs that a study names, counted and addressable without making them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ..base.types import FloatArray, IndexArray
from .family import Family
from .technology import Technology
from .tolerance import AS_DESIGNED, Off
from .ungridded import Axes, Ungridded

Kind = Literal["reference", "design", "sweep", "search"]


@dataclass(frozen=True)
class Filter:
    """A family bound to its curves: which curve of the sensor it replaces in each channel, and by what it works."""

    family: Family
    bases: Mapping[str, str]
    target: str
    technology: Technology | None = None

    @property
    def channels(self) -> tuple[str, ...]:
        """The channels that it replaces."""
        return tuple(self.bases)


@dataclass(frozen=True)
class Space:
    """A set of designs on one CFA: a full-factorial grid, `rows`, or a box that is searched but not swept.

    `axes`: the values of each parameter of the family; in a grid the last one runs fastest. A plain CFA has no filter,
    no axes and one design.
    """

    kind: Kind
    name: str
    cfa: str
    filter: Filter | None = None
    axes: Axes = ()
    gridded: bool = True
    rows: Ungridded | None = None

    @property
    def size(self) -> int:
        """Number of designs; 0 for a box that is searched but not swept."""
        if self.rows is not None:
            return self.rows.size
        return math.prod(len(axis) for axis in self.axes) if self.gridded else 0

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the family's parameters, with units."""
        return () if self.filter is None else tuple(p.name for p in self.filter.family.parameters)

    def digits(self, numbers: IndexArray) -> list[IndexArray]:
        """For each axis of a grid the index of its value in the designs of these numbers, ndarray[n_designs]."""
        rest = numbers
        found = []
        for axis in reversed(self.axes):  # mixed radix: NumPy's own unravel_index stops at 64 axes
            whole = rest // len(axis)  # several times as fast as divmod
            found.append(rest - whole * len(axis))
            rest = whole
        return found[::-1]

    def points(self, start: int, stop: int) -> FloatArray:
        """Parameters of designs start..stop-1: ndarray[stop - start, n_parameters]."""
        return self.points_of(np.arange(start, stop))

    def points_of(self, numbers: IndexArray) -> FloatArray:
        """Parameters of the designs of these numbers, one at least: ndarray[n_designs, n_parameters]."""
        if self.rows is not None:
            start = int(numbers.min())
            return self.rows.points(self.axes, start, int(numbers.max()) + 1)[numbers - start]
        digits = zip(self.axes, self.digits(numbers), strict=True)
        columns = [np.asarray(axis, dtype=float)[digit] for axis, digit in digits]
        return np.stack(columns, axis=1) if columns else np.empty((len(numbers), 0))

    def curves(self, points: FloatArray, n_wavelengths: int, off: Off = AS_DESIGNED) -> FloatArray:
        """QE of the modified channels: ndarray[n_designs, n_modified, n_wavelengths]; none for a plain CFA.

        `off`: how production has them.
        """
        if self.filter is None:
            return np.empty((len(points), 0, n_wavelengths))
        family = self.filter.family
        return (family.produced(off) if any(off) else family).curves(points)

    def violation(self, points: FloatArray) -> FloatArray:
        """Largest violation of the family's own conditions, ndarray[n_designs]; 0 where a design is well formed."""
        if self.filter is None:
            return np.zeros(len(points))
        return np.asarray(np.maximum(self.filter.family.violation(points).max(axis=1), 0.0), dtype=float)
