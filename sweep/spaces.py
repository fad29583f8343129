"""Design spaces: the designs that a study names, counted and addressable without making them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from .arrays import FloatArray
from .families import Family

Kind = Literal["reference", "design", "sweep", "search"]


@dataclass(frozen=True)
class Filter:
    """A family bound to its curves, and which channels of which CFA it replaces."""

    family: Family
    channels: tuple[str, ...]
    base: str
    target: str


@dataclass(frozen=True)
class Space:
    """A full-factorial set of designs on one CFA.

    `axes`: the values of each parameter of the family; the last one runs fastest. A plain CFA has no filter, no axes
    and one design.
    """

    kind: Kind
    name: str
    cfa: str
    filter: Filter | None = None
    axes: tuple[tuple[float, ...], ...] = ()

    @property
    def size(self) -> int:
        """Number of designs."""
        return math.prod(len(axis) for axis in self.axes)

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the family's parameters, with units."""
        return () if self.filter is None else tuple(p.name for p in self.filter.family.parameters)

    def points(self, start: int, stop: int) -> FloatArray:
        """Parameters of designs start..stop-1: ndarray[stop - start, n_parameters]."""
        index = np.unravel_index(np.arange(start, stop), tuple(len(axis) for axis in self.axes)) if self.axes else ()
        columns = [np.asarray(axis, dtype=float)[i] for axis, i in zip(self.axes, index, strict=True)]
        return np.stack(columns, axis=1) if columns else np.empty((stop - start, 0))

    def curves(self, points: FloatArray, n_wavelengths: int) -> FloatArray:
        """QE of the modified channels: ndarray[n_designs, n_modified, n_wavelengths]; none for a plain CFA."""
        if self.filter is None:
            return np.empty((len(points), 0, n_wavelengths))
        return self.filter.family.curves(points)

    def violation(self, points: FloatArray) -> FloatArray:
        """Largest violation of the family's own conditions, ndarray[n_designs]; 0 where a design is well formed."""
        if self.filter is None:
            return np.zeros(len(points))
        return np.asarray(np.maximum(self.filter.family.violation(points).max(axis=1), 0.0), dtype=float)
