"""Jobs (chunks of designs), the parts that they make, and rows."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyarrow as pa

from ..base.types import Bool, BoolArray, DesignNumbers, IndexArray, Int, PerDesign
from ..camera.setup import Setup
from ..designs.block import by_edges
from ..designs.space import Space
from ..metrics.bound import FEASIBLE, total_violation
from ..metrics.columns.chromatic import CHROMATIC_CSD
from ..metrics.columns.exposure import EXPOSURE
from ..metrics.pareto import non_dominated
from ..metrics.quantity import DN, Columns, Quantity
from ..metrics.separation import csd_name
from ..results.dictionary import described
from ..results.identity import CHUNK
from ..results.shown import Selection
from ..results.tables import ON_FRONT, SWEPT, result_schema, word_mask
from ..spectra.lights import pair_name
from ..study import Study
from ..study.axes import axes_of, places_of, series_of
from .routes import Rules, Wanted, quantities_at

_MOST_CHUNKS, _LEAST_JOBS = 16, 64
_DRAWN_DESIGNS = 32
"""Designs of a job where each is evaluated with many random lamps and cameras."""
_ENOUGH_SCENES, _FEW = 4, 64
"""From so many scenes on, jobs of a scene that have few designs together share its pixel response, in one part."""


@dataclass(frozen=True)
class Job:
    """Consecutive designs of one space, by its number, in one scenario."""

    space: int
    scenario: str
    start: int
    stop: int
    first_id: int
    first_filter: int

    @property
    def size(self) -> int:
        """Number of designs."""
        return self.stop - self.start


@dataclass(frozen=True)
class Part:
    """Jobs whose rows are one file; none for the answers of a search."""

    number: int
    jobs: tuple[Job, ...]

    @property
    def size(self) -> int:
        """Number of rows."""
        return sum(job.size for job in self.jobs)

    def key(self, fingerprint: str) -> str:
        """Return the SHA-256 of everything that the rows depend on."""
        jobs = [[job.scenario, job.space, job.start, job.stop] for job in self.jobs]
        return hashlib.sha256(json.dumps([fingerprint, jobs]).encode()).hexdigest()


def parts_of(study: Study) -> list[Part]:
    """Return all parts in the order of their rows."""
    sizes = [_job_size(study, space) for space in study.spaces]
    groups: list[list[Job]] = []
    first_id = 0
    for name, scene in study.scenarios.items():
        small: list[Job] = []
        light = (
            scene.target is None and not study.states and not any(feature.slow for feature in study.features.values())
        )
        together = light or len(study.scenarios) >= _ENOUGH_SCENES
        for job in _jobs_of(study, name, first_id, sizes):
            if together and sum(other.size for other in (*small, job)) <= _FEW:
                small.append(job)
                groups += [small] if len(small) == 1 else []
            else:
                small = []
                groups.append([job])
        first_id += study.n_filters
    return [Part(number, tuple(jobs)) for number, jobs in enumerate(groups)]


def _jobs_of(study: Study, scenario: str, first_id: int, sizes: Sequence[int]) -> Iterator[Job]:
    first_filter = 0
    for number, (space, size) in enumerate(zip(study.spaces, sizes, strict=True)):
        for start in range(0, space.size, size):
            stop, first = min(start + size, space.size), first_filter + start
            yield Job(number, scenario, start, stop, first_id + first, first)
        first_filter += space.size


def _job_size(study: Study, space: Space) -> int:
    """Return the number of designs of a job, independent of the workers; several chunks for fast designs."""
    if study.requested.wanted_yield:
        return _DRAWN_DESIGNS
    if not by_edges(space) or any(quantity.states for quantity in swept_quantities(study).values()):
        return CHUNK
    return CHUNK * min(max(1, space.size // (CHUNK * _LEAST_JOBS)), _MOST_CHUNKS)


def swept_quantities(study: Study) -> Mapping[str, Quantity]:
    """Return the quantities of the rows of swept designs: those that the study asks for, or all."""
    quantities = study.quantities
    if study.section.columns == "all" or not any(space.kind == "sweep" for space in study.spaces):
        return quantities
    pair = quantities[study.trade_off[0]].pair
    asked = {*_named(study), EXPOSURE, *(metric.name for metric in study.user_metrics)}
    asked.update(*study.swept.values())
    return {
        name: quantity
        for name, quantity in quantities.items()
        if name in asked
        or (quantity.role and quantity.extreme in ("", "best place"))
        or name == (pair and pair_name(CHROMATIC_CSD, pair))
    }


def _named(study: Study) -> set[str]:
    """Return the quantities of constraints, objective and front, and their nominal values."""
    names = {*study.constraints, *study.objective.weights, study.objective.column, *study.trade_off}
    return names | {study.quantities[name].of for name in names}


def _in_every_scene(study: Study) -> frozenset[str]:
    """Return the quantities that each scene of a series has: all but distances in DN that the study does not name."""
    names, quantities = _named(study), study.quantities
    names |= {csd_name(pair) for name in study.trade_off if (pair := quantities[name].pair) is not None}
    return frozenset(name for name, of in quantities.items() if name in names or of.pair is None or of.unit != DN)


def rules_of(study: Study) -> Rules:
    """Return the rules of a study."""
    section, quantities, swept = study.section, study.quantities, swept_quantities(study)
    beyond = {name for scenes in series_of(study.scenarios).values() for name in [*scenes][1:]}
    leading = set() if study.search is None else {study.search.scenario}
    axes, searched = axes_of(study.scenarios), study.search is not None
    return Rules(
        places=places_of(study.scenarios),
        schema=described(result_schema(study.parameters, list(swept), searched=searched, axes=axes), study.columns),
        shown=described(
            result_schema(study.parameters, list(quantities), marked=True, searched=searched, axes=axes), study.columns
        ),
        requested=study.requested,
        objective=study.objective,
        constraints=study.constraints,
        front=study.trade_off,
        tolerance=study.tolerance,
        plans=study.plans,
        seed=section.seed,
        in_series=frozenset(beyond - leading if section.columns == "asked" else ()),
        asked=_in_every_scene(study),
    )


def selection_of(study: Study) -> Selection:
    """Return what a study's report shows of its rows."""
    swept = sum(space.size for space in study.spaces if space.kind == SWEPT) * len(study.scenarios)
    return Selection((study.objective.column, *study.trade_off), study.trade_off, swept)


