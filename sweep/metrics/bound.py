"""Constraints of a study on quantities of a design."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
from pydantic import model_validator

from ..base.types import Number, PerDesign, SameShape, Section

FEASIBLE = 1e-9
"""A design is feasible up to this violation (see `Bound.scale`), so that rounding cannot lose one on a bound."""
_LEAST = 1e-30
"""A bound is 0, or at least so large."""
_LEAST_SCALE = 1e-6
"""A violation is relative to this at least: relative to a smaller bound, rounding alone would be one."""


class Bound(Section):
    """Allowed range of a quantity, with at least one end."""

    min: Number | None = None
    """Smallest allowed value."""
    max: Number | None = None
    """Largest allowed value."""

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
        """Scale of a relative violation: the larger end, or one unit of the quantity if that is 0."""
        end = max(abs(self.min or 0.0), abs(self.max or 0.0))
        return max(end, _LEAST_SCALE) if end > 0 else 1.0

    def violation(self, values: SameShape) -> SameShape:
        """Return the violation of the bound.

        Returns distance outside the range, relative to `scale`, >= 0. NaN where the value is NaN.
        """
        below = 0.0 if self.min is None else self.min - values
        above = 0.0 if self.max is None else values - self.max
        return np.maximum(np.maximum(below, above), np.zeros_like(values)) / self.scale

    def __str__(self) -> str:
        ends = [f">= {self.min:g}"] if self.min is not None else []
        return " and ".join(ends + ([f"<= {self.max:g}"] if self.max is not None else []))


def total_violation(
    columns: Mapping[str, PerDesign],
    constraints: Mapping[str, Bound],
    family_violation: PerDesign,
    leave_out: Iterable[str] = (),
) -> PerDesign:
    """Return the largest violation of each design.

    `family_violation`: violation of the family's conditions. Returns relative violation: 0 is feasible. NaN, where a
    quantity is unknown, is not.
    """
    worst = family_violation
    for quantity, bound in constraints.items():
        if quantity not in leave_out:
            worst = np.maximum(worst, bound.violation(columns[quantity]))
    return worst
