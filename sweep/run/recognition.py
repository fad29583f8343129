"""Recognition from raw patches: a row for each plain CFA, named design and answer of the search in each scenario."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
import pyarrow as pa

from ..base.types import FloatArray, Parallel, Progress, delayed
from ..camera.imager import imager_of
from ..camera.view import View
from ..metrics.recognition import columns, recognize
from ..results.designs import row_curves
from ..results.tables import FEW
from ..study import Study


def recognition_table(study: Study, highlights: pd.DataFrame, parallel: Parallel, progress: Progress) -> pa.Table:
    """Columns `design_id`, those of a design's name, `patches` and `recognition.columns`.

    The random numbers of a row follow from the study's seed and its id.
    """
    asked = study.section.recognition
    assert asked is not None
    keys = ["design_id", "kind", "name", "cfa", "scenario"]
    rows = highlights[highlights["kind"].isin(FEW) & (highlights["status"] == "ok")].to_dict("records")
    tasks = []
    for row in rows:
        space, curves = row_curves(study, row)
        seed = (study.section.seed, int(row["design_id"]))
        view = study.view(space, row["scenario"])
        tasks.append(delayed(_recognized, view, curves, study.states, asked.patches, seed))
    found = []
    for row, values in zip(rows, parallel(iter(tasks)), strict=False):
        found.append({key: row[key] for key in keys} | {"patches": asked.patches} | values)
        progress("patches", len(found), len(rows))
    text, number = pa.string(), pa.float64()
    fields = [("design_id", pa.int64()), *((key, text) for key in keys[1:]), ("patches", pa.int64())]
    return pa.Table.from_pylist(found, schema=pa.schema([*fields, *((name, number) for name in columns())]))


def _recognized(
    view: View, curves: FloatArray, states: Sequence[str], patches: int, seed: tuple[int, int]
) -> dict[str, float]:
    return recognize(imager_of(view), curves, states, patches, np.random.default_rng(seed))
