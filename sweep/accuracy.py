"""What accuracy costs in time: a ladder of tolerances for every scene, promised and realized error, time and work."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa

from .arrays import FloatArray
from .effects import blur
from .evaluate import evaluate
from .figures import rendered
from .imaging import Imager
from .metrics import CSD
from .plan import Plan
from .series import draw_work_precision
from .setup import REFERENCE, Setup
from .store import write_bytes, write_table
from .study import Study

TOLERANCES_DN = (100.0, 30.0, 10.0, 3.0, 1.0, 0.3, 0.1, 0.03, 0.01, 0.003, 0.001)
TABLE, FIGURE = "accuracy.parquet", "accuracy"
_REPEATS = 3
_SHORT_S = 3.0
"""A measurement shorter than this is repeated; the median counts."""
Progress = Callable[[str, int, int], None]


def accuracy(study: Study, output: Path, progress: Progress, most_designs: int = 200) -> list[str]:
    """Measure the ladder for all scenarios, write table and figure into `output`, and say what was found.

    At most `most_designs` of each space are computed. Raises OutputError when the folder cannot be written.
    """
    table = pd.DataFrame(_ladder(study, progress, most_designs))
    write_table(pa.Table.from_pandas(table, preserve_index=False), output / TABLE)
    for kind in ("png", "svg"):
        write_bytes(rendered(draw_work_precision(table, study.name), kind), output / f"{FIGURE}.{kind}")
    return [*_lines(table), f"Files: {output}/: {TABLE}, {FIGURE}.png, {FIGURE}.svg."]


def _ladder(study: Study, progress: Progress, most_designs: int) -> Iterator[dict[str, Any]]:
    done, total = 0, len(study.scenarios) * (len(TOLERANCES_DN) + 1)
    for scenario in study.scenarios:
        exact, reference_s, reference_work = _timed(study, scenario, most_designs)
        done += 1
        progress("measurements", done, total)
        measured: dict[str, tuple[FloatArray, float, int]] = {}
        for tolerance in TOLERANCES_DN:
            plan = study.plan(scenario, tolerance)
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
    setups = [(space, study.setup(space, scenario)) for space in study.spaces if space.size]
    if scenario not in study.plans:
        setups = [(space, replace(setup, methods=REFERENCE)) for space, setup in setups]
    times = []
    while True:
        blur.profile.cache_clear()
        started = time.perf_counter()
        found, work = [], Counter[str]()
        for space, setup in setups:
            points = space.points(0, min(space.size, most_designs))
            found.append(_csds(setup, space.curves(points, study.grid.size), work))
        times.append(time.perf_counter() - started)
        if len(times) == _REPEATS or sum(times) > _SHORT_S:
            return np.concatenate(found, axis=1), float(np.median(times)), sum(work.values())


def _csds(setup: Setup, curves: FloatArray, work: Counter[str]) -> FloatArray:
    """All CSDs, ndarray[n_pairs, n_designs]."""
    columns = evaluate(Imager(setup, work), curves)
    return np.stack([values for name, values in columns.items() if name.startswith(CSD)])


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
