"""Interface of families of filters."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar, Protocol, runtime_checkable

import numpy as np

from ..base.errors import SweepError, ValidationIssue
from ..base.types import (
    Array,
    ChannelCurves,
    CurvesGradient,
    DesignCurves,
    DesignParameters,
    Float,
    IndexArray,
    Int,
    ParameterWeights,
    PerParameter,
    PerWavelength,
    Section,
)
from .tolerance import ProductionError

_STEP = 1e-5
"""Half of a central difference, in units of a parameter's range."""


@dataclass(frozen=True)
class Parameter:
    """Parameter of a family.

    Parameters
    ----------
    name : str
        Name with its unit.
    low, high : float
        Range of definition.
    default : float, optional
        Default.
    unit, meaning : str
        As the result tables state them; no unit for a ratio.
    """

    name: str
    low: float
    high: float
    default: float | None = None
    unit: str = ""
    meaning: str = "parameter of an own family, unit in the name"


class Family(ABC):
    """Filter as a function of its parameters, for batches of designs.

    `parameters` and `curves` suffice; what else a family may know has defaults. `kind` names it, `n_modified` is the
    number of channels that it replaces, `needs_target` states whether it needs a target curve, and `Options` is the
    schema of its options in a study. `start_dimensions` are those of the unit cube that `start` takes; None if any
    point of the box is a good start.
    """

    kind: ClassVar[str]
    n_modified: ClassVar[int] = 1
    needs_target: ClassVar[bool] = False
    start_dimensions: int | None = None
    parameters: Sequence[Parameter]
    """In the order of the columns of `x`."""

    class Options(Section):
        """No options."""

    @classmethod
    def of_study(
        cls, wavelength_nm: PerWavelength, base: PerWavelength, target: PerWavelength | None, options: Section
    ) -> Family:
        """Make the family over curves of a study.

        Parameters
        ----------
        wavelength_nm, base, target : ndarray of shape (n_wavelengths,)
            Wavelengths, nm; QE of the replaced curve; and QE that the filter takes inside its band, or None.
        options : Section
            Options of the family.

        Returns
        -------
        Family
            The family.

        Raises
        ------
        SweepError
            If curves and options do not fit together.
        """
        raise NotImplementedError

    @abstractmethod
    def curves(self, x: DesignParameters) -> DesignCurves:
        """Return the QE of the modified channels.

        Parameters
        ----------
        x : ndarray of shape (n_designs, n_parameters)
            Parameters.

        Returns
        -------
        ndarray of shape (n_designs, n_modified, n_wavelengths)
            QE of the modified channels.
        """

    def upper(self, low: PerParameter, high: PerParameter) -> ChannelCurves:
        """Return an upper bound on all well-formed filters of a box: by default 1."""
        return np.ones_like(self.curves(np.stack([low, high]))[0])

    def lower(self, low: PerParameter, high: PerParameter) -> ChannelCurves:
        """Return a lower bound on all well-formed filters of a box: by default 0."""
        return np.zeros_like(self.curves(np.stack([low, high]))[0])

    def hull(self, low: PerParameter, high: PerParameter) -> tuple[ChannelCurves, ChannelCurves]:
        """Return bounds on all filters of a box, well formed or not: by default 0 and 1."""
        return Family.lower(self, low, high), Family.upper(self, low, high)

    def gradient(self, x: PerParameter) -> CurvesGradient:
        """Return the derivative of `curves` at one design per unit of parameter: by default differences."""
        return self._differences(x, self.curves)

    @property
    def dimensions(self) -> Mapping[str, ParameterWeights]:
        """Lengths in production by name: rows r; a length is min(r @ x), nm; by default none."""
        return {}

    def usual_box(self, base: PerWavelength) -> Mapping[str, tuple[float, float]]:
        """Return ranges of parameters outside which nothing changes on a base curve: by default none."""
        assert base.ndim == 1
        return {}

    def perturbed(self, production_error: ProductionError) -> Family:
        """Return the family as production makes it; by default it has no edges that could shift."""
        if any(production_error):
            raise SweepError(ValidationIssue(f"{self.kind} has no edges that production could shift"))
        return self

    def start(self, points: Float[Array, "starts start_dimensions"]) -> Float[Array, "starts parameters"]:
        """Return well-formed designs to start a search from, of points of a unit cube: by default these."""
        return points

    def violation(self, x: DesignParameters) -> Float[Array, "designs _conditions"]:
        """Return the conditions of a well-formed design, met where <= 0: by default one that always is.

        Parameters
        ----------
        x : ndarray of shape (n_designs, n_parameters)
            Parameters.

        Returns
        -------
        ndarray of shape (n_designs, n_conditions)
            Values of the conditions.
        """
        return np.zeros((len(x), 1))

    def violation_gradient(self, x: PerParameter) -> ParameterWeights:
        """Return the derivative of `violation` at one design: by default differences."""
        return self._differences(x, self.violation).T

    def _differences(
        self, x: PerParameter, function: Callable[[Float[Array, "_points parameters"]], Float[Array, "_points ..."]]
    ) -> Float[Array, "parameters ..."]:
        """Return central differences, one-sided at the ends of a parameter; 0 for one with a single value."""
        low, high = (np.array([getattr(p, end) for p in self.parameters], dtype=float) for end in ("low", "high"))
        step = np.diag(_STEP * (high - low))
        above, below = np.minimum(x + step, high), np.maximum(x - step, low)
        values = function(np.concatenate([above, below]))
        span = (above - below).diagonal().reshape(-1, *[1] * (values.ndim - 1))
        difference = values[: x.size] - values[x.size :]
        return np.asarray(np.divide(difference, span, out=np.zeros_like(difference), where=span > 0), dtype=float)


@runtime_checkable
class MovedFamily(Protocol):
    """Family whose filter is fixed + base transmission times shape: production moves the shape alone."""

    @property
    def moved(self) -> tuple[PerWavelength, PerWavelength]:
        """Fixed curve, and base transmission of the shape."""


@runtime_checkable
class SeparableFamily(Protocol):
    """Family whose filter is base + depth change (e(left) - e(right)).

    Its parameters are left, left width, right, right width and depth.
    """

    @property
    def separable(self) -> tuple[PerWavelength, PerWavelength]:
        """Base and change."""

    def edges(self, centers_and_widths: Float[Array, "bands 2"]) -> Float[Array, "bands wavelengths"]:
        """Return rising edges.

        Parameters
        ----------
        centers_and_widths : ndarray of shape (n, 2)
            Center and width of each edge, nm.

        Returns
        -------
        ndarray of shape (n, n_wavelengths)
            Edges, 0 to 1.
        """


@runtime_checkable
class ChoosingFamily(Protocol):
    """Family of which some parameters are numbers in a catalog, with nothing in between, and others their amounts."""

    @property
    def slots(self) -> tuple[tuple[int, int], ...]:
        """Indices of a number and its amount."""

    def only(self, numbers: Int[IndexArray, " colorants"]) -> Family:
        """Return the family with some members of the catalog, under their numbers.

        Parameters
        ----------
        numbers : ndarray of int, shape (n,)
            Ascending numbers.

        Returns
        -------
        Family
            The family.
        """
