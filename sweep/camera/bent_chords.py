"""How far a filter seen in a cone of rays may be from a straight line while the cone turns: a proven upper bound.

The pupil as the sensor sees it is an ellipse: a ray from the place (u, v) of the unit disc has the direction cosines
p = cos a sin c + sin a cos c u and sin a v, for the half angle a and the chief ray angle c. With v held, the mean of a
transmission T over u is K (Theta(p+) - Theta(p-)): K = 1 / (sin a cos c), p+- belong to the rays at the ellipse's edge,
and Theta is the integral of T over p. So its second derivative by c has T itself, by how much it differs from its
middle, and T's slope only at the edge of the cone, however T may bend inside. A function whose second derivative is at
most B is no further than B d^2 / 8 from its chord over a step d.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..base.types import FloatArray, IndexArray
from .rays import Cone, stretch

_CELLS = 16
"""Parts of the cone's edge, in each of which T's steepest slope counts."""


class Steepest:
    """The steepest slope of a function that is linear between knots, and constant beyond them, in any range of it."""

    def __init__(self, knots: FloatArray, values: FloatArray) -> None:
        slopes = np.concatenate([[0.0], np.abs(np.diff(values) / np.diff(knots)), [0.0]])
        self._levels = [slopes]
        while 2 ** len(self._levels) <= slopes.size:
            last, step = self._levels[-1], 2 ** (len(self._levels) - 1)
            self._levels.append(np.maximum(last[:-step], last[step:]))
        self._flat = np.concatenate(self._levels)
        self._starts = np.cumsum([0, *(level.size for level in self._levels[:-1])])

    def among(self, first: IndexArray, last: IndexArray) -> FloatArray:
        """Of the pieces from `first` to `last`, both counted; piece i ends at knot i."""
        level = np.frexp(last - first + 1)[1] - 1
        start = self._starts[level]
        return np.asarray(np.maximum(self._flat[start + first], self._flat[start + last + 1 - (1 << level)]))


@dataclass(frozen=True)
class EdgeOfCone:
    """What the edge of a cone sees while it turns from one chief ray angle to another.

    `first`, `last`: pieces of a transmission that each part of the edge may meet, ndarray[n_wavelengths, n_cells];
    `weight`: how much a slope there counts, per nm, ndarray[n_cells]; `smooth`: the share of the second derivative that
    no slope has, for each unit by which the transmission differs from its middle. `step_rad`: how far the cone turns.
    """

    first: IndexArray
    last: IndexArray
    weight: FloatArray
    smooth: float
    step_rad: float

    def off_chord(self, wavelength_nm: FloatArray, steepest: Steepest, half_range: float) -> FloatArray:
        """How far the mean over the cone may be from its chord between both angles, ndarray[n_wavelengths].

        `half_range`: by how much the transmission differs from its middle at most.
        """
        slopes = steepest.among(self.first, self.last) @ self.weight * wavelength_nm
        return np.asarray((half_range * self.smooth + slopes) * self.step_rad**2 / 8)


def edge_of_cone(
    wavelength_nm: FloatArray, knots_nm: FloatArray, index: float, start: Cone, end_rad: float
) -> EdgeOfCone:
    """The edge of a cone that turns from the chief ray angle of `start` to `end_rad`, which may be the smaller one."""
    half, (low, high) = start.half_rad, sorted((start.chief_rad, end_rad))
    sine, cosine = math.sin(half), math.cos(half)
    at = np.linspace(0.0, math.pi, _CELLS + 1)
    # On the edge u = cos(at), v = sin(at): p grows with c, and falls with `at`; so the ends of cells bound all of it.
    ends = [
        (cosine * math.sin(c) + sine * math.cos(c) * np.cos(at), cosine * math.cos(c) - sine * math.sin(c) * np.cos(at))
        for c in (low, high)
    ]
    p = np.stack([end[0] for end in ends])
    squared = 1 - np.stack([end[1] for end in ends]) ** 2
    corners = np.stack([squared[:, :-1], squared[:, 1:]]).reshape(4, _CELLS)
    most, least = corners.max(axis=0), corners.min(axis=0)
    crosses = (p[0, 1:] < 0) & (p[1, :-1] > 0)  # where p is 0, the angle is the smallest one
    across = (sine * np.minimum(np.sin(at[:-1]), np.sin(at[1:]))) ** 2
    least = np.maximum(np.where(crosses, np.minimum(least, across), least), 0.0)
    across_p = np.maximum(np.abs(p[0, 1:]), np.abs(p[1, :-1]))
    share = np.diff(np.sign(at - math.pi / 2) * (1 - np.sin(at)))  # of |cos| in each cell
    turned = stretch(most, index) ** 3 / index**2 * across_p * (1 - least)
    weight = 2 * share * turned / (math.pi * sine * math.cos(high))
    smooth = 2 / math.cos(high) ** 2 + 12 / math.pi * math.tan(high) / math.tan(half)
    first = np.searchsorted(knots_nm, wavelength_nm[:, None] * stretch(least, index) * (1 - 1e-12), side="left")
    last = np.searchsorted(knots_nm, wavelength_nm[:, None] * stretch(most, index) * (1 + 1e-12), side="right")
    return EdgeOfCone(first, last, weight, smooth, high - low)
