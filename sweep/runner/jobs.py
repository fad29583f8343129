"""Jobs: chunks of designs, and the rows that they give."""

from __future__ import annotations

import hashlib
import json
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

    `pareto` marks the non-dominated designs of this chunk alone; `compaction.Front` finds those of the whole table.
    """
    points = job.space.points(job.start, job.stop)
    columns, status = _quantities(job.space, setup, points, rules)
    ok = np.array([text == "ok" for text in status])
    own = job.space.violation(points)
    violation = total_violation(columns, rules.constraints, own)
    values = (
        _labels(job)
        | _how(rules.plans.get(job.scenario), len(points))
        | {name: points[:, i] for i, name in enumerate(job.space.parameters)}
        | columns
    )
    values |= {
        "violation": np.where(ok, violation, np.nan),
        "feasible": ok & (violation <= FEASIBLE),
        "pareto": _local_front(columns, own, ok, rules),
        "status": status,
    }
    return _table(values, len(points), rules.schema)


def with_local_front(table: pa.Table, job: Job, rules: Rules) -> pa.Table:
    """Rows of a job out of a whole table, `pareto` as `run_job` marks them."""
    columns = {name: table[name].to_numpy() for name in rules.columns}
    own = job.space.violation(job.space.points(job.start, job.stop))
    ok = np.array([text == "ok" for text in table["status"].to_pylist()])
    marks = pa.array(_local_front(columns, own, ok, rules))
    return table.set_column(table.schema.get_field_index("pareto"), table.schema.field("pareto"), marks)


def _local_front(columns: Mapping[str, FloatArray], own: FloatArray, ok: BoolArray, rules: Rules) -> BoolArray:
    eligible = ok & (total_violation(columns, rules.constraints, own, leave_out=rules.front) <= FEASIBLE)
    return non_dominated(np.stack([columns[name] for name in rules.front], axis=1), eligible)


def job_key(job: Job, fingerprint: str, plan: Plan | None) -> str:
    """SHA-256 of everything that a job's rows depend on; `fingerprint`: of the study, its data and the model."""
    parts = [fingerprint, "" if plan is None else plan.key, job.scenario, job.space.kind, job.space.name]
    return hashlib.sha256(json.dumps([*parts, job.start, job.stop]).encode()).hexdigest()


def failed_rows(job: Job, rules: Rules, status: str) -> pa.Table:
    """Rows of a job that could not be computed."""
    points = job.space.points(job.start, job.stop)
    values = (
        _labels(job)
        | _how(rules.plans.get(job.scenario), len(points))
        | {name: points[:, i] for i, name in enumerate(job.space.parameters)}
        | dict.fromkeys(("feasible", "pareto"), np.zeros(len(points), dtype=bool))
    )
    return _table(values | {"status": [status] * len(points)}, len(points), rules.schema)


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
