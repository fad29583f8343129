"""Batches of designs for the forward model: products of filters with weights, and shapes of the curves.

Two routes with one signature. `CurveBlock` takes any filters, as one matrix product. `EdgeBlock` takes designs of a
grid of stopbands: N = base + depth (target - base) (e_left - e_right), so that a product is that of the base and two
look-ups in tables over the edges of the grid, exact up to rounding, without a spectrum per design.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple, Protocol

import numpy as np

from ..base.cache import Cache
from ..base.types import (
    Array,
    ChannelCurves,
    DesignCurves,
    DesignNumbers,
    Float,
    IndexArray,
    Int,
    PerDesign,
    PerWavelength,
)
from .family import SeparableFamily
from .products import row_products
from .space import Space

_LEFT, _LEFT_WIDTH, _RIGHT, _RIGHT_WIDTH, _DEPTH = range(5)
_MOST_BYTES = 2**27
_KEPT_TABLES = 8
_FEW_WEIGHTS = 2_000
"""Numbers that are compared one by one sooner than they are multiplied with the edges again."""
_MANY = 64
"""From so many designs on, a compiled pass saves more time than it takes to load."""


class Block(Protocol):
    """Batch of designs with one or several modified channels."""

    def __len__(self) -> int:
        """Return the number of designs."""

    def curves(self) -> DesignCurves:
        """Return the QE of the modified channels."""

    def product(
        self, weights: Float[Array, "_modified k"], nodes: Int[IndexArray, " nodes"]
    ) -> Float[Array, "designs k"]:
        """Sum QE times weights over modified channels and wavelengths."""

    def shapes(self, base_qe: ChannelCurves) -> tuple[PerDesign, PerDesign]:
        """Return slope and transmission of the curves, over all modified channels.

        Returns largest step between neighboring wavelengths, and smallest ratio to the base, 1 where the base is 0.
        """

    def subset(self, which: Int[IndexArray, " which"] | slice) -> Block:
        """Return some of the designs."""


@dataclass(frozen=True)
class CurveBlock:
    """Filters given by their curves; methods as in `Block`."""

    qe: DesignCurves

    def __len__(self) -> int:
        return len(self.qe)

    def curves(self) -> DesignCurves:
        """Return the QE of the modified channels."""
        return self.qe

    def product(
        self, weights: Float[Array, "_modified k"], nodes: Int[IndexArray, " nodes"]
    ) -> Float[Array, "designs k"]:
        """Sum QE times weights."""
        seen = self.qe if nodes.size == self.qe.shape[2] else self.qe[:, :, nodes]
        flat = seen.reshape(len(self.qe), -1)
        return row_products(flat, weights)

    def subset(self, which: Int[IndexArray, " which"] | slice) -> CurveBlock:
        """Return some of the designs."""
        return CurveBlock(self.qe[which])

    def shapes(self, base_qe: ChannelCurves) -> tuple[PerDesign, PerDesign]:
        """Return slope and transmission of the curves."""
        steepest, lowest = np.zeros(len(self.qe)), np.full(len(self.qe), np.inf)
        for channel, base in enumerate(np.asarray(base_qe, dtype=float)):
            curves = np.ascontiguousarray(self.qe[:, channel], dtype=float)
            step, low = _shapes(curves, *_inverse(base))
            bad = np.isnan(curves).any(axis=1)
            step[bad] = low[bad] = np.nan
            steepest, lowest = np.maximum(steepest, step), np.minimum(lowest, low)
        return steepest, lowest


@dataclass(frozen=True)
class EdgeSums:
    """Weighted sums of the base, and of the change times each edge."""

    base: Float[Array, " readings"]
    left: Float[Array, "left_edges readings"]
    right: Float[Array, "right_edges readings"]


class KnownShapes(NamedTuple):
    """Shapes of a grid's edges for `compiled.shapes_of_edges`, computed before its designs."""

    inverse: Float[Array, " ..."]
    dark: Float[Array, " ..."]
    before: Float[Array, " ..."]
    after: Float[Array, " ..."]
    steps: Float[Array, " ..."]
    lows: Float[Array, " ..."]
    of_left: Float[Array, " ..."]
    of_right: Float[Array, " ..."]


