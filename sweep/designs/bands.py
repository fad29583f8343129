"""Bands between two edges each, for families whose parameters are edges and depths."""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from typing import Self

import numpy as np

from ..base.types import Array, DesignParameters, Float, ParameterWeights, PerParameter, PerWavelength
from .edge import SPAN_PER_WIDTH, edge, edge_gradient, per_span
from .family import Family, Parameter
from .products import row_products
from .tolerance import ProductionError

_HALF = SPAN_PER_WIDTH / 2
_PER_BAND = 5
_LIT, _BEYOND_NM = 0.01, 30.0
"""Share of its peak from which on a curve has light, and how far an edge may lie beyond it, nm."""
_FEW = 64
"""From so many designs on, a compiled pass saves more time than it takes to load."""
LEFT, LEFT_WIDTH, RIGHT, RIGHT_WIDTH, DEPTH = range(_PER_BAND)


def band_parameters(number: int | None = None) -> tuple[Parameter, ...]:
    """Return the parameters of one band: edges, widths and depth.

    `number`: number of the band, part of the names if there are several.
    """
    n = "" if number is None else str(number)
    return (
        Parameter(f"left{n}_nm", 200, 2000, unit="nm", meaning="middle of the band's left edge"),
        Parameter(f"left{n}_width_nm", 0, 500, unit="nm", meaning="width of its left edge, 10 to 90 %"),
        Parameter(f"right{n}_nm", 200, 2000, unit="nm", meaning="middle of the band's right edge"),
        Parameter(f"right{n}_width_nm", 0, 500, unit="nm", meaning="width of its right edge, 10 to 90 %"),
        Parameter(f"depth{n}", 0, 1, default=1.0, meaning="share of the way to the target curve inside the band"),
    )


