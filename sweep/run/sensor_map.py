"""Separations over the sensor, from its middle to its corner, where a scene has a field."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pyarrow as pa

from ..base.types import FloatArray, Parallel, Progress, delayed
from ..camera.field import over_field, scene_at
from ..camera.setup import Setup
from ..metrics.separation import csd_name, separations
from ..metrics.smooth import smooth_response
from ..results.designs import row_curves
from ..results.tables import FEW
from ..study import Study

if TYPE_CHECKING:
    import pandas as pd

_HEIGHTS = 41
"""Image heights at which a map is computed, in equal steps."""


def sensor_map_table(study: Study, rows: pd.DataFrame, parallel: Parallel, progress: Progress) -> pa.Table:
    """A row per image height of each plain CFA, named design and answer of the search in a scene with a field.

    CSDs are those of the response before clipping and rounding, with everything else on; of a pulsed light the
    smallest over its moments.
    """
    groups: dict[tuple[str, ...], tuple[Setup, list[int], list[FloatArray]]] = {}
    few = rows[rows["kind"].isin(FEW) & (rows["status"] == "ok")]
    for row in few.to_dict("records"):
        if study.scenarios[row["scenario"]].field is None:
            continue
        space, curves = row_curves(study, row)
        key = (str(row["scenario"]), space.cfa, *(() if space.filter is None else space.filter.channels), space.name)
        _, numbers, filters = groups.setdefault(key, (study.setup(space, key[0]), [], []))
        numbers.append(int(row["design_id"]))
        filters.append(np.asarray(curves, dtype=float))
    found: list[dict[str, float]] = []
    calls = [delayed(_over_heights, setup, numbers, np.concatenate(own)) for setup, numbers, own in groups.values()]
    for done, answer in enumerate(parallel(calls), 1):
        found += answer
        progress("places of the sensor", done, len(calls))
    names = [csd_name(pair) for pair in study.pairs]
    schema = pa.schema([("design_id", pa.int64()), *((n, pa.float64()) for n in ("height", "cra_deg", *names))])
    return pa.Table.from_pylist(sorted(found, key=lambda row: (row["design_id"], row["height"])), schema=schema)


def _over_heights(setup: Setup, numbers: list[int], curves: FloatArray) -> list[dict[str, float]]:
    """The rows of some designs of one setup."""
    field, found = setup.scene.field, []
    assert field is not None
    same = len(over_field(setup)) == 1
    distances = _smallest(setup, 0.0, curves)
    for height in np.linspace(0.0, 1.0, _HEIGHTS).tolist():
        if not same and height > 0:
            distances = _smallest(setup, height, curves)
        place = {"height": height, "cra_deg": field.cra_at(height)}
        for at, number in enumerate(numbers):
            found.append({"design_id": number, **place, **{name: float(v[at]) for name, v in distances.items()}})
    return found


def _smallest(setup: Setup, height: float, curves: FloatArray) -> dict[str, FloatArray]:
    """CSDs at one image height, DN, by their names, ndarray[n_designs] each."""
    response = smooth_response(replace(setup, scene=scene_at(setup.scene, height)), curves)
    moments = [separations(response[:, case], setup.members) for case in range(response.shape[1])]
    return {csd_name(pair): np.min([each[pair] for each in moments], axis=0) for pair in moments[0]}
