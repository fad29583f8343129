"""Lamps of unknown intensity: how near a signal comes to those of another type at any intensity of a series."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa

from ..base.types import FloatArray, IndexArray, Parallel, Progress, delayed
from ..camera.forward import forward_model
from ..camera.noise.gaussian import share_below
from ..camera.setup import Setup
from ..results.designs import rows_of_series
from ..spectra.lights import class_pairs
from ..study import Study
from .workers import run_with_progress

if TYPE_CHECKING:
    import pandas as pd

INTENSITY = "intensity_cd"
_LEAST = 1e-12
"""Variance below which a channel has none, DN^2."""
_TEXTS = ("signal_type", "signal", "other_type", "other")
_SCHEMA = pa.schema(
    [(name, pa.string()) for name in ("name", "series")]
    + [(name, pa.float64()) for name in (INTENSITY, "dprime", "error")]
    + [(name, pa.string()) for name in _TEXTS]
    + [("other_cd", pa.float64())]
)


def any_intensity_table(study: Study, rows: pd.DataFrame, parallel: Parallel, progress: Progress) -> pa.Table:
    """Find how well a signal is told from signals of the other states whose intensity is not known.

    One row per series of scenarios that differ in intensity, design and intensity: the smallest d' of a signal of that
    intensity from one of another state at any intensity of the series (`other_cd`), for the two signals with the
    least, and the `error` of Gaussians at that d', Q(d' / 2). Between two intensities mean and variance of the other
    signal are interpolated linearly.

    Parameters
    ----------
    study : Study
        Study of the run, with states that noise may confuse.
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
        if key == INTENSITY:
            setups = [study.setup(space, scenario) for scenario in scenarios]
            members = {name: setups[0].members[name] for name in study.states}
            keys.append({"name": row["name"], "series": series})
            calls.append(delayed(_nearest, setups, curves, np.array([*scenarios.values()]), members))
    answers = run_with_progress(parallel, calls, "lamps of any intensity", progress)
    made = [key | row for key, rows_of_design in zip(keys, answers, strict=True) for row in rows_of_design]
    return pa.Table.from_pylist(made, schema=_SCHEMA)


def _nearest(
    setups: Sequence[Setup], curves: FloatArray, intensity_cd: FloatArray, members: Mapping[str, IndexArray]
) -> list[dict[str, Any]]:
    """Return rows of the table without their keys."""
    read = [forward_model(setup).read_with_noise(curves) for setup in setups]
    mean, variance = (np.stack([getattr(one, what)[0] for one in read]) for what in ("mean", "variance"))
    names, made = setups[0].lights.names, []
    for at, cd in enumerate(intensity_cd):
        least: dict[str, Any] = {"dprime": np.inf}
        for pair in class_pairs(list(members)):
            for kind, other in (pair, pair[::-1]):
                for case in range(mean.shape[1]):
                    points = mean[at, case, members[kind]], variance[at, case, members[kind]]
                    lines = mean[:, case, members[other]], variance[:, case, members[other]]
                    dprime, share = detectability_from_lines(*points, *lines)
                    one, segment, another = np.unravel_index(int(dprime.argmin()), dprime.shape)
                    if dprime[one, segment, another] < least["dprime"]:
                        low, high = intensity_cd[segment : segment + 2]
                        least = {
                            "dprime": float(dprime[one, segment, another]),
                            "signal_type": kind,
                            "signal": names[members[kind][one]],
                            "other_type": other,
                            "other": names[members[other][another]],
                            "other_cd": float(low + share[one, segment, another] * (high - low)),
                        }
        made.append({INTENSITY: float(cd), "error": float(share_below(np.array(-least["dprime"] / 2))), **least})
    return made


def detectability_from_lines(
    mean: FloatArray, variance: FloatArray, line_mean: FloatArray, line_variance: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the smallest d' of points from each segment of lines.

    Parameters
    ----------
    mean, variance : ndarray of shape (n_points, n_channels)
        Mean, DN, and variance, DN^2, of points.
    line_mean, line_variance : ndarray of shape (n_steps, n_lines, n_channels)
        The same along lines.

    Returns
    -------
    dprime : ndarray of shape (n_points, n_steps - 1, n_lines)
        d' from the point of the segment that is nearest in units of the mean of both variances.
    share : ndarray of the same shape
        Where on the segment that is, 0 to 1.
    """
    start, step = line_mean[:-1], np.diff(line_mean, axis=0)
    middle = (line_variance[:-1] + line_variance[1:]) / 2
    weight = 2 / np.maximum(variance[:, None, None] + middle, _LEAST)
    away = mean[:, None, None] - start
    length = (weight * step**2).sum(axis=-1)
    share = np.divide((weight * away * step).sum(axis=-1), length, out=np.zeros_like(length), where=length > 0)
    share = np.clip(share, 0.0, 1.0)[..., None]
    there = line_variance[:-1] * (1 - share) + line_variance[1:] * share
    squared = 2 * (away - share * step) ** 2 / np.maximum(variance[:, None, None] + there, _LEAST)
    return np.sqrt(squared.sum(axis=-1)), share[..., 0]
