"""The kernels of a scene's methods in cells of places: at the cells' nodes, and what may lie between their corners."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ...base.types import FloatArray, IndexArray
from ..effects import phase
from ..methods import Methods
from ..place_cells import ClassCells
from ..place_classes import classes_of
from ..view import View

_CORNERS = [0, 2, 6, 8]
"""Those of a cell's nodes."""
_PARABOLA = 5 / 4
"""No parabola is larger between three nodes than its largest value there, times this."""


class InCells(NamedTuple):
    """A kernel in cells. `nodes`: at their nodes, ndarray[n_cells, 9, n_channels, n_channels, n_knots]; `off`: how far
    it may be from its interpolation through these at any wavelength, ndarray[n_cells, n_channels, n_channels].
    """

    nodes: FloatArray
    off: FloatArray


class PlacesBetween:
    """The cells that stand for all places of a light, remembered for each method."""

    def __init__(self, view: View, knots_nm: FloatArray) -> None:
        self._view, self._knots_nm = view, knots_nm
        self._known: dict[Methods, InCells] = {}

    @cached_property
    def cells(self) -> phase.Cells:
        """The cells."""
        largest = phase.whole(self._view.mosaic)
        return largest.divided(np.ones(len(largest.centers), dtype=bool))

    @cached_property
    def _nodes(self) -> tuple[phase.Cases, IndexArray]:
        return self.cells.shared_nodes(self._view)

    @cached_property
    def _corners(self) -> tuple[IndexArray, IndexArray]:
        nodes = self._nodes[1][:, _CORNERS]
        first, numbered = np.unique(nodes, return_inverse=True)
        return first, numbered.reshape(nodes.shape)

    @property
    def n_nodes(self) -> int:
        """Nodes of all cells, each once."""
        return len(self._nodes[0].places_px)

    @property
    def corners(self) -> IndexArray:
        """Which case is at each corner of each cell, ndarray[n_cells, 4]."""
        return self._corners[1]

    def at_corners(self, methods: Methods) -> FloatArray:
        """The kernel at all corners, each once: the cases, ndarray[n_cases, n_channels, n_channels, n_knots]."""
        at = self.of(methods).nodes[:, _CORNERS]
        found = np.empty((len(self._corners[0]), *at.shape[2:]))
        found[self.corners] = at
        return found

    def of(self, methods: Methods) -> InCells:
        """The kernel of some methods."""
        if methods not in self._known:
            apart, classes = classes_of(replace(self._view, methods=methods))
            shared, cells, work = (
                ClassCells(apart, self._knots_nm, folded=classes.tile is not None),
                self.cells,
                Counter[str](),
            )
            cases, which = self._nodes
            kernel = shared.at_places(cases, classes, work) @ shared.shares
            nodes = np.broadcast_to(kernel, (*kernel.shape[:3], self._knots_nm.size))[which]
            found = shared.in_cells(cells, classes, work)
            # That of the middle wavelength, and what differs from it.
            off = found.kernel[..., 0] + found.kernel[..., 1:].max(axis=3, initial=0.0)
            off += np.einsum("nus,snuc->nuc", found.moves, _sizes(nodes, cells.half))
            self._known[methods] = InCells(nodes, off)
        return self._known[methods]


def beside_corners(nodes: FloatArray) -> FloatArray:
    """How far the biquadratic function through some nodes may be from the bilinear one through the corners.

    `nodes`: ndarray[n_cells, 9, n_values, n_channels, n_knots]; at any wavelength, ndarray[n_cells, n_values,
    n_channels]. A parabola is up to half of its second difference from its chord.
    """
    x, y = _second_differences(nodes)
    return np.asarray((_PARABOLA * x + y).max(axis=-1) / 2)


def _second_differences(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The largest along a row and along a column of nodes, ndarray[n_cells, 9, ...] -> ndarray[n_cells, ...]."""
    grid = values.reshape(len(values), 3, 3, *values.shape[2:])
    x, y = (np.diff(grid, n=2, axis=axis) for axis in (2, 1))
    return np.abs(x).max(axis=(1, 2)), np.abs(y).max(axis=(1, 2))


def _sizes(values: FloatArray, h: float) -> FloatArray:
    """Of the biquadratic function through values at the nodes, ndarray[n_cells, 9, n, m, n_knots]: how far it may be
    from its mean there, and its largest slope and second derivative; ndarray[3, n_cells, n, m].
    """
    grid = values.reshape(len(values), 3, 3, *values.shape[2:])
    off = np.abs(values - values.mean(axis=1, keepdims=True)).max(axis=1)
    steps = [np.abs(np.diff(grid, axis=axis)).max(axis=(1, 2)) for axis in (2, 1)]
    bends = _second_differences(values)
    # A parabola is at most as steep, at its ends, as its steeper chord and half of its second difference.
    slope = np.maximum(steps[0] + bends[0] / 2, steps[1] + bends[1] / 2) / h
    bend = np.maximum(*bends) / h**2
    every = _PARABOLA**2 * off, _PARABOLA * slope, _PARABOLA * bend
    return np.stack([size.max(axis=-1) for size in every])
