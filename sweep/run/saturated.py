"""Signals that fill a pixel, for each row that a report tells of."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pyarrow as pa

from ..base.types import DesignCurves, Parallel, Progress, delayed
from ..camera.forward import forward_model
from ..camera.setup import Setup
from ..results.designs import named_rows, row_curves
from ..study import Study
from .workers import run_with_progress

if TYPE_CHECKING:
    import pandas as pd

_SCHEMA = pa.schema([("design_id", pa.int64()), ("full_signals", pa.int64()), ("signals", pa.int64())])


def saturated_table(study: Study, rows: pd.DataFrame, parallel: Parallel, progress: Progress) -> pa.Table:
    """Count the signals that fill a pixel of any channel, for plain CFAs, named designs and the answer."""
    ids, calls = [], []
    for row in named_rows(rows):
        space, curves = row_curves(study, row)
        ids.append(row["design_id"])
        calls.append(delayed(full_signals, study.setup(space, row["scenario"]), curves))
    counts = list(run_with_progress(parallel, calls, "signals that fill a pixel", progress))
    return pa.table([ids, counts, [len(study.lights.names)] * len(ids)], schema=_SCHEMA)


def full_signals(setup: Setup, curves: DesignCurves) -> int:
    """Return how many signals of a design fill a pixel in any case; of an HDR pixel, its last capture, too."""
    full = np.zeros(len(setup.lights.names), dtype=bool)
    for lamps in forward_model(setup.over_brightness).lamps(curves):
        full |= lamps.full
    return int(full.sum())
