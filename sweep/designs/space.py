"""Design spaces: designs of a study, counted and addressable without making them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ..base.types import Array, DesignCurves, DesignNumbers, DesignParameters, Float, PerDesign
from .family import Family
from .technology import Technology
from .tolerance import AS_DESIGNED, ProductionError

Kind = Literal["reference", "design", "sweep", "search"]


Axes = tuple[tuple[float, ...], ...]


@dataclass(frozen=True)
class Filter:
    """Family bound to its curves."""

    family: Family
    bases: Mapping[str, str]
    target: str
    technology: Technology | None = None

    @property
    def channels(self) -> tuple[str, ...]:
        """Channels that it replaces."""
        return tuple(self.bases)


@dataclass(frozen=True)
class Space:
    """Set of designs on one CFA: a full-factorial grid, listed ones, or a box that is searched but not swept.

    `filter`: left out for a plain CFA, which has no axes and one design; `gridded`: False for a box that is searched
    but not swept. `axes`: values of each parameter; in a grid the last one runs fastest. `listed`: so many designs, of
    which the i-th has the i-th value of every axis, or its only one.
    """

    kind: Kind
    name: str
    cfa: str
    filter: Filter | None = None
    axes: Axes = ()
    gridded: bool = True
    listed: int = 0

    @property
    def size(self) -> int:
        """Number of designs; 0 for a box that is searched but not swept."""
        if self.listed:
            return self.listed
        return math.prod(len(axis) for axis in self.axes) if self.gridded else 0

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the family's parameters, with units."""
        return () if self.filter is None else tuple(p.name for p in self.filter.family.parameters)

    def digits(self, numbers: DesignNumbers) -> list[DesignNumbers]:
        """Return the index on each axis of a grid.

        Returns index of the value, one array per axis.
        """
        rest = numbers
        digits = []
        for axis in reversed(self.axes):  # mixed radix: NumPy's own unravel_index stops at 64 axes
            quotient = rest // len(axis)  # several times as fast as divmod
            digits.append(rest - quotient * len(axis))
            rest = quotient
        return digits[::-1]

    def points(self, start: int, stop: int) -> Float[Array, "_designs parameters"]:
        """Return the parameters of consecutive designs."""
        return self.points_of(np.arange(start, stop))

    def points_of(self, numbers: DesignNumbers) -> DesignParameters:
        """Return the parameters of designs.

        `numbers`: numbers of the designs, at least one.
        """
        if self.listed:
            every = [np.broadcast_to(np.asarray(axis, dtype=float), self.listed)[numbers] for axis in self.axes]
            return np.stack(every, axis=1)
        digits = zip(self.axes, self.digits(numbers), strict=True)
        columns = [np.asarray(axis, dtype=float)[digit] for axis, digit in digits]
        return np.stack(columns, axis=1) if columns else np.empty((len(numbers), 0))

    def curves(
        self, points: DesignParameters, n_wavelengths: int, production_error: ProductionError = AS_DESIGNED
    ) -> DesignCurves:
        """Return the QE of the modified channels; a plain CFA has none."""
        if self.filter is None:
            return np.empty((len(points), 0, n_wavelengths))
        family = self.filter.family
        return (family.perturbed(production_error) if any(production_error) else family).curves(points)

    def violation(self, points: DesignParameters) -> PerDesign:
        """Return the largest violation of the family's own conditions.

        0 where a design is well formed.
        """
        if self.filter is None:
            return np.zeros(len(points))
        return np.asarray(np.maximum(self.filter.family.violation(points).max(axis=1), 0.0), dtype=float)
