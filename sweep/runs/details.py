"""Details of the designs that a report shows: limiting lights, digital numbers, maps over the sensor."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING

import numpy as np
import pyarrow as pa

from ..base.types import (
    DesignNumbers,
    FloatArray,
    Parallel,
    Progress,
    delayed,
)
from ..camera.model import scene_model
from ..camera.setup import Setup
from ..designs.block import CurveBlock, edges_of_some
from ..designs.space import Space
from ..metrics.limiting import LimitingLights, limited_by_name, limiting_lights, limiting_lights_of
from ..results.designs import computed_rows, row_curves
from ..results.tables import LIMITED_BY, POINTS, SEARCHED
from ..study import Study
from .analysis import Details, Shown
from .workers import run_with_progress

if TYPE_CHECKING:
    import pandas as pd

_AT_ONCE, _SWEPT_AT_ONCE = 64, 4096
_MOST_VALUES = 2_000_000
"""Digital numbers that are held at once."""
_Design = tuple[int, FloatArray]
"""A design's id, and its curves."""


def design_details(
    study: Study,
    tables: Collection[str],
    rows: pd.DataFrame,
    on_front: pd.DataFrame,
    parallel: Parallel,
    progress: Progress,
) -> dict[int, Details]:
    """Compute the details of drawn rows and of the front."""
    first, front = next(iter(study.scenarios)), {*on_front["design_id"]}
    groups: dict[tuple[str, ...], tuple[Setup, list[_Design]]] = {}
    for row in computed_rows(rows, on_front):
        scenario, design_id = str(row["scenario"]), int(row["design_id"])
        if LIMITED_BY in tables or (
            POINTS in tables and (design_id in front or scenario == first or row["kind"] == SEARCHED)
        ):
            space, curves = row_curves(study, row)
            key = (scenario, space.cfa, *(() if space.filter is None else space.filter.channels))
            group = groups.setdefault(key, (study.setup(space, scenario), []))
            group[1].append((design_id, curves))
    calls = [
        delayed(_details, setup, designs[start : start + _AT_ONCE])
        for setup, designs in groups.values()
        for start in range(0, len(designs), _AT_ONCE)
    ]
    result: dict[int, Details] = {}
    for details in run_with_progress(parallel, calls, "digital numbers", progress):
        result |= details
    return result


def _details(setup: Setup, designs: Sequence[_Design]) -> dict[int, Details]:
    """Return details by row id."""
    result = {}
    for design_id, curves in designs:
        response = scene_model(setup).read(curves)[0]
        limited_by = {pair: lights[0] for pair, lights in limiting_lights(setup, response).items()}
        result[design_id] = Details(limited_by, response[0, 0].copy())
    return result


def limited_by_table(shown: Shown) -> pa.Table:
    """Return `design_id` and `limited_by_<a>_<b>`, the names of two lights, of the designs that are shown."""
    study, points = shown.study, shown.points
    names = {at: detail.limited_by for at, detail in shown.details.items() if detail.limited_by is not None}
    ids = points[~np.isin(points, list(names))]
    ends = np.cumsum([space.size for space in study.spaces])
    scene, number = np.divmod(ids, ends[-1])
    at = np.searchsorted(ends, number, side="right")
    scenarios, calls, parts = list(study.scenarios), [], []
    for scene_index, space_index in dict.fromkeys(zip(scene.tolist(), at.tolist(), strict=True)):
        space = study.spaces[space_index]
        group = np.flatnonzero((scene == scene_index) & (at == space_index))
        for start in range(0, group.size, _SWEPT_AT_ONCE):
            part = group[start : start + _SWEPT_AT_ONCE]
            numbers = number[part] - (ends[space_index] - space.size)
            calls.append(delayed(_limits, study.setup(space, scenarios[scene_index]), space, numbers))
            parts.append(ids[part].tolist())
    for part, lights in zip(
        parts, run_with_progress(shown.parallel, calls, "limiting lights", shown.progress), strict=True
    ):
        names |= {design_id: {pair: lights[pair][index] for pair in lights} for index, design_id in enumerate(part)}
    numbers = sorted(names)
    limits = {
        limited_by_name(pair): pa.array([names[at].get(pair) for at in numbers], pa.string()) for pair in study.pairs
    }
    return pa.table({"design_id": pa.array(numbers, pa.int64()), **limits})


def _limits(setup: Setup, space: Space, numbers: DesignNumbers) -> LimitingLights:
    """Return the limiting lights of some designs of a space."""
    model, camera = scene_model(setup), setup.camera
    step = max(1, _MOST_VALUES // (model.n_cases * len(setup.lights.names) * len(camera.mosaic.channels)))
    parts = []
    for start in range(0, numbers.size, step):
        part = numbers[start : start + step]
        edges = edges_of_some(space, part)
        block = CurveBlock(space.curves(space.points_of(part), camera.grid.size)) if edges is None else edges
        parts.append(limiting_lights_of(model, block))
    return {pair: np.concatenate([part[pair] for part in parts]) for pair in parts[0]}
