"""Constraints that a study states on quantities of a design."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
from pydantic import model_validator

from ..base.types import FloatArray, Number, Section

FEASIBLE = 1e-9
"""A design is feasible up to this violation (see `Bound.scale`), so that rounding cannot lose one on a bound."""
_LEAST = 1e-30
"""A bound is 0, or at least so large."""
_LEAST_SCALE = 1e-6
"""A violation is relative to this at least: relative to a smaller bound, rounding alone would be one."""


class Bound(Section):
    """An allowed range; at least one end: 0, or 1e-30 to 1e30 in magnitude."""

    min: Number | None = None
    max: Number | None = None

    @model_validator(mode="after")
    def _ordered(self) -> Bound:
        if self.min is None and self.max is None:
            raise ValueError("a constraint needs `min`, `max` or both")
        for end in (self.min, self.max):
            if end is not None and 0 < abs(end) < _LEAST:
                raise ValueError(f"{end:g} is too near to 0; 0 itself is allowed")
        if self.min is not None and self.max is not None and not self.min <= self.max:
            raise ValueError(f"min {self.min:g} must not be above max {self.max:g}")
        return self

    @property
    def scale(self) -> float:
        """What a violation is relative to: the larger end; where that is 0, one unit of the quantity."""
        end = max(abs(self.min or 0.0), abs(self.max or 0.0))
        return max(end, _LEAST_SCALE) if end > 0 else 1.0

    def violation(self, values: FloatArray) -> FloatArray:
        """Return how far `values` are outside, relative to `scale`, >= 0; NaN where the value is unknown (NaN)."""
        below = 0.0 if self.min is None else self.min - values
        above = 0.0 if self.max is None else values - self.max
        return np.maximum(np.maximum(below, above), 0.0) / self.scale

    def __str__(self) -> str:
        ends = [f">= {self.min:g}"] if self.min is not None else []
        return " and ".join(ends + ([f"<= {self.max:g}"] if self.max is not None else []))


def total_violation(
    columns: Mapping[str, FloatArray], constraints: Mapping[str, Bound], own: FloatArray, leave_out: Iterable[str] = ()
) -> FloatArray:
    """Largest violation of each design, relative to the bound for a study's constraints: ndarray[n_designs].

    `own`: violation of the family's conditions. `leave_out`: quantities that are not looked at. 0 is feasible; NaN,
    where a quantity is unknown, is not.
    """
    worst = own
    for quantity, bound in constraints.items():
        if quantity not in leave_out:
            worst = np.maximum(worst, bound.violation(columns[quantity]))
    return worst
