"""Jobs: chunks of designs, and the rows that they give."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyarrow as pa

from ..base.types import BoolArray, FloatArray, IndexArray
from ..camera.plan import Plan
from ..camera.setup import Setup
from ..designs.block import by_edges
from ..designs.space import Space
from ..metrics.bound import FEASIBLE, Bound, total_violation
from ..metrics.pareto import non_dominated
from ..results.dictionary import described
from ..results.identity import CHUNK
from ..results.tables import result_schema
from ..study import Study
from .routes import Request, found_of

_WORDS = pa.dictionary(pa.int32(), pa.string())
_MOST_CHUNKS, _LEAST_JOBS = 16, 64
_DRAWN_DESIGNS = 32
"""Of a job where each design is seen by many random lamps and cameras."""
_SPENT = b"cfa_sweep_spent_s"


@dataclass(frozen=True)
class Job:
    """A run of consecutive designs of one space in one scenario.

    `first_id`: the row id of its first design; `first_filter`: the number of its filter, the same in every scenario.
    """

    space: Space
    scenario: str
    start: int
    stop: int
    first_id: int
    first_filter: int


@dataclass(frozen=True)
class Rules:
    """What turns designs into rows: the table's schema, what is wanted of designs and the verdicts on them.

    `front`: the two quantities of the Pareto front, whose constraints the designs on it need not meet.
    """

    schema: pa.Schema
    request: Request
    constraints: Mapping[str, Bound]
    front: tuple[str, str]
    plans: Mapping[str, Plan]

    @property
    def order(self) -> tuple[str, ...]:
        """Quantities that say which design is best, the first one first, all maximized."""
        return (self.request.objective.column, *self.front)


def jobs_of(study: Study) -> Iterator[Job]:
    """All jobs in the order of their rows."""
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
    """Designs of a job: several chunks where many designs cost next to nothing, so that a job is not mostly overhead.

    It does not depend on the workers, and so neither do the rows.
    """
    if study.asked.wanted_yield:
        return _DRAWN_DESIGNS
    if study.states or not by_edges(space):
        return CHUNK
    return CHUNK * min(max(1, space.size // (CHUNK * _LEAST_JOBS)), _MOST_CHUNKS)


def run_job(job: Job, setup: Setup, rules: Rules) -> pa.Table:
    """Evaluate a job; a design that fails is a row with its status, and the others are kept.

    `pareto` marks the non-dominated designs of this job alone, among those that meet every constraint but those on the
    front's axes; `front.Front` finds those of the whole table, and `spent_on` gives the time of metrics of
    the whole readout.
    """
    points = job.space.points(job.start, job.stop)
    found = found_of(job.space, job.start, points, setup, rules.request)
    columns, faults = found.columns, found.faults
    ok = np.ones(len(points), dtype=bool)
    ok[list(faults)] = False
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
        "pareto": _local_front(columns, ok, own, rules),
        "status": _status(faults, len(points)),
    }
    return _annotated(_table(values, len(points), rules.schema), found.spent_s)


def _local_front(columns: Mapping[str, FloatArray], ok: BoolArray, own: FloatArray, rules: Rules) -> BoolArray:
    """The non-dominated designs of a chunk among those that meet every constraint but those on the front's axes."""
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
    return _table(values | {"status": _word(status, len(points))}, len(points), rules.schema)


def rules_of(study: Study) -> Rules:
    """The rules of a study."""
    schema = described(result_schema(study.parameters, list(study.quantities)), study.quantities)
    section = study.section
    drawn = section.recognition is not None and bool(section.recognition.patches)
    request = Request(study.asked, study.objective, study.tolerance, section.vision, section.seed, drawn)
    return Rules(schema, request, study.constraints, study.trade_off, study.plans)


def joined(tables: Sequence[pa.Table]) -> pa.Table:
    """The rows of several tables of jobs, with the seconds of all."""
    return _annotated(pa.concat_tables(tables).unify_dictionaries(), sum(map(spent_on, tables)))


def spent_on(table: pa.Table) -> float:
    """Seconds that metrics of the whole readout took for a job, see `whole_readout.Spent`."""
    return float((table.schema.metadata or {}).get(_SPENT, 0.0))


def _annotated(table: pa.Table, spent_s: float) -> pa.Table:
    """The table with its seconds in its metadata, which go where its rows go, but into no whole table."""
    return table.replace_schema_metadata({**(table.schema.metadata or {}), _SPENT: str(spent_s).encode()})


def _word(text: str | None, n: int) -> pa.Array:
    """The same word, or none, in n rows."""
    return pa.nulls(n, _WORDS) if text is None else _words([text], np.zeros(n, dtype=np.intp))


def _words(texts: Sequence[str], which: IndexArray) -> pa.Array:
    """Words by their places in a list, dictionary-encoded."""
    return pa.DictionaryArray.from_arrays(pa.array(which, pa.int32()), pa.array(texts, pa.string()))


def _status(faults: Mapping[int, str], n: int) -> pa.Array:
    """`ok`, but for the designs with a fault."""
    if not faults:
        return _word("ok", n)
    texts = [faults.get(index, "ok") for index in range(n)]
    numbered = {text: at for at, text in enumerate(dict.fromkeys(texts))}
    return _words([*numbered], np.array([numbered[text] for text in texts]))


def _labels(job: Job) -> dict[str, Any]:
    n, space = job.stop - job.start, job.space
    return {
        "design_id": np.arange(job.first_id, job.first_id + n),
        "filter_id": np.arange(job.first_filter, job.first_filter + n),
        "kind": _word(space.kind, n),
        "name": _word(None if space.kind == "sweep" else space.name, n),
        "space": _word(space.name, n),
        "cfa": _word(space.cfa, n),
        "family": _word("none" if space.filter is None else space.filter.family.kind, n),
        "scenario": _word(job.scenario, n),
    }


def _how(plan: Plan | None, n: int) -> dict[str, Any]:
    """How the scene was simulated: the plan's key and its promise."""
    return {} if plan is None else {"plan": _word(plan.key, n), "promised_dn": np.full(n, plan.error_bound_dn)}


def _table(values: Mapping[str, pa.Array | FloatArray | BoolArray], n: int, schema: pa.Schema) -> pa.Table:
    """Columns in the schema's order; a column that the space does not have is null, as is NaN."""

    def column(field: pa.Field) -> pa.Array:
        made = values.get(field.name)
        if made is None:
            return pa.nulls(n, field.type)
        return made if isinstance(made, pa.Array) else pa.array(made, field.type, from_pandas=True)

    return pa.Table.from_arrays([column(field) for field in schema], schema=schema)
