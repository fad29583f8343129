"""The two lights that limit each separation, of the designs that a report can show."""

from __future__ import annotations

from itertools import groupby

import numpy as np
import pandas as pd
import pyarrow as pa

from ..base.types import FloatArray, Parallel, Progress, delayed
from ..camera.imager import Imager, imager_of
from ..camera.view import View
from ..metrics.limiting import BETWEEN, limited_by_name, limiting_lights
from ..results.designs import row_curves
from ..study import Study

_AT_ONCE = 64
_FEW = 4
"""Designs for which no table is made."""


def limited_by_table(
    study: Study, rows: pd.DataFrame, on_front: pd.DataFrame, parallel: Parallel, progress: Progress
) -> pa.Table:
    """Columns `design_id` and `limited_by_<a>_<b>`, the names of two lights, of the rows to draw and of the front."""
    every = pd.concat([rows, on_front]).drop_duplicates("design_id")
    groups: dict[tuple[str, ...], list[tuple[int, FloatArray]]] = {}
    views: dict[tuple[str, ...], View] = {}
    for row in every[every["status"] == "ok"].to_dict("records"):
        space, curves = row_curves(study, row)
        key = (str(row["scenario"]), space.cfa, *(() if space.filter is None else space.filter.channels))
        views.setdefault(key, study.view(space, key[0]))
        groups.setdefault(key, []).append((int(row["design_id"]), curves))
    parts = [
        (views[key], own[start : start + _AT_ONCE])
        for key, own in groups.items()
        for start in range(0, len(own), _AT_ONCE)
    ]
    names = [limited_by_name(pair) for pair in study.pairs]
    found = []
    # The CFAs of a scene share its kernels: in one call, where few designs of each are looked at.
    calls: list[list[tuple[View, list[tuple[int, FloatArray]]]]] = []
    for _, own in groupby(parts, lambda part: part[0].scenario):
        scene = list(own)
        calls += [scene] if sum(len(designs) for _, designs in scene) <= _AT_ONCE else [[part] for part in scene]
    for answer in parallel(delayed(_limited, call) for call in calls):
        found += answer
        progress("limiting lights", len(found), sum(len(own) for own in groups.values()))
    schema = pa.schema([("design_id", pa.int64()), *((name, pa.string()) for name in names)])
    return pa.Table.from_pylist(sorted(found, key=lambda row: row["design_id"]), schema=schema)


def _limited(parts: list[tuple[View, list[tuple[int, FloatArray]]]]) -> list[dict[str, object]]:
    """A row per design."""
    rows = []
    for view, designs in parts:
        imager = imager_of(view) if len(designs) > _FEW else Imager(view, once=True)
        for design_id, curves in designs:
            pairs = limiting_lights(imager, np.asarray(curves, dtype=float))
            named = {limited_by_name(pair): BETWEEN.join(lights) for pair, lights in pairs.items()}
            rows.append({"design_id": design_id, **named})
    return rows