def run_job(job: Job, study: Study, rules: Rules) -> pa.Table:
    """Evaluate a job; a design that fails becomes a row with its status.

    Returns a row per design, with `pareto` as of `rows_of`.
    """
    at = Rows.of(job, study)
    return rows_of(at, study.setup(at.space, job.scenario), rules, rules.wanted_of_swept)


@dataclass(frozen=True)
class Rows:
    """Rows of designs of one space in one scenario."""

    space: Space
    scenario: str
    numbers: DesignNumbers
    ids: DesignNumbers
    filters: DesignNumbers

    @classmethod
    def of(cls, job: Job, study: Study) -> Rows:
        """Return the rows of a job."""
        numbers = np.arange(job.start, job.stop)
        ids, filters = (numbers + (first - job.start) for first in (job.first_id, job.first_filter))
        return cls(study.spaces[job.space], job.scenario, numbers, ids, filters)

    @property
    def misshape(self) -> PerDesign:
        """By how much filters are not well-formed."""
        return self.space.violation(self.space.points_of(self.numbers))


def marked(table: pa.Table, part: Part, study: Study, rules: Rules) -> pa.Table:
    """Return the rows of a part as `rows_of` does, from those of its file."""
    marks, start = [], 0
    for job in part.jobs:
        rows = table.slice(start, job.size)
        columns = {name: rows[name].to_numpy() for name in (*rules.constraints, *rules.front)}
        marks.append(_non_dominated(Rows.of(job, study), columns, word_mask(rows, "status", "ok"), rules))
        start += job.size
    return table.append_column(rules.shown.field(ON_FRONT), pa.array(np.concatenate(marks)))