@dataclass
class Tables:
    """All edges of a grid and their products with weights."""

    base: Float[Array, " nodes"]
    change: Float[Array, " nodes"]
    left: Float[Array, "left_edges nodes"]
    right: Float[Array, "right_edges nodes"]
    _products: Cache[tuple[Any, ...], tuple[Float[Array, " _readings"], EdgeSums]] = field(
        default_factory=lambda: Cache(_KEPT_TABLES)
    )
    _shapes: Cache[tuple[float, bytes], KnownShapes] = field(default_factory=lambda: Cache(_KEPT_TABLES))

    @cached_property
    def spans(self) -> tuple[Int[IndexArray, "_edges 2"], Int[IndexArray, "_edges 2"]]:
        """Range in which each edge rises, see `compiled.spans`."""
        from .edge_kernels import spans  # noqa: PLC0415  (compiled: kept off the start-up path)

        return spans(self.left), spans(self.right)

    def shapes(self, base_qe: PerWavelength, deep: float) -> KnownShapes:
        """Return the shapes of the grid's edges at one depth; cached."""
        from .edge_kernels import edge_shapes, outside, ranges_of  # noqa: PLC0415  (compiled: kept off the start-up path)

        def compute() -> KnownShapes:
            ratio, (left, right) = _inverse(base_qe), self.spans
            of_left = edge_shapes(self.base, self.change, deep * self.left, left, *ratio)
            of_right = edge_shapes(self.base, self.change, deep * (1.0 - self.right), right, *ratio)
            between = ranges_of(self.base + self.change * deep, *ratio)
            return KnownShapes(*ratio, *outside(self.base, *ratio), *between, of_left, of_right)

        return self._shapes.get((deep, base_qe.tobytes()), compute)

    def product(self, weights: Float[Array, "_modified k"], nodes: Int[IndexArray, " nodes"]) -> EdgeSums:
        """Return weighted sums of the base and of the change times each edge; cached."""

        def compute() -> EdgeSums:
            changed = self.change[nodes, None] * weights
            return EdgeSums(self.base[nodes] @ weights, self.left[:, nodes] @ changed, self.right[:, nodes] @ changed)

        # Many weights are recognized by identity: they live as long as their products, and are never modified.
        data = weights.__array_interface__["data"][0] if weights.size > _FEW_WEIGHTS else weights.tobytes()
        return self._products.get(
            (data, weights.shape, weights.strides, nodes.tobytes()), lambda: (weights, compute())
        )[1]


@dataclass(frozen=True)
class EdgeBlock:
    """Designs of a grid of stopbands by the indices of their edges; methods as in `Block`."""

    space: Space
    numbers: DesignNumbers
    tables: Tables
    at_left: DesignNumbers
    at_right: DesignNumbers
    depth: PerDesign

    def __len__(self) -> int:
        return len(self.depth)

    def curves(self) -> DesignCurves:
        """Return the QE of the modified channel."""
        return self.space.curves(self.space.points_of(self.numbers), self.tables.base.size)

    def subset(self, which: Int[IndexArray, " which"] | slice) -> EdgeBlock:
        """Return some of the designs."""
        ends = (self.at_left[which], self.at_right[which], self.depth[which])
        return EdgeBlock(self.space, self.numbers[which], self.tables, *ends)

    def product(
        self, weights: Float[Array, "_modified k"], nodes: Int[IndexArray, " nodes"]
    ) -> Float[Array, "designs k"]:
        """Sum QE times weights by table lookup."""
        from .edge_kernels import through_edges  # noqa: PLC0415  (compiled: kept off the start-up path)

        sums_of_designs = np.empty((len(self), weights.shape[1]))
        sums = self.tables.product(weights, nodes)
        through_edges(sums.base, sums.left, sums.right, self.at_left, self.at_right, self.depth, sums_of_designs)
        return sums_of_designs

    def shapes(self, base_qe: ChannelCurves) -> tuple[PerDesign, PerDesign]:
        """Return slope and transmission of the curves by table lookup."""
        from .edge_kernels import shapes_of_edges  # noqa: PLC0415  (compiled: kept off the start-up path)

        steepest, lowest = np.empty(len(self)), np.empty(len(self))
        tables = self.tables
        deep = float(self.depth[np.isfinite(self.depth)][:1].sum())  # most grids have one depth
        edges = (tables.left, tables.right, *tables.spans, self.at_left, self.at_right)
        known = tables.shapes(np.asarray(base_qe[0], dtype=float), deep)
        shapes_of_edges(tables.base, tables.change, *edges, self.depth, deep, *known, steepest, lowest)
        return steepest, lowest


