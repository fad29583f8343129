"""The two lights that limit each separation, of the designs that a report can show."""

from __future__ import annotations

from collections.abc import Mapping

import pyarrow as pa

from ..metrics.limiting import BETWEEN, limited_by_name
from ..study import Study
from .looks import Look


def limited_by_table(study: Study, looks: Mapping[int, Look]) -> pa.Table:
    """Columns `design_id` and `limited_by_<a>_<b>`, the names of two lights, of the designs that were looked at."""
    rows = [
        {"design_id": at} | {limited_by_name(pair): BETWEEN.join(lights) for pair, lights in look.limited_by.items()}
        for at, look in sorted(looks.items())
        if look.limited_by is not None
    ]
    names = [limited_by_name(pair) for pair in study.pairs]
    schema = pa.schema([("design_id", pa.int64()), *((name, pa.string()) for name in names)])
    return pa.Table.from_pylist(rows, schema=schema)
