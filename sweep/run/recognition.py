"""Recognition from raw patches: a row for each plain CFA, named design and answer of the search in each scenario."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import pyarrow as pa

from ..metrics.recognition import columns
from ..results.tables import FEW
from ..study import Study
from .looks import Look

if TYPE_CHECKING:
    import pandas as pd


def recognition_table(study: Study, highlights: pd.DataFrame, looks: Mapping[int, Look]) -> pa.Table:
    """Columns `design_id`, those of a design's name, `patches` and `recognition.columns`."""
    asked = study.section.recognition
    assert asked is not None
    keys = ["design_id", "kind", "name", "cfa", "scenario"]
    found = []
    for row in highlights[highlights["kind"].isin(FEW) & (highlights["status"] == "ok")].to_dict("records"):
        values = looks[int(row["design_id"])].recognized
        assert values is not None
        found.append({key: row[key] for key in keys} | {"patches": asked.patches} | dict(values))
    text, number = pa.string(), pa.float64()
    fields = [("design_id", pa.int64()), *((key, text) for key in keys[1:]), ("patches", pa.int64())]
    return pa.Table.from_pylist(found, schema=pa.schema([*fields, *((name, number) for name in columns())]))
