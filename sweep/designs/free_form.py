"""A filter free at every node of a grid of its own."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..errors import Fault, SweepError
from ..types import FloatArray
from .family import Parameter
from .products import row_products


class FreeForm:
    """N = base x transmission, which is piecewise linear between nodes and 1 outside the first and the last node.

    Linear in its parameters, so it is the natural family to come near the limit. `nodes_nm`: ndarray[n_nodes].
    `shift_nm` moves the transmission toward the red.
    """

    kind = "free_form"
    n_modified = 1
    start_dimensions: int | None = 3

    def __init__(
        self, wavelength_nm: FloatArray, base: FloatArray, nodes_nm: FloatArray, shift_nm: float = 0.0
    ) -> None:
        if nodes_nm.size < 2:
            raise SweepError(Fault("a free-form filter needs two nodes or more", value=nodes_nm.tolist()))
        self.nodes_nm = nodes_nm
        self._made_of = wavelength_nm, base
        nominal_nm = wavelength_nm - shift_nm
        inside = (nominal_nm >= nodes_nm[0]) & (nominal_nm <= nodes_nm[-1])
        hats = [np.interp(nominal_nm, nodes_nm, unit) for unit in np.eye(nodes_nm.size)]
        self._hats = np.stack(hats) * (base * inside)
        self._fixed = np.where(inside, 0.0, base)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Transmission at each node."""
        return tuple(Parameter(f"transmission_{node:g}_nm", 0, 1, default=None) for node in self.nodes_nm)

    def curves(self, x: FloatArray) -> FloatArray:
        """QE of the modified channel, ndarray[n_designs, 1, n_wavelengths]; see `Family.curves`."""
        return np.asarray((self._fixed + row_products(x, self._hats))[:, None, :], dtype=float)

    def upper(self, low: FloatArray, high: FloatArray) -> FloatArray:
        """Every transmission at its largest; see `Family.upper`."""
        assert low.shape == high.shape
        return np.asarray(self.curves(high[None])[0], dtype=float)

    def lower(self, low: FloatArray, high: FloatArray) -> FloatArray:
        """Every transmission at its smallest; see `Family.lower`."""
        assert low.shape == high.shape
        return np.asarray(self.curves(low[None])[0], dtype=float)

    def hull(self, low: FloatArray, high: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Every transmission at its smallest and at its largest; see `Family.hull`."""
        lower, upper = self.curves(np.stack([low, high]))
        return lower, upper

    def gradient(self, x: FloatArray) -> FloatArray:
        """Constant, ndarray[n_nodes, 1, n_wavelengths]; see `Family.gradient`."""
        assert x.shape == self.nodes_nm.shape
        return np.asarray(self._hats[:, None, :], dtype=float)

    @property
    def dimensions(self) -> Mapping[str, FloatArray]:
        """None: it has no bands."""
        return {}

    def shifted(self, shift_nm: float) -> FreeForm:
        """The whole transmission moved; see `Family.shifted`."""
        return FreeForm(*self._made_of, self.nodes_nm, shift_nm)

    def start(self, points: FloatArray) -> FloatArray:
        """Smooth dips of different place, breadth and depth: random nodes would be a filter of spikes."""
        span = self.nodes_nm[-1] - self.nodes_nm[0]
        center = self.nodes_nm[0] + span * points[:, :1]
        breadth = span * (0.05 + 0.35 * points[:, 1:2])
        return np.asarray(1 - points[:, 2:] * np.exp(-0.5 * ((self.nodes_nm - center) / breadth) ** 2), dtype=float)

    def violation(self, x: FloatArray) -> FloatArray:
        """None: every transmission in 0..1 is well formed. ndarray[n_designs, 1] of zeros."""
        return np.zeros((len(x), 1))

    def violation_gradient(self, x: FloatArray) -> FloatArray:
        """Zeros, ndarray[1, n_nodes]."""
        return np.zeros((1, x.size))
