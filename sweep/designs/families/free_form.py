"""A filter free at every node of a grid of its own."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from pydantic import model_validator

from ...base.errors import Fault, SweepError
from ...base.types import FloatArray, Positive, Section
from ...curves.spectrum import hats
from ..family import Parameter
from ..products import row_products
from ..tolerance import AS_DESIGNED, Off

_MOST_NODES = 500


class Nodes(Section):
    """Equidistant nodes of a free-form filter."""

    start_nm: Positive
    stop_nm: Positive
    step_nm: Positive

    @model_validator(mode="after")
    def _whole_steps(self) -> Nodes:
        steps = (self.stop_nm - self.start_nm) / self.step_nm
        if not 1 <= steps < _MOST_NODES:
            raise ValueError(f"nodes: {steps + 1:g} of them; allowed: 2 to {_MOST_NODES}")
        if not abs(steps - round(steps)) < 1e-6:
            raise ValueError(f"step_nm {self.step_nm:g} must divide {self.stop_nm - self.start_nm:g}")
        return self


class FreeForm:
    """N = base x transmission, which is piecewise linear between nodes and 1 outside the first and the last node.

    Linear in its parameters, so it is the natural family to come near the limit. `nodes_nm`: ndarray[n_nodes].
    `off`: how production has it.
    """

    kind = "free_form"
    n_modified = 1
    needs_target = False
    start_dimensions: int | None = 3

    class Options(Section):
        """Where the transmission is free."""

        nodes: Nodes

    def __init__(
        self, wavelength_nm: FloatArray, base: FloatArray, nodes_nm: FloatArray, off: Off = AS_DESIGNED
    ) -> None:
        if nodes_nm.size < 2:
            raise SweepError(Fault("a free-form filter needs two nodes or more", value=nodes_nm.tolist()))
        self.nodes_nm = nodes_nm
        self._made_of = wavelength_nm, base
        nominal_nm = off.nominal_nm(wavelength_nm)
        inside = (nominal_nm >= nodes_nm[0]) & (nominal_nm <= nodes_nm[-1])
        self._hats = hats(nominal_nm, nodes_nm) * (base * inside)
        self._fixed = np.where(inside, 0.0, base)

    @classmethod
    def of_study(
        cls, wavelength_nm: FloatArray, base: FloatArray, target: FloatArray | None, options: Section
    ) -> FreeForm:
        """See `Family.of_study`; raises SweepError for nodes outside the wavelengths."""
        assert target is None
        assert isinstance(options, FreeForm.Options)
        nodes = options.nodes
        if nodes.start_nm < wavelength_nm[0] or nodes.stop_nm > wavelength_nm[-1]:
            place = f"{nodes.start_nm:g} to {nodes.stop_nm:g} nm"
            allowed = f"{wavelength_nm[0]:g} to {wavelength_nm[-1]:g} nm"
            raise SweepError(Fault("nodes outside the wavelength grid", value=place, allowed=allowed))
        count = round((nodes.stop_nm - nodes.start_nm) / nodes.step_nm) + 1
        return FreeForm(wavelength_nm, base, nodes.start_nm + nodes.step_nm * np.arange(count, dtype=float))

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

    def produced(self, off: Off) -> FreeForm:
        """The whole transmission moved; see `Family.produced`."""
        return FreeForm(*self._made_of, self.nodes_nm, off)

    @property
    def moved(self) -> tuple[FloatArray, FloatArray]:
        """Nothing, and the base, which the transmission is on; see `MovedFamily`."""
        base = self._made_of[1]
        return np.zeros_like(base), base

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
