"""A filter in front of the lens: every channel sees it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..base.types import FloatArray
from .family import Family, Parameter
from .tolerance import Off

IN_FRONT = " in front of the lens"
"""How the name of such a family ends."""


@dataclass(frozen=True)
class Glass:
    """The transmissions of a family, each times the QE of all channels of a CFA.

    `inner`: a family of one curve, over a base of 1. `qe`: ndarray[n_channels, n_wavelengths]. What is asked of
    arrays and units is that of `Family`.
    """

    inner: Family
    qe: FloatArray

    @property
    def kind(self) -> str:
        """The family's name, and where it stands."""
        return self.inner.kind + IN_FRONT

    @property
    def n_modified(self) -> int:
        """All channels."""
        return len(self.qe)

    @property
    def start_dimensions(self) -> int | None:
        """Those of the family."""
        return self.inner.start_dimensions

    @property
    def parameters(self) -> Sequence[Parameter]:
        """Those of the family."""
        return self.inner.parameters

    def curves(self, x: FloatArray) -> FloatArray:
        """QE behind the glass, ndarray[n_designs, n_channels, n_wavelengths]."""
        return np.asarray(self.inner.curves(x) * self.qe)

    def upper(self, low: FloatArray, high: FloatArray) -> FloatArray:
        """See `Family.upper`."""
        return np.asarray(self.inner.upper(low, high) * self.qe)

    def lower(self, low: FloatArray, high: FloatArray) -> FloatArray:
        """See `Family.lower`."""
        return np.asarray(self.inner.lower(low, high) * self.qe)

    def hull(self, low: FloatArray, high: FloatArray) -> tuple[FloatArray, FloatArray]:
        """See `Family.hull`."""
        least, most = self.inner.hull(low, high)
        return least * self.qe, most * self.qe

    def gradient(self, x: FloatArray) -> FloatArray:
        """ndarray[n_parameters, n_channels, n_wavelengths]."""
        return np.asarray(self.inner.gradient(x) * self.qe)

    @property
    def dimensions(self) -> Mapping[str, FloatArray]:
        """Those of the family."""
        return self.inner.dimensions

    def produced(self, off: Off) -> Glass:
        """The glass as production has it."""
        return Glass(self.inner.produced(off), self.qe)

    def start(self, points: FloatArray) -> FloatArray:
        """See `Family.start`."""
        return self.inner.start(points)

    def violation(self, x: FloatArray) -> FloatArray:
        """See `Family.violation`."""
        return self.inner.violation(x)

    def violation_gradient(self, x: FloatArray) -> FloatArray:
        """See `Family.violation_gradient`."""
        return self.inner.violation_gradient(x)
