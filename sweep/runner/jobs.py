"""Jobs: chunks of designs, and the rows that they give."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyarrow as pa

from ..arrays import BoolArray, FloatArray
from ..constraints import FEASIBLE, Bound, total_violation
from ..evaluate import WORST, evaluate, noise_quantities, shiftable
from ..imaging import imager_of
from ..objectives import COMBINED, Objective
from ..pareto import non_dominated
from ..plan import Plan
from ..problem import SHIFTS
from ..setup import Setup
from ..spaces import DIMENSIONS, Space
from ..store import result_schema
from ..study import Study

CHUNK = 4096
"""Designs of one job; fixed, so that the rows do not depend on the number of workers."""


@dataclass(frozen=True)
class Job:
    """A run of consecutive designs of one space in one scenario; `first_id` is the row id of its first design."""

    space: Space
    scenario: str
    start: int
    stop: int
    first_id: int


@dataclass(frozen=True)
class Rules:
    """What turns designs into rows: the table's schema, its quantities and the verdicts on them.

    `front`: the two quantities of the Pareto front.
    """

    schema: pa.Schema
    columns: tuple[str, ...]
    objective: Objective
    constraints: Mapping[str, Bound]
    front: tuple[str, str]
    edge_shift_nm: float
    plans: Mapping[str, Plan]
    states: tuple[str, ...]


def jobs_of(study: Study) -> Iterator[Job]:
    """All jobs in the order of their rows."""
    first_id = 0
    for scenario in study.scenarios:
        for space in study.spaces:
            for start in range(0, space.size, CHUNK):
                yield Job(space, scenario, start, min(start + CHUNK, space.size), first_id + start)
            first_id += space.size


def run_job(job: Job, setup: Setup, rules: Rules) -> pa.Table:
    """Evaluate a job; a design that fails is a row with its status, and the others of its chunk are kept.

    `pareto` marks the non-dominated designs of this chunk alone; `mark_front` finds those of the whole table.
    """
    points = job.space.points(job.start, job.stop)
    columns, status = _quantities(job.space, setup, points, rules)
    ok = np.array([text == "ok" for text in status])
    own = job.space.violation(points)
    violation = total_violation(columns, rules.constraints, own)
    eligible = ok & (total_violation(columns, rules.constraints, own, leave_out=rules.front) <= FEASIBLE)
    values = (
        _labels(job)
        | _how(rules.plans.get(job.scenario), len(points))
        | {name: points[:, i] for i, name in enumerate(job.space.parameters)}
        | columns
    )
    values |= {
        "violation": np.where(ok, violation, np.nan),
        "feasible": ok & (violation <= FEASIBLE),
        "pareto": non_dominated(np.stack([columns[name] for name in rules.front], axis=1), eligible),
        "status": status,
    }
    return _table(values, len(points), rules.schema)


def rules_of(study: Study) -> Rules:
    """The rules of a study."""
    schema = result_schema(study.parameters, study.columns)
    return Rules(
        schema,
        study.columns,
        study.objective,
        study.constraints,
        study.trade_off,
        study.edge_shift_nm,
        study.plans,
        study.states,
    )


def _columns(space: Space, setup: Setup, points: FloatArray, rules: Rules) -> dict[str, FloatArray]:
    """Every quantity of a block of designs, ndarray[n_designs] each."""
    size = setup.grid.size
    imager = imager_of(setup)
    columns = evaluate(imager, space.curves(points, size), rules.states) | space.dimensions(points)
    if rules.edge_shift_nm:
        shifts = [rules.edge_shift_nm * s for s in SHIFTS if s] if space.filter is not None else []
        cases = [columns, *(evaluate(imager, space.curves(points, size, shift)) for shift in shifts)]
        columns |= {WORST + n: np.min([case[n] for case in cases], axis=0) for n in shiftable(setup.lights)}
    if rules.objective.column == COMBINED:
        columns[COMBINED] = rules.objective.of(columns)
    return columns


def _may_lack(setup: Setup, rules: Rules) -> set[str]:
    """Quantities that a design may not have: dimensions; of a plain CFA, all that a modified channel has."""
    lacking = {*DIMENSIONS}
    if not setup.modified:
        lacking |= {"sensitivity", "slope_per_nm", "min_transmission", WORST + "sensitivity"}
        if lacking & set(rules.objective.weights):
            lacking.add(COMBINED)
    return lacking


def _quantities(
    space: Space, setup: Setup, points: FloatArray, rules: Rules
) -> tuple[dict[str, FloatArray], list[str]]:
    try:
        columns = _columns(space, setup, points, rules)
        status = ["ok"] * len(points)
    except Exception:  # whatever fails in one design must not take the others with it
        columns, status = _one_by_one(space, setup, points, rules)
    lacking = _may_lack(setup, rules)
    unbounded = set(noise_quantities(rules.states))  # a signal without noise is told apart for certain
    numbers = [
        np.where(values == np.inf, 0.0, values) if name in unbounded else values
        for name, values in columns.items()
        if name not in lacking
    ]
    for index in np.flatnonzero(~np.isfinite(numbers).all(axis=0)):
        if status[index] == "ok":
            status[index] = "not finite"
    return columns, status


def _one_by_one(
    space: Space, setup: Setup, points: FloatArray, rules: Rules
) -> tuple[dict[str, FloatArray], list[str]]:
    found: list[dict[str, FloatArray] | None] = []
    status = []
    for point in points:
        try:
            found.append(_columns(space, setup, point[None], rules))
            status.append("ok")
        except Exception as error:  # the row says what happened
            found.append(None)
            status.append(f"error: {type(error).__name__}: {error}"[:200])
    nothing = np.array([np.nan])
    return {n: np.concatenate([nothing if c is None else c[n] for c in found]) for n in rules.columns}, status


def _labels(job: Job) -> dict[str, Any]:
    n, space = job.stop - job.start, job.space
    return {
        "design_id": np.arange(job.first_id, job.first_id + n),
        "kind": [space.kind] * n,
        "name": [None if space.kind == "sweep" else space.name] * n,
        "cfa": [space.cfa] * n,
        "family": ["none" if space.filter is None else space.filter.family.kind] * n,
        "scenario": [job.scenario] * n,
    }


def _how(plan: Plan | None, n: int) -> dict[str, Any]:
    """How the scene was simulated: the plan's key and its promise."""
    return {} if plan is None else {"plan": [plan.key] * n, "promised_dn": np.full(n, plan.promised_dn)}


