"""Separations over the image height of a scene with a field."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pyarrow as pa

from ...base.types import DesignCurves, delayed
from ...camera.field import field_heights, scene_at
from ...camera.setup import Setup
from ...metrics.separation import csd_name, separations
from ...metrics.smooth import smooth_response
from ...runs.analysis import Calls, named_designs, table_of_calls
from ...study import Study
from . import SENSOR_MAP

if TYPE_CHECKING:
    import pandas as pd

_HEIGHTS = 41
"""Image heights of a sensor map, in equal steps."""


def _map_schema(study: Study) -> pa.Schema:
    names = ("height", "cra_deg", *(csd_name(pair) for pair in study.pairs))
    return pa.schema([("design_id", pa.int64()), *((name, pa.float64()) for name in names)])


def _calls(study: Study, rows: pd.DataFrame) -> Calls:
    """Compute CSDs over the image height before clipping and rounding, with all other effects.

    One row per image height and design, in a scene with a field. For a pulsed light, the smallest over its moments.
    """
    for design in sorted(named_designs(study, rows), key=lambda design: int(design.row["design_id"])):
        if design.setup.scene.field is not None:
            yield design.key, delayed(_over_heights, design.setup, np.asarray(design.curves, dtype=float))


def _over_heights(setup: Setup, curves: DesignCurves) -> list[dict[str, float]]:
    """Return the rows of one design, the center of the image first."""
    field, rows = setup.scene.field, list[dict[str, float]]()
    assert field is not None
    same = len(field_heights(setup)) == 1
    for height in np.linspace(0.0, 1.0, _HEIGHTS).tolist():
        if not rows or not same:
            response = smooth_response(replace(setup, scene=scene_at(setup.scene, height)), curves)
            moments = [separations(response[:, case], setup.members) for case in range(response.shape[1])]
            csds = {csd_name(pair): float(np.min([csd[pair][0] for csd in moments])) for pair in moments[0]}
        rows.append({"height": height, "cra_deg": field.cra_at(height), **csds})
    return rows


def _has_field(study: Study) -> bool:
    return any(scene.field is not None for scene in study.scenarios.values())


TABLES = (table_of_calls(SENSOR_MAP, "field positions", _has_field, _map_schema, _calls),)
