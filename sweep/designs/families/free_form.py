"""Filter of any shape, with a free transmission at each node."""

from __future__ import annotations

import numpy as np
from pydantic import model_validator

from ...base.errors import SweepError, ValidationIssue
from ...base.types import (
    Array,
    ChannelCurves,
    CurvesGradient,
    DesignCurves,
    DesignParameters,
    Float,
    PerParameter,
    PerWavelength,
    Positive,
    Section,
)
from ...spectra.spectrum import linear_basis
from ..family import Family, Parameter
from ..products import row_products
from ..tolerance import AS_DESIGNED, ProductionError

_MOST_NODES = 500


class Nodes(Section):
    """Equidistant nodes of a free-form filter."""

    start_nm: Positive
    """First node, nm."""
    stop_nm: Positive
    """Last node, nm."""
    step_nm: Positive
    """Distance of nodes, nm."""

    @model_validator(mode="after")
    def _whole_steps(self) -> Nodes:
        steps = (self.stop_nm - self.start_nm) / self.step_nm
        if not 1 <= steps < _MOST_NODES:
            raise ValueError(f"nodes: {steps + 1:g} of them; allowed: 2 to {_MOST_NODES}")
        if not abs(steps - round(steps)) < 1e-6:
            raise ValueError(f"step_nm {self.step_nm:g} must divide {self.stop_nm - self.start_nm:g}")
        return self


class FreeForm(Family):
    """Filter with a free transmission at each node.

    Notes
    -----
    N = base times transmission, which is piecewise linear between nodes and 1 outside them. N is linear in its
    parameters.

    Parameters
    ----------
    wavelength_nm : ndarray of shape (n_wavelengths,)
        Wavelengths, nm.
    base : ndarray of shape (n_wavelengths,)
        QE of the replaced curve.
    nodes_nm : ndarray of shape (n_nodes,)
        Nodes, nm.
    production_error : ProductionError
        What production makes of the filter; left out, nothing.
    """

    kind = "free_form"
    start_dimensions = 3

    class Options(Section):
        """Options: nodes of the transmission."""

        nodes: Nodes
        """Nodes of the transmission."""

    def __init__(
        self,
        wavelength_nm: PerWavelength,
        base: PerWavelength,
        nodes_nm: Float[Array, " nodes"],
        production_error: ProductionError = AS_DESIGNED,
    ) -> None:
        if nodes_nm.size < 2:
            raise SweepError(ValidationIssue("a free-form filter needs two nodes or more", value=nodes_nm.tolist()))
        self.nodes_nm = nodes_nm
        self.parameters = tuple(
            Parameter(
                f"transmission_{node:g}_nm",
                0,
                1,
                meaning=f"transmission at {node:g} nm, relative to the replaced curve",
            )
            for node in nodes_nm
        )
        self._made_of = wavelength_nm, base
        nominal_nm = production_error.nominal_nm(wavelength_nm)
        inside = (nominal_nm >= nodes_nm[0]) & (nominal_nm <= nodes_nm[-1])
        self._linear_basis = linear_basis(nominal_nm, nodes_nm) * (base * inside)
        self._fixed = np.where(inside, 0.0, base)

    @classmethod
    def of_study(
        cls, wavelength_nm: PerWavelength, base: PerWavelength, target: PerWavelength | None, options: Section
    ) -> FreeForm:
        """Make the family over curves of a study.

        Raises SweepError if nodes lie outside the wavelengths.
        """
        assert target is None
        assert isinstance(options, FreeForm.Options)
        nodes = options.nodes
        if nodes.start_nm < wavelength_nm[0] or nodes.stop_nm > wavelength_nm[-1]:
            nodes_range = f"{nodes.start_nm:g} to {nodes.stop_nm:g} nm"
            allowed = f"{wavelength_nm[0]:g} to {wavelength_nm[-1]:g} nm"
            raise SweepError(ValidationIssue("nodes outside the wavelength grid", value=nodes_range, allowed=allowed))
        count = round((nodes.stop_nm - nodes.start_nm) / nodes.step_nm) + 1
        return FreeForm(wavelength_nm, base, nodes.start_nm + nodes.step_nm * np.arange(count, dtype=float))

    def curves(self, x: DesignParameters) -> DesignCurves:
        """Return the QE of the modified channel."""
        return np.asarray((self._fixed + row_products(x, self._linear_basis))[:, None, :], dtype=float)

    def upper(self, low: PerParameter, high: PerParameter) -> ChannelCurves:
        """Return the curve with every transmission at its largest."""
        assert low.shape == high.shape
        return np.asarray(self.curves(high[None])[0], dtype=float)

    def lower(self, low: PerParameter, high: PerParameter) -> ChannelCurves:
        """Return the curve with every transmission at its smallest."""
        assert low.shape == high.shape
        return np.asarray(self.curves(low[None])[0], dtype=float)

    def hull(self, low: PerParameter, high: PerParameter) -> tuple[ChannelCurves, ChannelCurves]:
        """Return the curves with every transmission at its smallest and largest."""
        lower, upper = self.curves(np.stack([low, high]))
        return lower, upper

    def gradient(self, x: PerParameter) -> CurvesGradient:
        """Return the derivative of `curves`, which is constant."""
        assert x.shape == self.nodes_nm.shape
        return np.asarray(self._linear_basis[:, None, :], dtype=float)

    def perturbed(self, production_error: ProductionError) -> FreeForm:
        """Return the family with its transmission moved."""
        return FreeForm(*self._made_of, self.nodes_nm, production_error)

    @property
    def moved(self) -> tuple[PerWavelength, PerWavelength]:
        """Zero, and the base, which the transmission multiplies; see `MovedFamily`."""
        base = self._made_of[1]
        return np.zeros_like(base), base

    def start(self, points: Float[Array, "starts start_dimensions"]) -> Float[Array, "starts parameters"]:
        """Return smooth dips of different position, width and depth."""
        span = self.nodes_nm[-1] - self.nodes_nm[0]
        center = self.nodes_nm[0] + span * points[:, :1]
        breadth = span * (0.05 + 0.35 * points[:, 1:2])
        return np.asarray(1 - points[:, 2:] * np.exp(-0.5 * ((self.nodes_nm - center) / breadth) ** 2), dtype=float)
