"""A metric: columns that are computed together, and what they are computed from."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import ClassVar

from .batch import Batch, CaseReadings
from .quantity import Columns, Quantity, RequestedQuantities


class Metric(ABC):
    """Columns that are computed together; a class in `metrics/columns/`, or in `columns.py` of a feature.

    `order` is their place in the table, `needs` what they are computed from. A metric overrides `of_readings` or
    `of_cases`, at each field position, sampling phase and moment, of which the worst counts and is refined, or
    `of_batch`, which asks the batch for whatever it needs.
    """

    order: ClassVar[int] = 99
    needs: ClassVar[str] = "readings"
    """What there must be: "readings", "noise", "any brightness", "pulses", "filters", "parameters", or a feature."""

    @property
    def of_scene(self) -> bool:
        """True if effects of a scene change its columns."""
        return self.needs not in ("filters", "parameters")

    @abstractmethod
    def quantities(self, requested: RequestedQuantities) -> Sequence[Quantity]:
        """Return the columns in a study; none if they are not requested."""

    def of_readings(self, readings: CaseReadings) -> Columns:  # noqa: ARG002
        """Compute the columns of designs, each in one case."""
        return {}

    def of_cases(self, batch: Batch) -> Columns:  # noqa: ARG002
        """Compute the columns of designs in each case, [cases, designs], from what the batch reads."""
        return {}

    def of_batch(self, batch: Batch) -> Columns:  # noqa: ARG002
        """Compute the columns of designs over all cases."""
        return {}
