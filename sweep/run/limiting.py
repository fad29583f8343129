"""The two lights that limit each separation, of the designs that a report shows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress

import numpy as np
import pyarrow as pa

from ..base.types import IndexArray, Parallel, Progress, delayed
from ..camera.forward import ForwardModel, forward_model
from ..camera.setup import Setup
from ..curves.lights import class_pairs
from ..designs.block import CurveBlock, edges_of_some
from ..designs.space import Space
from ..metrics.limiting import LimitingLights, limited_by_name, limiting_lights_of
from ..study import Study
from .looks import Look

_AT_ONCE = 4096
_MOST_VALUES = 2_000_000
"""Digital numbers that are held at once."""
_Part = tuple[IndexArray, Sequence[LimitingLights]]
"""Ids of designs, and the lights that limit them, one block of them after the other."""


def limited_by_table(
    study: Study, looks: Mapping[int, Look], points: IndexArray, parallel: Parallel, progress: Progress
) -> pa.Table:
    """Columns `design_id` and `limited_by_<a>_<b>`, the names of two lights, of the designs that are shown.

    `looks`: at some, by their ids; `points`: ids of swept designs that figures show as points, ndarray[n_points].
    """
    seen = {at: look.limited_by for at, look in looks.items() if look.limited_by is not None}
    rest = points[~np.isin(points, list(seen))]
    parts = list(_limits_of_swept(study, rest, parallel, progress))
    ids = [np.array(sorted(seen), dtype=np.int64), *(own for own, _ in parts)]
    columns = {"design_id": pa.array(np.concatenate(ids))}
    for pair in study.pairs:
        names = [seen[at].get(pair) for at in sorted(seen)]
        names += [name for _, blocks in parts for block in blocks for name in block[pair]]
        columns[limited_by_name(pair)] = pa.array(names, pa.string())
    return pa.table(columns).sort_by("design_id")


def _limits_of_swept(study: Study, ids: IndexArray, parallel: Parallel, progress: Progress) -> list[_Part]:
    """The lights that limit swept designs, each scene and space by itself."""
    ends = np.cumsum([space.size for space in study.spaces])
    of_scene, number = np.divmod(ids, ends[-1])
    of_space = np.searchsorted(ends, number, side="right")
    scenarios, calls, parts = list(study.scenarios), [], list[IndexArray]()
    for scene, at in dict.fromkeys(zip(of_scene.tolist(), of_space.tolist(), strict=True)):
        space, mine = study.spaces[at], (of_scene == scene) & (of_space == at)
        numbers, setup = number[mine] - (ends[at] - space.size), study.setup(space, scenarios[scene])
        for start in range(0, numbers.size, _AT_ONCE):
            calls.append(delayed(_limits, setup, space, numbers[start : start + _AT_ONCE]))
            parts.append(ids[mine][start : start + _AT_ONCE])
    found = list[_Part]()
    for own, blocks in zip(parts, parallel(calls), strict=True):
        found.append((own, blocks))
        progress("limiting lights", sum(done.size for done, _ in found), ids.size)
    return found


def _limits(setup: Setup, space: Space, numbers: IndexArray) -> list[LimitingLights]:
    """The lights that limit some designs of a space, by their numbers in it; a block of them after the other."""
    imager = forward_model(setup)
    values = imager.n_cases * len(setup.lights.names) * len(setup.camera.mosaic.channels)
    step = max(1, _MOST_VALUES // values)
    return [_of_block(imager, space, numbers[start : start + step]) for start in range(0, numbers.size, step)]


def _of_block(imager: ForwardModel, space: Space, numbers: IndexArray) -> LimitingLights:
    """The same of a block, by the routes that `routes.block_of` tries; no lights where a design takes none of them."""
    grid, pairs = imager.setup.camera.grid, class_pairs(imager.setup.lights.classes)
    with suppress(Exception):
        edges = edges_of_some(space, numbers)
        if edges is not None:
            return limiting_lights_of(imager, edges)
    with suppress(Exception):
        return limiting_lights_of(imager, CurveBlock(space.curves(space.points_of(numbers), grid.size)))
    if numbers.size == 1:
        return {pair: np.array([None], dtype=object) for pair in pairs}
    alone = [_of_block(imager, space, numbers[at : at + 1]) for at in range(numbers.size)]
    return {pair: np.concatenate([one[pair] for one in alone]) for pair in pairs}