def _inverse(base: PerWavelength) -> tuple[PerWavelength, PerWavelength]:
    """Return 1 / base and 0; where the base is 0, 0 and 1, so that the ratio to it is 1."""
    return np.divide(1.0, base, out=np.zeros_like(base), where=base > 0), np.where(base > 0, 0.0, 1.0)


def _shapes(
    curves: ChannelCurves, inverse: PerWavelength, dark: PerWavelength
) -> tuple[Float[Array, " modified"], Float[Array, " modified"]]:
    """Return slope and transmission of each curve, without compiled code for few curves."""
    if len(curves) < _MANY:
        steps = np.abs(np.diff(curves, axis=1))
        return steps.max(axis=1, initial=0.0), (curves * inverse + dark).min(axis=1)
    from .edge_kernels import shapes  # noqa: PLC0415  (compiled: kept off the start-up path)

    step, low = np.empty(len(curves)), np.empty(len(curves))
    shapes(curves, inverse, dark, step, low)
    return step, low


_tables: Cache[tuple[Any, ...], Tables] = Cache(_KEPT_TABLES)
_known: Cache[int, tuple[Space, Tables | None]] = Cache(_KEPT_TABLES)
"""Tables of the spaces of the last blocks, by the spaces, which are immutable."""


def by_edges(space: Space) -> bool:
    """Return whether `edges_of` takes the designs of a space.

    True for grids of separable families whose tables are not too large.
    """
    return _separable(space) is not None


def _separable(space: Space) -> tuple[SeparableFamily, PerWavelength, PerWavelength] | None:
    """Return family, base and change of a grid; None if the family is not separable or its tables are too large."""
    family = None if space.filter is None else space.filter.family
    if not space.gridded or not isinstance(family, SeparableFamily):
        return None
    n_left, n_right = (len(space.axes[at]) * len(space.axes[at + 1]) for at in (_LEFT, _RIGHT))
    base, change = family.separable
    return (family, base, change) if (n_left + n_right) * base.size * base.itemsize <= _MOST_BYTES else None


def edges_of(space: Space, start: int, stop: int) -> EdgeBlock | None:
    """Return consecutive designs of a grid by their edges.

    None if the family is not separable or its tables are too large.
    """
    return edges_of_some(space, np.arange(start, stop))


def edges_of_some(space: Space, numbers: DesignNumbers) -> EdgeBlock | None:
    """Return designs of a grid by their edges.

    None if the family is not separable or its tables are too large.
    """
    _, tables = _known.get(id(space), lambda: (space, _tables_of(space)))
    if tables is None:
        return None
    left, left_width, right, right_width, depth = space.digits(numbers)
    at_left = left * len(space.axes[_LEFT_WIDTH]) + left_width
    at_right = right * len(space.axes[_RIGHT_WIDTH]) + right_width
    return EdgeBlock(space, numbers, tables, at_left, at_right, np.asarray(space.axes[_DEPTH], dtype=float)[depth])


def _tables_of(space: Space) -> Tables | None:
    """Return the tables of a grid's edges; equal grids share them."""
    family_and_curves = _separable(space)
    if family_and_curves is None:
        return None
    family, base, change = family_and_curves
    of_family = type(family), family.edges(np.array([[600.0, 10.0]])).tobytes()
    key = space.axes, base.tobytes(), change.tobytes(), *of_family

    def compute() -> Tables:
        pairs = [
            np.stack([a.ravel() for a in np.meshgrid(space.axes[at], space.axes[at + 1], indexing="ij")], axis=1)
            for at in (_LEFT, _RIGHT)
        ]
        left_edges, right_edges = (family.edges(pair) for pair in pairs)
        return Tables(base, change, left_edges, right_edges)

    return _tables.get(key, compute)