def _non_dominated(at: Rows, columns: Columns, ok: Bool[BoolArray, " rows"], rules: Rules) -> Bool[BoolArray, " rows"]:
    eligible = ok & (total_violation(columns, rules.constraints, at.misshape, leave_out=rules.front) <= FEASIBLE)
    return non_dominated(np.stack([columns[name] for name in rules.front], axis=1), eligible)


def rows_of(at: Rows, setup: Setup, rules: Rules, wanted: Wanted) -> pa.Table:
    """Evaluate designs.

    `pareto` marks the non-dominated ones of these alone, among those that meet every constraint but those on the
    front's axes.
    """
    wanted = rules.at(at.scenario, wanted)
    columns, issues = quantities_at(at.space, at.numbers, setup, rules, wanted)
    n = len(at.numbers)
    ok = np.ones(n, dtype=bool)
    ok[list(issues)] = False
    violation = total_violation(columns, rules.constraints, at.misshape)
    texts = dict.fromkeys(["ok"] if ok.any() else []) | dict.fromkeys(issues.values())
    numbers = {text: number for number, text in enumerate(texts)}
    status = np.zeros(n, dtype=np.intp)
    status[list(issues)] = [numbers[text] for text in issues.values()]
    verdicts = {
        "violation": np.where(ok, violation, np.nan),
        "feasible": ok & (violation <= FEASIBLE),
        ON_FRONT: _non_dominated(at, columns, ok, rules),
        "status": _words(list(numbers), status),
    }
    return _table(at, rules, wanted.schema, columns | verdicts)


def failed_rows(job: Job, study: Study, rules: Rules, status: str) -> pa.Table:
    """Return the rows of a job that could not be computed."""
    no = np.zeros(job.size, dtype=bool)
    verdicts = {"feasible": no, ON_FRONT: no, "status": _word(status, job.size)}
    return _table(Rows.of(job, study), rules, rules.wanted_of_swept.schema, verdicts)


def _table(at: Rows, rules: Rules, schema: pa.Schema, values: Mapping[str, Any]) -> pa.Table:
    """Return rows: keys, parameters, plan and values; a missing column, and NaN, is null."""
    n, space, plan = len(at.numbers), at.space, rules.plans.get(at.scenario)
    points = space.points_of(at.numbers)
    known: dict[str, Any] = {
        "design_id": at.ids,
        "filter_id": at.filters,
        "kind": _word(space.kind, n),
        "space": _word(space.name, n),
        "cfa": _word(space.cfa, n),
        "family": _word("none" if space.filter is None else space.filter.family.kind, n),
        "scenario": _word(at.scenario, n),
        **{
            name: _word(value, n) if isinstance(value, str) else np.full(n, float(value))
            for name, value in rules.places.get(at.scenario, {}).items()
        },
        **{name: points[:, i] for i, name in enumerate(space.parameters)},
        **values,
    }
    if space.kind != SWEPT:
        known["name"] = known["space"]
    if plan is not None:
        known |= {"simulation_key": _word(plan.key, n), "omitted_effects_bound_dn": np.full(n, plan.error_bound_dn)}

    def column(field: pa.Field) -> pa.Array:
        values_of_field = known.get(field.name)
        if values_of_field is None:
            return pa.nulls(n, field.type)
        return (
            values_of_field
            if isinstance(values_of_field, pa.Array)
            else pa.array(values_of_field, field.type, from_pandas=True)
        )

    return pa.Table.from_arrays([column(field) for field in schema], schema=schema)


def _word(text: str, n: int) -> pa.Array:
    """Return the same word in n rows."""
    return _words([text], np.zeros(n, dtype=np.intp))


def _words(texts: list[str], numbers: Int[IndexArray, " rows"]) -> pa.Array:
    """Return dictionary-encoded words from their indices in a list."""
    return pa.DictionaryArray.from_arrays(pa.array(numbers, pa.int32()), pa.array(texts, pa.string()))
