"""Interface of families of filters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar, Protocol, Self, runtime_checkable

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
    """

    name: str
    low: float
    high: float
    default: float | None = None


class Family(Protocol):
    """Filter as a function of its parameters, for batches of designs.

    `kind` names the family, `n_modified` is the number of channels that it replaces, `needs_target` states whether it
    needs a target curve, and `Options` is the schema of its options in a study.
    """

    kind: ClassVar[str]
    n_modified: ClassVar[int]
    needs_target: ClassVar[bool]
    Options: ClassVar[type[Section]]

    @classmethod
    def of_study(
        cls, wavelength_nm: PerWavelength, base: PerWavelength, target: PerWavelength | None, options: Section
    ) -> Family:
        """Make the family over curves of a study.

        Parameters
        ----------
        wavelength_nm : ndarray of shape (n_wavelengths,)
            Wavelengths, nm.
        base : ndarray of shape (n_wavelengths,)
            QE of the replaced curve.
        target : ndarray of shape (n_wavelengths,) or None
            QE that the filter takes inside its band.
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

    @property
    def start_dimensions(self) -> int | None:
        """Dimensions of the unit cube that `start` takes; None if any point of the box is a good start."""

    @property
    def parameters(self) -> Sequence[Parameter]:
        """Parameters in the order of the columns of `x`."""

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
        """Return an upper bound on all well-formed filters of a box.

        Parameters
        ----------
        low, high : ndarray of shape (n_parameters,)
            Ends of the box of parameters.

        Returns
        -------
        ndarray of shape (n_modified, n_wavelengths)
            Upper bound on the QE.
        """

    def lower(self, low: PerParameter, high: PerParameter) -> ChannelCurves:
        """Return a lower bound on all well-formed filters of a box.

        Parameters
        ----------
        low, high : ndarray of shape (n_parameters,)
            Ends of the box of parameters.

        Returns
        -------
        ndarray of shape (n_modified, n_wavelengths)
            Lower bound on the QE.
        """

    def hull(self, low: PerParameter, high: PerParameter) -> tuple[ChannelCurves, ChannelCurves]:
        """Return bounds on all filters of a box, well formed or not.

        Parameters
        ----------
        low, high : ndarray of shape (n_parameters,)
            Ends of the box of parameters.

        Returns
        -------
        low, high : ndarray of shape (n_modified, n_wavelengths)
            Bounds on the QE.
        """

    def gradient(self, x: PerParameter) -> CurvesGradient:
        """Return the derivative of `curves` at one design.

        Parameters
        ----------
        x : ndarray of shape (n_parameters,)
            Parameters of one design.

        Returns
        -------
        ndarray of shape (n_parameters, n_modified, n_wavelengths)
            QE per unit of parameter.
        """

    @property
    def dimensions(self) -> Mapping[str, ParameterWeights]:
        """Lengths in production by name: rows r; a length is min(r @ x), nm."""

    def perturbed(self, production_error: ProductionError) -> Self:
        """Return the family as production makes it.

        Parameters
        ----------
        off : ProductionError
            Production error.

        Returns
        -------
        Family
            Family with this production error.
        """

    def start(self, points: Float[Array, "starts start_dimensions"]) -> Float[Array, "starts parameters"]:
        """Return well-formed designs to start a search from.

        Parameters
        ----------
        points : ndarray of shape (n, start_dimensions)
            Points of the unit cube.

        Returns
        -------
        ndarray of shape (n, n_parameters)
            Starting designs.
        """

    def violation(self, x: DesignParameters) -> Float[Array, "designs conditions"]:
        """Return the conditions of a well-formed design.

        Parameters
        ----------
        x : ndarray of shape (n_designs, n_parameters)
            Parameters.

        Returns
        -------
        ndarray of shape (n_designs, n_conditions)
            Values of the conditions, met where <= 0.
        """

    def violation_gradient(self, x: PerParameter) -> Float[Array, "conditions parameters"]:
        """Return the derivative of `violation` at one design.

        Parameters
        ----------
        x : ndarray of shape (n_parameters,)
            Parameters of one design.

        Returns
        -------
        ndarray of shape (n_conditions, n_parameters)
            Derivatives of the conditions.
        """


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
