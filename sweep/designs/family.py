"""What every family of filters offers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar, Protocol, Self, runtime_checkable

from ..base.types import FloatArray, Section
from .tolerance import Off


@dataclass(frozen=True)
class Parameter:
    """A parameter of a family: its name with its unit, the range it is defined on, and a default if it has one."""

    name: str
    low: float
    high: float
    default: float | None = None


class Family(Protocol):
    """A filter as a function of its parameters, for blocks of designs.

    `kind` names the family, `n_modified` is the number of channels that it replaces. `needs_target`: whether it goes
    from its base to a target. `Options`: what it needs beside its parameters, from a study.
    """

    kind: ClassVar[str]
    n_modified: ClassVar[int]
    needs_target: ClassVar[bool]
    Options: ClassVar[type[Section]]

    @classmethod
    def of_study(
        cls, wavelength_nm: FloatArray, base: FloatArray, target: FloatArray | None, options: Section
    ) -> Family:
        """The family over curves of a study, ndarray[n_wavelengths] each; no `target` where it needs none.

        Raises SweepError for what does not fit together.
        """

    @property
    def start_dimensions(self) -> int | None:
        """Dimensions of the unit cube that `start` takes; None where any point of the box is a good start."""

    @property
    def parameters(self) -> Sequence[Parameter]:
        """The parameters, in the order of the columns of `x`."""

    def curves(self, x: FloatArray) -> FloatArray:
        """QE of the modified channels: [n_designs, n_parameters] -> [n_designs, n_modified, n_wavelengths]."""

    def upper(self, low: FloatArray, high: FloatArray) -> FloatArray:
        """No well-formed filter of the box `low`..`high` exceeds this, ndarray[n_modified, n_wavelengths]."""

    def lower(self, low: FloatArray, high: FloatArray) -> FloatArray:
        """No well-formed filter of the box is below this, ndarray[n_modified, n_wavelengths]; see `upper`."""

    def hull(self, low: FloatArray, high: FloatArray) -> tuple[FloatArray, FloatArray]:
        """No filter of the box, well formed or not, is below the first or above the second: see `upper`."""

    def gradient(self, x: FloatArray) -> FloatArray:
        """Derivative of `curves` at one design: [n_parameters] -> [n_parameters, n_modified, n_wavelengths]."""

    @property
    def dimensions(self) -> Mapping[str, FloatArray]:
        """Lengths that a producer asks for, nm: name -> rows r, ndarray[n, n_parameters]; a length is min(r @ x)."""

    def produced(self, off: Off) -> Self:
        """The same family as production has it."""

    def start(self, points: FloatArray) -> FloatArray:
        """Well-formed designs to start a search from: [n, start_dimensions] in 0..1 -> [n, n_parameters]."""

    def violation(self, x: FloatArray) -> FloatArray:
        """Conditions of a well-formed design, met where <= 0: [n_designs, n_parameters] to [n_designs, n]."""

    def violation_gradient(self, x: FloatArray) -> FloatArray:
        """Derivative of `violation` at one design: [n_parameters] to [n, n_parameters]."""


@runtime_checkable
class MovedFamily(Protocol):
    """A family whose filter is fixed + carrier x shape: production moves the shape, and nothing else."""

    @property
    def moved(self) -> tuple[FloatArray, FloatArray]:
        """What is fixed, and the carrier of the shape, ndarray[n_wavelengths] each."""


@runtime_checkable
class SeparableFamily(Protocol):
    """A family whose filter is base + depth change (e(left) - e(right)).

    Its parameters are left, left width, right, right width and depth.
    """

    @property
    def separable(self) -> tuple[FloatArray, FloatArray]:
        """Base and change, ndarray[n_wavelengths] each."""

    def edges(self, centers_and_widths: FloatArray) -> FloatArray:
        """Rising edges, ndarray[n, 2] -> ndarray[n, n_wavelengths]."""