class Bands:
    """Sum of bands, each depth times e(l; left) - e(l; right), and the conditions that keep it between 0 and 1."""

    def __init__(self, wavelength_nm: PerWavelength, count: int) -> None:
        self._wave = wavelength_nm
        self._count = count
        self.parameters = (
            band_parameters() if count == 1 else tuple(p for b in range(count) for p in band_parameters(b + 1))
        )
        self._conditions = self._condition_matrix()

    def shape(self, x: DesignParameters) -> Float[Array, "designs wavelengths"]:
        """Return the sum of the bands, 0 to 1 for well-formed designs."""
        bands = x.reshape(len(x), self._count, _PER_BAND)
        if len(x) < _FEW:
            edges = self.edges(bands[:, :, :DEPTH].reshape(-1, 2)).reshape(len(x), self._count, 2, -1)
            each = bands[:, :, DEPTH, None] * (edges[:, :, 0] - edges[:, :, 1])
            return np.asarray(sum(each.swapaxes(0, 1), start=np.zeros((len(x), self._wave.size))), dtype=float)
        from .edge_kernels import between_edges  # noqa: PLC0415  (compiled: kept off the start-up path)

        shape = np.zeros((len(x), self._wave.size))
        centers_nm, widths_nm = (bands[:, :, at:DEPTH:2].reshape(len(x), -1) for at in (LEFT, LEFT_WIDTH))
        between_edges(self._wave, centers_nm, per_span(widths_nm), np.ascontiguousarray(bands[:, :, DEPTH]), shape)
        shape[~np.isfinite(x).all(axis=1)] = np.nan
        return shape

    def gradient(self, x: PerParameter) -> Float[Array, "parameters wavelengths"]:
        """Return the derivative of `shape` at one design, per unit of parameter."""
        bands = x.reshape(self._count, _PER_BAND)
        ends = bands[:, :DEPTH].reshape(-1, 2)
        slopes = edge_gradient(self._wave, ends[:, :1], ends[:, 1:])
        signs = np.repeat(bands[:, DEPTH], 2) * np.tile([1.0, -1.0], self._count)
        edges = self.edges(ends).reshape(self._count, 2, -1)
        rows = np.empty((self._count, _PER_BAND, self._wave.size))
        for at, slope in enumerate(slopes):  # by centers, and by widths
            rows[:, at:DEPTH:2] = (signs[:, None] * slope).reshape(self._count, 2, -1)
        rows[:, DEPTH] = edges[:, 0] - edges[:, 1]
        return rows.reshape(-1, self._wave.size)

    def reach(self, low: PerParameter, high: PerParameter) -> PerWavelength:
        """Return where a band of the box can be open."""
        open_at = np.zeros(self._wave.size)
        for at in range(0, self._count * _PER_BAND, _PER_BAND):
            start = low[at + LEFT] - _HALF * high[at + LEFT_WIDTH]
            end = high[at + RIGHT] + _HALF * high[at + RIGHT_WIDTH]
            open_at[(self._wave >= start) & (self._wave <= end)] = 1.0
        return open_at

    def range(self, low: PerParameter, high: PerParameter) -> tuple[PerWavelength, PerWavelength]:
        """Return bounds on `shape` in a box, for any order of the edges.

        An edge falls with its center; with its width it falls behind the center and rises before it. Its extremes are
        therefore at the ends of both.
        """
        least, most = np.zeros(self._wave.size), np.zeros(self._wave.size)
        for at in range(0, self._count * _PER_BAND, _PER_BAND):
            ends = []
            for edge_at in (at + LEFT, at + RIGHT):
                early, late = (
                    self.edges(np.array([[box[edge_at], width[edge_at + 1]] for width in (low, high)]))
                    for box in (low, high)
                )
                ends.append((late.min(axis=0), early.max(axis=0)))
            (left_low, left_high), (right_low, right_high) = ends
            depths = np.array([low[at + DEPTH], high[at + DEPTH]])
            least += np.outer(depths, left_low - right_high).min(axis=0)
            most += np.outer(depths, left_high - right_low).max(axis=0)
        return least, most

    def edges_within(self, base: PerWavelength) -> dict[str, tuple[float, float]]:
        """Return for each edge the wavelengths, nm, where a curve has light, and some beyond that."""
        lit = self._wave[base >= _LIT * base.max()]
        low, high = lit[0] - _BEYOND_NM, lit[-1] + _BEYOND_NM
        at_edges = [p for number, p in enumerate(self.parameters) if number % _PER_BAND in (LEFT, RIGHT)]
        return {p.name: (max(float(low), p.low), min(float(high), p.high)) for p in at_edges}

    def perturbed(self, production_error: ProductionError) -> Bands:
        """Return the bands as production makes them."""
        return Bands(production_error.nominal_nm(self._wave), self._count)

    @property
    def dimensions(self) -> dict[str, ParameterWeights]:
        """Rows whose smallest product with the parameters is the narrowest edge (10 to 90 %) and band, nm."""
        identity = np.eye(self._count * _PER_BAND)
        first = np.arange(self._count) * _PER_BAND
        return {
            "edge_width_nm": identity[np.sort(np.concatenate([first + LEFT_WIDTH, first + RIGHT_WIDTH]))],
            "band_width_nm": identity[first + RIGHT] - identity[first + LEFT],
        }

    def violation(self, x: DesignParameters) -> Float[Array, "designs _conditions"]:
        """Return the order of the edges, nm.

        Start and end of a left edge must not lie behind those of its right edge, and a band must end before the next
        begins.

        Met where <= 0.
        """
        return row_products(x, self._conditions.T)

    def violation_gradient(self, x: PerParameter) -> ParameterWeights:
        """Return the derivative of `violation`, which is constant."""
        assert x.shape == (self._count * _PER_BAND,)
        return self._conditions

    def edges(self, centers_and_widths: Float[Array, "bands 2"]) -> Float[Array, "bands wavelengths"]:
        """Return rising edges."""
        return edge(self._wave, centers_and_widths[:, :1], centers_and_widths[:, 1:])

    def _condition_matrix(self) -> Float[Array, "conditions parameters"]:
        rows = []
        for band in range(self._count):
            at = band * _PER_BAND
            for sign in (-_HALF, _HALF):
                row = np.zeros(self._count * _PER_BAND)
                row[at + LEFT], row[at + LEFT_WIDTH], row[at + RIGHT], row[at + RIGHT_WIDTH] = 1, sign, -1, -sign
                rows.append(row)
            if band + 1 < self._count:
                row = np.zeros(self._count * _PER_BAND)
                row[at + RIGHT], row[at + RIGHT_WIDTH] = 1, _HALF
                row[at + _PER_BAND + LEFT], row[at + _PER_BAND + LEFT_WIDTH] = -1, _HALF
                rows.append(row)
        return np.stack(rows)


class Banded(Family):
    """Base class of families with bands as parameters: edges, widths and depth of each."""

    def __init__(self, wavelength_nm: PerWavelength, bands: int) -> None:
        self._bands = Bands(wavelength_nm, bands)
        self.parameters = self._bands.parameters

    @property
    def dimensions(self) -> Mapping[str, ParameterWeights]:
        """See `Bands.dimensions`."""
        return self._bands.dimensions

    def usual_box(self, base: PerWavelength) -> Mapping[str, tuple[float, float]]:
        """Return for each edge the wavelengths where the base has light, and some beyond that."""
        return self._bands.edges_within(base)

    def perturbed(self, production_error: ProductionError) -> Self:
        """Return the family with shifted bands between the same curves; see `Family.perturbed`."""
        family = copy(self)
        family._bands = self._bands.perturbed(production_error)
        return family

    def violation(self, x: DesignParameters) -> Float[Array, "designs _conditions"]:
        """Return edges out of order, nm; see `Bands.violation`."""
        return self._bands.violation(x)

    def violation_gradient(self, x: PerParameter) -> ParameterWeights:
        """Return the derivative; see `Bands.violation_gradient`."""
        return self._bands.violation_gradient(x)