def _table(values: Mapping[str, Sequence[Any] | FloatArray | BoolArray], n: int, schema: pa.Schema) -> pa.Table:
    """Columns in the schema's order; a column that the space does not have is null, as is NaN."""
    arrays = [
        pa.array(values[field.name], type=field.type, from_pandas=True)
        if field.name in values
        else pa.nulls(n, field.type)
        for field in schema
    ]
    return pa.Table.from_arrays(arrays, schema=schema)


def mark_front(table: pa.Table, rules: Rules) -> pa.Table:
    """Keep `pareto` only for the non-dominated designs of each CFA and scenario, given those of each chunk.

    Both quantities are maximized. A design takes part when it meets every constraint but those on these two, so that
    the front shows the whole trade-off.
    """
    local = np.flatnonzero(table["pareto"].to_numpy())
    few = table.take(pa.array(local))
    values = np.stack([few[name].to_numpy() for name in rules.front], axis=1)
    cfa, scenario = few["cfa"].to_pylist(), few["scenario"].to_pylist()
    groups = list(zip(cfa, scenario, strict=True))
    kept = np.zeros(len(local), dtype=bool)
    for group in dict.fromkeys(groups):
        kept |= non_dominated(values, np.array([g == group for g in groups], dtype=bool))
    front = np.zeros(table.num_rows, dtype=bool)
    front[local] = kept
    return table.set_column(table.schema.get_field_index("pareto"), table.schema.field("pareto"), pa.array(front))
