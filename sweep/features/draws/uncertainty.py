"""Separations and light of designs if the sensor's curves are not known exactly: quantiles over random sensors."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pyarrow as pa

from ...base.types import Array, ChannelCurves, Float, PerSample, PerValue, delayed
from ...camera.curve_errors import CurveErrors, linear_in_filter
from ...camera.linear import linear_model
from ...camera.scene import WhitePatchExposure
from ...camera.setup import Setup
from ...metrics.separation import csd_name
from ...metrics.smooth import smooth_csd
from ...results.tables import REFERENCE, RGGB
from ...runs.analysis import RunTable, Shown, named_designs
from ...runs.workers import run_with_progress
from ...spectra.lights import Pair, class_pairs
from . import UNCERTAINTY

SHARES = (0.05, 0.5, 0.95)
"""CFA that others are compared with; the first plain one where a study does not have it."""
_CONFIDENCE = 0.95
_TOGETHER = 200
"""Draws that are computed at once."""
_KEYS = ("design_id", "name", "scenario", "quantity")
_ENDS = [f"{share * 100:g}{end}" for share in SHARES for end in ("", "_low", "_high")]
_COLUMNS = [f"{of}_{end}" for of in ("dn", "ratio", "light_ratio") for end in _ENDS]
_SCHEMA = pa.schema(
    [("design_id", pa.int64()), *((name, pa.string()) for name in _KEYS[1:]), ("reference", pa.string())]
    + [(name, pa.float64()) for name in _COLUMNS]
    + [(name, pa.float64()) for name in ("ratio_sd", "light_ratio_sd", "correlation", "at_least_dn")]
)


def _table(shown_rows: Shown) -> pa.Table:
    """Compute quantiles of CSDs before clipping and rounding, and of their ratios to a reference CFA.

    One row per plain CFA, named design and answer, scenario and pair of signal types. `dn_5`, `dn_50`, `dn_95`: CSD
    that so many percent of the random sensors fall below, DN, with 95 % intervals (`_low`, `_high`) of the quantiles
    of all sensors; `ratio_...` and `light_ratio_...`: the same of CSD and light relative to the `reference` on the same
    sensor; `ratio_sd`, `light_ratio_sd`, `correlation`: deviations of both ratios and their correlation. `at_least_dn`:
    no sensor within the errors has less; only where curves have neither shifts.
    """
    study = shown_rows.study
    errors = study.section.uncertainty
    assert errors is not None
    shown, calls = [], []
    for design in named_designs(study, shown_rows.rows):
        shown.append(design.row)
        calls.append(delayed(_on_sensors, design.setup.with_all_effects, design.curves[0], study.section.seed))
    drawn_sensors = [*run_with_progress(shown_rows.parallel, calls, "random sensors", shown_rows.progress)]
    plain = [row for row in shown if row["kind"] == REFERENCE] or shown
    names = [row["name"] for row in plain]
    reference = RGGB if RGGB in names else next(iter(names), RGGB)
    of_reference = {
        row["scenario"]: sensors for row, sensors in zip(shown, drawn_sensors, strict=True) if row["name"] == reference
    }
    table_rows = []
    for row, (csds, light, least) in zip(shown, drawn_sensors, strict=True):
        beside = of_reference.get(row["scenario"])
        for pair in class_pairs(study.lights.classes):
            values = {"dn": csds[pair]}
            if beside is not None:
                with np.errstate(divide="ignore", invalid="ignore"):
                    values |= {"ratio": csds[pair] / beside[0][pair], "light_ratio": light / beside[1]}
            table_rows.append(
                {name: row[name] for name in _KEYS[:3]}
                | {"quantity": csd_name(pair), "reference": reference, "at_least_dn": least.get(pair)}
                | {key: value for of, drawn in values.items() for key, value in _quantiles(of, drawn).items()}
                | (_spread(values["ratio"], values["light_ratio"]) if beside is not None else {})
            )
    return pa.Table.from_pylist(table_rows, schema=_SCHEMA)


def _on_sensors(
    setup: Setup, curves: ChannelCurves, seed: int
) -> tuple[dict[Pair, PerValue], PerValue, dict[Pair, float]]:
    """Return CSDs by pair and the mean QE of the tile on every sensor, and lower bounds where there are some."""
    camera, pairs = setup.camera, class_pairs(setup.lights.classes)
    assert camera.uncertain is not None
    drawn, errors = camera.uncertain.drawn(camera.grid, [seed]), camera.uncertain.errors
    for channel, curve in zip(camera.modified, curves, strict=True):
        weights, rest = linear_in_filter(drawn[:, channel], camera.qe[channel])
        drawn[:, channel] = weights * curve + rest
    designed = camera.qe.copy()
    designed[list(camera.modified)] = curves
    free = setup.with_camera(modified=tuple(range(len(designed))), qe=designed)
    parts = [slice(start, start + _TOGETHER) for start in range(0, len(drawn), _TOGETHER)]
    csds = {pair: np.concatenate([smooth_csd(free, drawn[part], pair) for part in parts]) for pair in pairs}
    counts = camera.mosaic.counts
    light = camera.grid.integrate(drawn) @ (counts / counts.sum())
    return csds, light, {pair: _at_least(free, designed, pair, errors) for pair in pairs} if errors.linear else {}


def _at_least(setup: Setup, designed: ChannelCurves, pair: Pair, errors: CurveErrors) -> float:
    """Return a lower bound on the CSD with any gains and noise within their errors.

    A channel's difference is the sum over curves c of (1 + g) (S + v) with S = sum of c(l) d(l) and |v| <= A sum of
    c(l) |d(l)|; it is no nearer to 0 than |sum of S| less the sum of A |d| c (1 + G) + G |S|. An exposure for the white
    patch is no shorter than 1 / (1 + G)(1 + A) of that of the curves as stated.
    """
    model = linear_model(setup)
    first, second = (setup.members[name] for name in pair)
    middle: Any = 0.0
    radius: Any = 0.0
    for number, curve in enumerate(designed):
        per_qe = model.per_qe(number, designed)  # [n_cases, n_signals, n_elements, n_wavelengths]
        d = per_qe[:, first][:, :, None] - per_qe[:, second][:, None]
        of_curve, spread = d @ curve, errors.noise * (np.abs(d) @ curve)
        middle, radius = middle + of_curve, radius + spread * (1 + errors.gain) + errors.gain * np.abs(of_curve)
    distance = np.maximum(np.abs(middle) - radius, 0.0)
    least = float(np.sqrt((distance**2).sum(axis=-1)).min())
    is_fixed = not isinstance(setup.scene.exposure, WhitePatchExposure)
    return least / (1.0 if is_fixed else (1 + errors.gain) * (1 + errors.noise))


def quantile(values: PerSample, share: float) -> tuple[float, float, float]:
    """Return a quantile with a distribution-free 95 % interval (order statistics)."""
    from scipy.stats import binom  # noqa: PLC0415  (slow to import: kept off the start-up path)

    ordered, n = np.sort(values), values.size
    ranks = math.ceil(share * n), *binom.ppf([(1 - _CONFIDENCE) / 2, (1 + _CONFIDENCE) / 2], n, share)
    at = [min(max(int(rank) - 1 + step, 0), n - 1) for rank, step in zip(ranks, (0, 0, 1), strict=True)]
    value, low, high = (float(ordered[i]) for i in at)
    return value, low, high


def _quantiles(of: str, values: PerSample) -> dict[str, float]:
    """Return the quantiles of a column with their intervals."""
    columns = [f"{of}_{end}" for end in _ENDS]
    return dict(zip(columns, (end for share in SHARES for end in quantile(values, share)), strict=True))


def _spread(ratio: Float[Array, " draws"], light: Float[Array, " captures"]) -> dict[str, float]:
    """Return the deviations of two ratios and their correlation; 0 where one does not change."""
    deviations = float(ratio.std()), float(light.std())
    known = min(deviations) > 0 and bool(np.isfinite(ratio).all())
    correlation = float(np.corrcoef(ratio, light)[0, 1]) if known else 0.0
    return dict(zip(("ratio_sd", "light_ratio_sd", "correlation"), (*deviations, correlation), strict=True))


RANDOM_SENSORS = RunTable(UNCERTAINTY, lambda study: study.section.uncertainty is not None, _table)
