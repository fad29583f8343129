"""Jobs (chunks of designs) and their rows."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyarrow as pa

from ..base.types import IndexArray, Int
from ..camera.plan import Plan
from ..camera.setup import Setup
from ..designs.block import by_edges
from ..designs.space import Space
from ..metrics.bound import FEASIBLE, total_violation
from ..metrics.pareto import non_dominated
from ..results.dictionary import described
from ..results.identity import CHUNK
from ..results.tables import SWEPT, result_schema
from ..study import Study
from .routes import Rules, quantities_at

_MOST_CHUNKS, _LEAST_JOBS = 16, 64
_DRAWN_DESIGNS = 32
"""Designs of a job where each is evaluated with many random lamps and cameras."""


@dataclass(frozen=True)
class Job:
    """Consecutive designs of one space in one scenario."""

    space: Space
    scenario: str
    start: int
    stop: int
    first_id: int
    first_filter: int

    @property
    def size(self) -> int:
        """Number of designs."""
        return self.stop - self.start


def jobs_of(study: Study) -> Iterator[Job]:
    """Yield all jobs in the order of their rows."""
    first_id = 0
    for scenario in study.scenarios:
        first_filter = 0
        for space in study.spaces:
            size = _job_size(study, space)
            for start in range(0, space.size, size):
                stop = min(start + size, space.size)
                yield Job(space, scenario, start, stop, first_id + start, first_filter + start)
            first_id += space.size
            first_filter += space.size


def _job_size(study: Study, space: Space) -> int:
    """Return the number of designs of a job, independent of the workers; several chunks for fast designs."""
    if study.requested.wanted_yield:
        return _DRAWN_DESIGNS
    if study.states or not by_edges(space):
        return CHUNK
    return CHUNK * min(max(1, space.size // (CHUNK * _LEAST_JOBS)), _MOST_CHUNKS)


def job_key(job: Job, fingerprint: str, plan: Plan | None) -> str:
    """Return the SHA-256 of everything that a job's rows depend on."""
    parts = [fingerprint, "" if plan is None else plan.key, job.scenario, job.space.kind, job.space.name]
    return hashlib.sha256(json.dumps([*parts, job.start, job.stop]).encode()).hexdigest()


def rules_of(study: Study) -> Rules:
    """Return the rules of a study."""
    section = study.section
    return Rules(
        schema=described(result_schema(study.parameters, list(study.quantities)), study.quantities),
        requested=study.requested,
        objective=study.objective,
        constraints=study.constraints,
        front=study.trade_off,
        tolerance=study.tolerance,
        plans=study.plans,
        vision=section.vision,
        seed=section.seed,
    )


def run_job(job: Job, setup: Setup, rules: Rules) -> pa.Table:
    """Evaluate a job; a design that fails becomes a row with its status.

    `pareto` marks the non-dominated designs of this job alone, among those that meet every constraint but those on the
    front's axes; `front.RunRows` finds those of the whole table.

    `setup`: scene and camera of the job's scenario and space. Returns a row per design, of `rules.schema`.
    """
    points = job.space.points(job.start, job.stop)
    columns, issues = quantities_at(job.space, job.start, points, setup, rules)
    ok = np.ones(job.size, dtype=bool)
    ok[list(issues)] = False
    misshape = job.space.violation(points)
    violation = total_violation(columns, rules.constraints, misshape)
    eligible = ok & (total_violation(columns, rules.constraints, misshape, leave_out=rules.front) <= FEASIBLE)
    texts = dict.fromkeys(["ok"] if ok.any() else []) | dict.fromkeys(issues.values())
    numbers = {text: at for at, text in enumerate(texts)}
    status = np.zeros(job.size, dtype=np.intp)
    status[list(issues)] = [numbers[text] for text in issues.values()]
    verdicts = {
        "violation": np.where(ok, violation, np.nan),
        "feasible": ok & (violation <= FEASIBLE),
        "pareto": non_dominated(np.stack([columns[name] for name in rules.front], axis=1), eligible),
        "status": _words(list(numbers), status),
    }
    return _table(job, rules, columns | verdicts)


def failed_rows(job: Job, rules: Rules, status: str) -> pa.Table:
    """Return the rows of a job that could not be computed."""
    no = np.zeros(job.size, dtype=bool)
    return _table(job, rules, {"feasible": no, "pareto": no, "status": _word(status, job.size)})


def _table(job: Job, rules: Rules, values: Mapping[str, Any]) -> pa.Table:
    """Return the rows of a job: keys, parameters, plan and values; a missing column, and NaN, is null."""
    n, space, plan = job.size, job.space, rules.plans.get(job.scenario)
    points = space.points(job.start, job.stop)
    known: dict[str, Any] = {
        "design_id": np.arange(job.first_id, job.first_id + n),
        "filter_id": np.arange(job.first_filter, job.first_filter + n),
        "kind": _word(space.kind, n),
        "space": _word(space.name, n),
        "cfa": _word(space.cfa, n),
        "family": _word("none" if space.filter is None else space.filter.family.kind, n),
        "scenario": _word(job.scenario, n),
        **{name: points[:, i] for i, name in enumerate(space.parameters)},
        **values,
    }
    if space.kind != SWEPT:
        known["name"] = known["space"]
    if plan is not None:
        known |= {"plan": _word(plan.key, n), "promised_dn": np.full(n, plan.error_bound_dn)}

    def column(field: pa.Field) -> pa.Array:
        values_of_field = known.get(field.name)
        if values_of_field is None:
            return pa.nulls(n, field.type)
        return (
            values_of_field
            if isinstance(values_of_field, pa.Array)
            else pa.array(values_of_field, field.type, from_pandas=True)
        )

    return pa.Table.from_arrays([column(field) for field in rules.schema], schema=rules.schema)


def _word(text: str, n: int) -> pa.Array:
    """Return the same word in n rows."""
    return _words([text], np.zeros(n, dtype=np.intp))


def _words(texts: list[str], numbers: Int[IndexArray, " rows"]) -> pa.Array:
    """Return dictionary-encoded words from their indices in a list."""
    return pa.DictionaryArray.from_arrays(pa.array(numbers, pa.int32()), pa.array(texts, pa.string()))
