"""Widths of a family's edges and bands."""

from __future__ import annotations

from functools import partial

import numpy as np

from ...designs.products import row_products
from ..batch import Batch
from ..metric import Metric
from ..quantity import Columns, Quantity, RequestedQuantities
from ..smooth import Rows, SmoothDesign

_MEANINGS = {
    "edge_width_nm": "narrowest edge of a filter of edges (10 to 90 %)",
    "band_width_nm": "narrowest band of a filter of bands, between the middles of its edges",
}


class SmallestWidths(Metric):
    """Narrowest edge and band."""

    order = 4
    needs = "parameters"

    def quantities(self, requested: RequestedQuantities) -> tuple[Quantity, ...]:
        return tuple(
            Quantity(
                name=name,
                metric=name,
                meaning=_MEANINGS[name],
                unit="nm",
                label=name.removesuffix("_nm").replace("_", " "),
                digits=2,
                direction="more",
                needs="family",
                smooth=partial(_rows, name=name),
            )
            for name in _MEANINGS
        )

    def of_batch(self, batch: Batch) -> Columns:
        """Return the columns of the narrowest edge and band of each design, nm; NaN where the family has none."""
        assert batch.points is not None
        rows, nothing = {} if batch.family is None else batch.family.dimensions, np.full((batch.size, 1), np.nan)
        lengths = {name: row_products(batch.points, rows[name].T) if name in rows else nothing for name in _MEANINGS}
        return {name: values.min(axis=1) for name, values in lengths.items()}


def _rows(design: SmoothDesign, *, name: str) -> Rows:
    return design.linear(design.family.dimensions[name])
