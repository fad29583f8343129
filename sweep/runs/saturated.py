"""Signals that fill a pixel, for each row that a report tells of."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pyarrow as pa

from ..base.types import DesignCurves, delayed
from ..camera.model import scene_model
from ..camera.setup import Setup
from ..results.tables import SATURATED
from ..study import Study
from .analysis import Calls, named_designs, table_of_calls

if TYPE_CHECKING:
    import pandas as pd

_SCHEMA = pa.schema([("design_id", pa.int64()), ("full_signals", pa.int64()), ("signals", pa.int64())])


def _calls(study: Study, rows: pd.DataFrame) -> Calls:
    for design in named_designs(study, rows):
        yield design.key, delayed(_full_signals, design.setup, design.curves)


def _full_signals(setup: Setup, curves: DesignCurves) -> list[dict[str, int]]:
    """Count the signals of a design that fill a pixel of any channel in any case; of an HDR pixel, all captures."""
    full = np.zeros(len(setup.lights.names), dtype=bool)
    for lamps in scene_model(setup.over_brightness).lamps(curves):
        full |= lamps.full
    return [{"full_signals": int(full.sum()), "signals": full.size}]


SATURATION = table_of_calls(SATURATED, "signals that fill a pixel", lambda _: True, lambda _: _SCHEMA, _calls)
