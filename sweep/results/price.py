"""The table of what a worst case costs where nothing is off."""

from __future__ import annotations

from collections.abc import Sequence

import pyarrow as pa

from .tables import SCHEMA_VERSION


def price_schema(parameters: Sequence[str]) -> pa.Schema:
    """Columns of the price of a worst case: one row per level of the nominal quantity, and one for each end.

    Then two for each level of a front, `sensitivity_min`; see `search.price.price_of_light`.
    """
    names = ("nominal_min", "sensitivity_min", "nominal", "worst", "sensitivity", "cfa_sensitivity", *parameters)
    return pa.schema([pa.field(name, pa.float64()) for name in names], metadata={"cfa_sweep_schema": SCHEMA_VERSION})
