"""What accuracy costs in time: tolerances and single settings, promised and realized error, time and work, a report."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa

from ...camera.effects import blur
from ...camera.imager import Imager
from ...camera.methods import REFERENCE
from ...camera.places import forget_geometries
from ...camera.plan.plan import Plan
from ...camera.view import View
from ...curves.lights import class_pairs
from ...metrics.evaluate import evaluate
from ...metrics.separation import csd_name
from ...report.figures import rendered
from ...report.series import draw_knobs, draw_work_precision
from ...results.tables import write_bytes, write_table
from ...study import Study
from ...types import FloatArray, Progress
from .knobs import Regridded, Setting, knob_measurements
from .report import AccuracyReport, make_accuracy_report, read_hard_cases

TOLERANCES_DN = (100.0, 30.0, 10.0, 3.0, 1.0, 0.3, 0.1, 0.03, 0.01, 0.003, 0.001)
TABLE, FIGURE = "accuracy.parquet", "accuracy"
KNOBS_TABLE, KNOBS_FIGURE = "knobs.parquet", "knobs"
_KNOB_DESIGNS = 50
_REPEATS = 3
_SHORT_S = 3.0
"""A measurement shorter than this is repeated; the median counts."""


def measure_accuracy(
    study: Study, regridded: Regridded, output: Path, progress: Progress, most_designs: int = 200
) -> list[str]:
    """Measure the ladder for all scenarios, and every knob; write tables, figures and a report, and say what was found.

    At most `most_designs` of each space are computed; `regridded` gives the study with another wavelength step. A
    table of hard cases that lies in `output` goes into the report. Raises OutputError when the folder cannot be
    written.
    """
    hard = read_hard_cases(output)
    table = pd.DataFrame(_ladder(study, progress, most_designs))
    settings: list[Setting] = []
    measurements = knob_measurements(study, regridded, min(most_designs, _KNOB_DESIGNS))
    for done, measure in enumerate(measurements):
        settings += measure()
        progress("knobs", done + 1, len(measurements))
    knobs = pd.DataFrame([asdict(setting) for setting in settings])
    figures = {}
    for name, file, rows, figure in (
        (TABLE, FIGURE, table, draw_work_precision(table, study.name)),
        (KNOBS_TABLE, KNOBS_FIGURE, knobs, draw_knobs(knobs, study.name)),
    ):
        write_table(pa.Table.from_pandas(rows, preserve_index=False), output / name)
        figures[file] = {kind: rendered(figure, kind) for kind in ("png", "svg")}
        for kind, content in figures[file].items():
            write_bytes(content, output / f"{file}.{kind}")
    lines = _lines(table)
    if hard is not None:
        passed = int((hard["error"] <= hard["allowed"]).sum())
        lines.append(f"{passed} of {len(hard)} hard cases are within their allowed error.")
    images = {name: files["png"] for name, files in figures.items()}
    make_accuracy_report(output, AccuracyReport(study.name, study.section.question, lines, images, table, knobs, hard))
    return [*lines, f"Files: {output}/: accuracy.html, {TABLE}, {FIGURE}.png, {KNOBS_TABLE}, {KNOBS_FIGURE}.png."]


def _ladder(study: Study, progress: Progress, most_designs: int) -> Iterator[dict[str, Any]]:
    done, total = 0, len(study.scenarios) * (len(TOLERANCES_DN) + 1)
    for scenario in study.scenarios:
        exact, reference_s, reference_work = _timed(study, scenario, most_designs)
        done += 1
        progress("measurements", done, total)
        measured: dict[str, tuple[FloatArray, float, int]] = {}
        for tolerance in TOLERANCES_DN:
            plan = study.plan(scenario, tolerance, always=True)
            if plan.key not in measured:  # the same plan is the same work
                measured[plan.key] = _timed(replace(study, plans={scenario: plan}), scenario, most_designs)
            found, seconds, work = measured[plan.key]
            done += 1
            progress("measurements", done, total)
            yield {
                "scenario": scenario,
                "tolerance_dn": tolerance,
                "plan": plan.key,
                "computed": _computed(plan),
                "promised_dn": plan.promised_dn,
                "realized_dn": float(np.abs(found - exact).max()),
                "seconds": seconds,
                "work": work,
                "reference_s": reference_s,
                "reference_work": reference_work,
            }


def _timed(study: Study, scenario: str, most_designs: int) -> tuple[FloatArray, float, int]:
    """CSDs of the scenario's designs, the time they take with their kernels, and the operations counted."""
    views = [(space, study.view(space, scenario)) for space in study.spaces if space.size]
    if scenario not in study.plans:
        views = [(space, replace(view, methods=REFERENCE)) for space, view in views]
    times = []
    while True:
        blur.PROFILES.clear()
        forget_geometries()
        started = time.perf_counter()
        found, work = [], Counter[str]()
        for space, view in views:
            points = space.points(0, min(space.size, most_designs))
            found.append(_csds(view, space.curves(points, study.grid.size), work))
        times.append(time.perf_counter() - started)
        if len(times) == _REPEATS or sum(times) > _SHORT_S:
            return np.concatenate(found, axis=1), float(np.median(times)), sum(work.values())


def _csds(view: View, curves: FloatArray, work: Counter[str]) -> FloatArray:
    """All CSDs, ndarray[n_pairs, n_designs]."""
    columns = evaluate(Imager(view, work), curves)
    return np.stack([columns[csd_name(pair)] for pair in class_pairs(view.lights.classes)])


def _computed(plan: Plan) -> str:
    return "; ".join(f"{c.effect}: {c.method}" for c in plan.choices if c.effect in plan.computed)


def _lines(table: pd.DataFrame) -> list[str]:
    """A line per scenario for a few tolerances, and whether every promise was kept."""
    lines = []
    for scenario, rows in table.groupby("scenario", sort=False):
        shown = rows[rows["tolerance_dn"].isin([10.0, 1.0, 0.1, 0.01])]
        speedups = [(row["tolerance_dn"], row["reference_s"] / row["seconds"]) for row in shown.to_dict("records")]
        steps = ", ".join(f"{tolerance:g} DN {speedup:.3g}x" for tolerance, speedup in speedups)
        lines.append(f"{scenario}: everything on {rows['reference_s'].iloc[0]:.2g} s; faster at {steps}.")
    kept = table["realized_dn"] <= table["promised_dn"] * (1 + 1e-9) + 1e-9
    return [*lines, f"{kept.sum()} of {len(table)} realized errors are within their promise."]
