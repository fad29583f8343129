"""What accuracy costs in time: tolerances and single settings, promised and realized error, time and work, a report."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa

from ...base.types import FloatArray, Progress
from ...camera.forward import ForwardModel
from ...camera.methods import REFERENCE
from ...camera.plan.plan import Plan
from ...camera.view import View
from ...curves.lights import class_pairs
from ...metrics.evaluate import evaluate
from ...metrics.separation import csd_name
from ...report.figures import rendered
from ...report.series import draw_knobs, draw_work_precision
from ...results.atomic import write_bytes
from ...results.tables import write_table
from ...study import Study
from .knobs import Regridded, Setting, knob_measurements
from .payments import PAID_AT_DN, Payment, cpu_s, one_design, payments
from .report import AccuracyReport, make_accuracy_report, read_hard_cases

TOLERANCES_DN = (100.0, 30.0, 10.0, 3.0, 1.0, 0.3, 0.1, 0.03, 0.01, 0.003, 0.001)
TABLE, FIGURE = "accuracy.parquet", "accuracy"
PAID_TABLE = "plans.parquet"
KNOBS_TABLE, KNOBS_FIGURE = "knobs.parquet", "knobs"
_KNOB_DESIGNS = 50
_REPEATS = 3


def measure_accuracy(
    study: Study,
    regridded: Regridded,
    output: Path,
    progress: Progress,
    most_designs: int = 200,
    others: Sequence[Study] = (),
) -> list[str]:
    """Measure the ladder for all scenarios, and every knob; write tables, figures and a report, and say what was found.

    What plans of the study, and of `others`, cost and save as they run, is a table, too. At most `most_designs` of each
    space are computed in a ladder; `regridded` gives the study with another wavelength step. A table of hard cases that
    lies in `output` goes into the report. Raises OutputError when the folder cannot be written.
    """
    hard = read_hard_cases(output)
    table = pd.DataFrame(_ladder(study, progress, most_designs))
    settings: list[Setting] = []
    measurements = knob_measurements(study, regridded, min(most_designs, _KNOB_DESIGNS))
    for done, measure in enumerate(measurements):
        settings += measure()
        progress("knobs", done + 1, len(measurements))
    knobs = pd.DataFrame([asdict(setting) for setting in settings])
    paid = pd.DataFrame([asdict(payment) | {"factor": payment.factor} for payment in _paid([study, *others], progress)])
    write_table(pa.Table.from_pandas(paid, preserve_index=False), output / PAID_TABLE)
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
    shown = AccuracyReport(study.name, study.section.question, lines, images, table, paid, knobs, hard)
    make_accuracy_report(output, shown)
    files = f"accuracy.html, {TABLE}, {FIGURE}.png, {PAID_TABLE}, {KNOBS_TABLE}, {KNOBS_FIGURE}.png"
    return [*lines, f"Files: {output}/: {files}."]


def _ladder(study: Study, progress: Progress, most_designs: int) -> Iterator[dict[str, Any]]:
    """Rows of all scenes: of one design, and of all of them."""
    kinds = (one_design(study), study) if sum(space.size for space in study.spaces) > 1 else (study,)
    done, total = 0, len(study.scenarios) * len(kinds)
    for scenario in study.scenarios:
        for own in kinds:
            yield from _steps(own, scenario, most_designs)
            done += 1
            progress("measurements", done, total)


def _steps(study: Study, scenario: str, most_designs: int) -> Iterator[dict[str, Any]]:
    """A row for each tolerance; the plan is the cheapest, looked for however long that takes."""
    exact, reference_s, reference_work = _timed(study, scenario, most_designs)
    measured: dict[str, tuple[FloatArray, float, int]] = {}
    for tolerance in TOLERANCES_DN:
        plan_s = cpu_s(partial(study.plan, scenario, tolerance, always=True), 1)
        plan = study.plan(scenario, tolerance, always=True)
        if plan.key not in measured:  # the same plan is the same work
            measured[plan.key] = _timed(replace(study, plans={scenario: plan}), scenario, most_designs)
        found, seconds, work = measured[plan.key]
        yield {
            "scenario": scenario,
            "designs": exact.shape[1],
            "tolerance_dn": tolerance,
            "plan": plan.key,
            "computed": _computed(plan),
            "promised_dn": plan.promised_dn,
            "realized_dn": float(np.abs(found - exact).max()),
            "plan_s": plan_s,
            "seconds": seconds,
            "work": work,
            "reference_s": reference_s,
            "reference_work": reference_work,
        }


def _timed(study: Study, scenario: str, most_designs: int) -> tuple[FloatArray, float, int]:
    """CSDs of the scenario's designs, the CPU time they take with their kernels, s, and the operations counted."""
    views = [(space, study.view(space, scenario)) for space in study.spaces if space.size]
    if scenario not in study.plans:
        views = [(space, replace(view, methods=REFERENCE)) for space, view in views]
    found: list[FloatArray] = []
    work = Counter[str]()

    def computed() -> None:
        found.clear()
        work.clear()
        for space, view in views:
            points = space.points(0, min(space.size, most_designs))
            found.append(_csds(view, space.curves(points, study.grid.size), work))

    seconds = cpu_s(computed, _REPEATS)
    return np.concatenate(found, axis=1), seconds, sum(work.values())


def _csds(view: View, curves: FloatArray, work: Counter[str]) -> FloatArray:
    """All CSDs, ndarray[n_pairs, n_designs]."""
    columns = evaluate(ForwardModel(view, work), curves)
    return np.stack([columns[csd_name(pair)] for pair in class_pairs(view.lights.classes)])


def _computed(plan: Plan) -> str:
    return "; ".join(f"{c.effect}: {c.method}" for c in plan.choices if c.effect in plan.computed)


def _lines(table: pd.DataFrame) -> list[str]:
    """A line per scenario for a few tolerances, plan and run together, and whether every promise was kept."""
    lines = []
    for (scenario, designs), rows in table.groupby(["scenario", "designs"], sort=False):
        shown = rows[rows["tolerance_dn"].isin(PAID_AT_DN)]
        speedups = (
            (row["tolerance_dn"], row["reference_s"] / (row["plan_s"] + row["seconds"]))
            for row in shown.to_dict("records")
        )
        steps = ", ".join(f"{tolerance:g} DN {speedup:.3g}x" for tolerance, speedup in speedups)
        which = "1 design" if designs == 1 else f"{designs:,} designs"
        lines.append(f"{scenario}, {which}: everything on {rows['reference_s'].iloc[0]:.2g} s; faster at {steps}.")
    kept = table["realized_dn"] <= table["promised_dn"] * (1 + 1e-9) + 1e-9
    return [*lines, f"{kept.sum()} of {len(table)} realized errors are within their promise."]


def _paid(studies: Sequence[Study], progress: Progress) -> list[Payment]:
    """Payments of a few scenes of each study: the first, the middle and the last one."""
    found: list[Payment] = []
    for done, study in enumerate(studies):
        names = list(study.scenarios)
        few = dict.fromkeys((names[0], names[len(names) // 2], names[-1]))
        if any(space.size for space in study.spaces):
            found += payments(study, list(few), PAID_AT_DN, _REPEATS)
        progress("studies", done + 1, len(studies))
    return found
