"""Handovers of an HDR pixel: the number of a series at which a capture is full."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa

from ..base.types import FloatArray, Parallel, Progress, delayed
from ..camera.linear import linear_model
from ..camera.merge import limits_dn
from ..camera.setup import Setup
from ..results.designs import rows_of_series
from ..study import Study
from .workers import run_with_progress

if TYPE_CHECKING:
    import pandas as pd

_SCHEMA = pa.schema(
    [(name, pa.string()) for name in ("name", "series", "key", "channel", "signal_type")]
    + [("capture", pa.int64()), ("at", pa.float64())]
)


def handovers_table(study: Study, rows: pd.DataFrame, parallel: Parallel, progress: Progress) -> pa.Table:
    """Find where the median signal of each type fills the captures of each channel.

    One row per series of scenarios (`series`, `key`), design, channel, signal type and capture (from 1 on): `at` is the
    number at which the expected reading reaches the capture's threshold, or saturation for the last one; -inf or inf if
    it is below or above all numbers of the series. Between two scenarios it is interpolated in the logarithms, which is
    exact for intensity and exposure without background and dark current.

    Parameters
    ----------
    study : Study
        Study of the run, of an HDR pixel.
    rows : pandas.DataFrame
        Rows of plain CFAs, named designs and the answer.
    parallel : callable
        Runs calls on the cores.
    progress : callable
        Called with a phase, work done and work in total.

    Returns
    -------
    pyarrow.Table
        Table.
    """
    keys, calls = [], []
    for series, key, scenarios, row, curves, space in rows_of_series(study, rows):
        setups = [study.setup(space, scenario) for scenario in scenarios]
        keys.append({"name": row["name"], "series": series, "key": key})
        calls.append(delayed(_handovers, setups, curves, np.array([*scenarios.values()])))
    answers = run_with_progress(parallel, calls, "handovers of captures", progress)
    made = [key | row for key, rows_of_design in zip(keys, answers, strict=True) for row in rows_of_design]
    return pa.Table.from_pylist(made, schema=_SCHEMA)


def _handovers(setups: Sequence[Setup], curves: FloatArray, numbers: FloatArray) -> list[dict[str, Any]]:
    """Return rows of the table without their keys."""
    setup, pixel = setups[0], setups[0].camera.pixel
    expected_e = []
    for scene in setups:
        model = linear_model(scene)
        dn = model.smooth(curves)[0].mean(axis=0)  # over sampling phases, field positions and moments of a pulse
        expected_e.append((dn - model.setup.camera.pixel.offset_dn) / model.setup.camera.pixel.dn_per_e)
    of_scenes, made = np.stack(expected_e), []
    for at, channel in enumerate(setup.camera.mosaic.channels):
        for kind, members in setup.members.items():
            typical_e = np.median(of_scenes[:, members, at], axis=1)
            for number, (capture, one, limit) in enumerate(
                zip(pixel.captures, pixel.read_as, limits_dn(pixel), strict=True), 1
            ):
                full_e = one.saturation_e if limit is None else (limit - one.offset_dn) / one.dn_per_e
                share = full_e / (capture.light * capture.qe_factor.get(channel, 1.0))
                row = {"channel": channel, "signal_type": kind, "capture": number}
                made.append(row | {"at": _reached(numbers, typical_e, share)})
    return made


def _reached(numbers: FloatArray, values: FloatArray, limit: float) -> float:
    """Return the first number at which ascending values reach a limit."""
    above = values >= limit
    if not above.any():
        return float("inf")
    at = int(above.argmax())
    if at == 0:
        return float("-inf")
    if min(values[at - 1], numbers[at - 1]) > 0:
        share = np.log(limit / values[at - 1]) / np.log(values[at] / values[at - 1])
        return float(numbers[at - 1] * (numbers[at] / numbers[at - 1]) ** share)
    share = (limit - values[at - 1]) / (values[at] - values[at - 1])
    return float(numbers[at - 1] + share * (numbers[at] - numbers[at - 1]))
