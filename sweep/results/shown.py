"""Rows that a report shows, reduced from those of a run as they come: exact front, best, leading rows, and a sample."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from ..base.types import Array, Bool, BoolArray, Float, IndexArray, Int
from ..metrics.columns.exposure import EXPOSURE
from ..metrics.pareto import non_dominated
from .tables import NAMED_KINDS, ON_FRONT, REFERENCE, SWEPT, word_mask

MOST_POINTS = 6_000
"""Swept designs off the front, of those that are feasible and of the others each, that a report draws as points."""
BEST_PER_CFA = 12
"""Best feasible designs of each CFA's sweeps that the report lists and draws."""
FRONT_ROWS = 200
"""Designs of a front, spread evenly over it, whose curves and signals a report can show."""
MS = 1e3
"""Milliseconds per second."""
_AT_ONCE = 50_000
"""Rows that are held before they are reduced."""
_TIMES, _LEAST_SAMPLE = 8, 50
"""Rows of a part that are taken into a sample, at most, of its share, and beside it."""
_GOLDEN = np.uint64(0x9E3779B97F4A7C15)
"""2^64 over the golden ratio."""
_COUNTED = ("kind", "scenario", "cfa", "status", "feasible")
_Group = tuple[str, str, str, str, bool]


@dataclass(frozen=True)
class Counts:
    """Number of rows by kind, scenario, CFA, status and `feasible`, and of the feasible front by scenario and CFA.

    Plain CFAs are not counted as designs.
    """

    groups: Counter[_Group]
    on_front: Counter[tuple[str, str]]

    @classmethod
    def of(cls, facts: Sequence[Sequence[Any]], pareto: pa.Table) -> Counts:
        """Return the counts of rows that a run stated, with those of its front."""
        groups = {(kind, scenario, cfa, status, feasible): n for kind, scenario, cfa, status, feasible, n in facts}
        designs = pareto.filter(pa.array(~word_mask(pareto, "kind", REFERENCE) & pareto["feasible"].to_numpy()))
        on_front = zip(designs["scenario"].to_pylist(), designs["cfa"].to_pylist(), strict=True)
        return cls(Counter(groups), Counter(on_front))

    @property
    def rows(self) -> int:
        """Number of rows."""
        return self.groups.total()

    @property
    def failed(self) -> int:
        """Number of rows that could not be computed."""
        return sum(n for (_, _, _, status, _), n in self.groups.items() if status != "ok")

    def feasible(self, scenario: str | None = None, cfa: str | None = None, *, met: bool = True) -> int:
        """Return the number of designs that meet all constraints.

        `scenario`, `cfa`: names; left out, all of them; `met`: False: those that do not.
        """
        return sum(
            n
            for (kind, of_scenario, of_cfa, status, feasible), n in self.groups.items()
            if kind != REFERENCE
            and (status, feasible) == ("ok", met)
            and scenario in (None, of_scenario)
            and cfa in (None, of_cfa)
        )

    def front(self, scenario: str | None = None, cfa: str | None = None) -> int:
        """Return the number of feasible designs on the Pareto front."""
        groups = self.on_front.items()
        return sum(n for (of, of_cfa), n in groups if scenario in (None, of) and cfa in (None, of_cfa))


def counted(table: pa.Table) -> Counter[_Group]:
    """Count rows by kind, scenario, CFA, status and `feasible`."""
    words = [table[name].cast(pa.string()) for name in _COUNTED[:4]]
    groups = pa.table([*words, table["feasible"]], names=_COUNTED).group_by(list(_COUNTED))
    rows = groups.aggregate([([], "count_all")]).to_pylist()
    return Counter({tuple(row[name] for name in _COUNTED): row["count_all"] for row in rows})


def per_exposure(separation: str) -> str:
    """Return the name of the column of separation per millisecond of exposure."""
    return f"{separation}_per_ms"


def even(size: int, most: int) -> Int[IndexArray, " numbers"]:
    """Return evenly spread indices that are not in step with a grid.

    `size`, `most`: number of all indices, and of those returned at most.
    """
    if size <= most:
        return np.arange(size)
    golden = (np.arange(most) * ((5**0.5 - 1) / 2)) % 1
    return np.unique((golden * size).astype(np.intp))


def sampled(swept: pa.Table, most: int) -> pa.Table:
    """Return an even sample of swept rows, of those that are feasible and of the others each, the same in any parts."""
    feasible, chosen = swept["feasible"].to_numpy(), []
    order = swept["design_id"].to_numpy().astype(np.uint64) * _GOLDEN  # spread evenly, modulo 2^64
    for group in (feasible, ~feasible):
        at = np.flatnonzero(group)
        chosen.append(at if at.size <= most else at[np.argpartition(order[at], most)[:most]])
    return swept.take(np.sort(np.concatenate(chosen)))


@dataclass(frozen=True)
class Selection:
    """What is shown: columns that rank designs, the first one first, and the two of the front, all maximized."""

    order: Sequence[str]
    front: tuple[str, str]
    n_swept: int

    def of_part(self, table: pa.Table) -> ShownRows:
        """Select the rows of a part that the whole run may show."""
        swept = table.filter(pa.array(word_mask(table, "kind", SWEPT) & word_mask(table, "status", "ok")))
        most = _LEAST_SAMPLE + _TIMES * MOST_POINTS * swept.num_rows // max(1, self.n_swept)
        return ShownRows(self.reduced(table), sampled(swept, min(most, MOST_POINTS)), counted(table))

    def reduced(self, table: pa.Table) -> pa.Table:
        """Select front, best and leading rows of each CFA and scenario, or the nearest to be feasible; named ones stay.

        `pareto` marks the front of any part of a run's rows, so that it may be applied again to several results.
        """
        is_named, eligible = word_mask(table, "kind", *NAMED_KINDS), table[ON_FRONT].to_numpy()
        feasible = table["feasible"].to_numpy()
        violation = np.nan_to_num(table["violation"].to_numpy(), nan=np.inf)
        selected = [np.flatnonzero(is_named), leading_rows(table, self.front[0], ~is_named)]
        for at in row_groups(table).values():
            swept = at[~is_named[at]]
            marked = swept[eligible[swept]]
            selected.append(marked[non_dominated(self._values(table.take(marked)))])
            among = np.zeros(table.num_rows, dtype=bool)
            among[swept] = feasible[swept]
            selected.append(best_at(table, self.order, BEST_PER_CFA, among))
            if swept.size and not feasible[swept].any():
                selected.append(swept[[violation[swept].argmin()]])
        return table.take(np.unique(np.concatenate(selected)).astype(np.int64)).combine_chunks()

    def _values(self, table: pa.Table) -> Float[Array, "rows objectives"]:
        return np.stack([table[name].to_numpy() for name in self.front], axis=1)

    def on_front(self, table: pa.Table) -> Bool[BoolArray, " rows"]:
        """Return which of the reduced rows are on the front of their CFA and scenario."""
        on_front, eligible = np.zeros(table.num_rows, dtype=bool), table[ON_FRONT].to_numpy()
        for at in row_groups(table).values():
            marked = at[eligible[at]]
            on_front[marked[non_dominated(self._values(table.take(marked)))]] = True
        return on_front


@dataclass(frozen=True)
class ShownRows:
    """Rows of a part, or of a run, that a report may show: those that stand out, an even sample, and counts of all."""

    rows: pa.Table
    sample: pa.Table
    counts: Counter[_Group]


@dataclass
class Gathered:
    """Rows of a run that its report shows, and the Pareto front of each CFA and scenario, from its parts."""

    selection: Selection
    schema: pa.Schema
    counts: Counter[_Group] = field(default_factory=Counter)
    _waiting: list[pa.Table] = field(default_factory=list)
    _samples: list[pa.Table] = field(default_factory=list)

    def add(self, part: ShownRows) -> None:
        """Add what a part has."""
        self._waiting.append(part.rows)
        self._samples.append(part.sample)
        self.counts += part.counts
        if sum(table.num_rows for table in self._samples) > _AT_ONCE:
            self._samples = [sampled(joined(self._samples, self.schema), MOST_POINTS)]
        if sum(table.num_rows for table in self._waiting) > _AT_ONCE:
            self._waiting = [self.selection.reduced(joined(self._waiting, self.schema))]

    def finish(self) -> tuple[pa.Table, pa.Table]:
        """Return the rows that stand out, `pareto` where they are on the front of the run, and the sample."""
        rows = self.selection.reduced(joined(self._waiting, self.schema))
        at = rows.schema.get_field_index(ON_FRONT)
        rows = rows.set_column(at, rows.schema.field(at), pa.array(self.selection.on_front(rows)))
        sample = sampled(joined(self._samples, self.schema), MOST_POINTS)
        no = pa.array(np.zeros(sample.num_rows, dtype=bool))
        return rows, sample.set_column(at, sample.schema.field(at), no)


def shown_rows(designs: pa.Table, pareto: pa.Table) -> pa.Table:
    """Return the rows that a report shows: designs, and those of the front that are not among them."""
    others = ~np.isin(pareto["design_id"].to_numpy(), designs["design_id"].to_numpy())
    return joined([designs, pareto.filter(pa.array(others))], pareto.schema)


def joined(tables: Sequence[pa.Table], schema: pa.Schema) -> pa.Table:
    """Return rows of several tables by their ids, whatever the order of the tables; a missing column is null."""
    together = pa.concat_tables([schema.empty_table(), *tables], promote_options="default").select(schema.names)
    ordered = together.unify_dictionaries().combine_chunks().cast(schema).sort_by("design_id")
    words = [pa.types.is_dictionary(field.type) for field in schema]
    columns = [
        column.cast(pa.string()).combine_chunks().dictionary_encode() if is_word else column
        for column, is_word in zip(ordered.columns, words, strict=True)
    ]
    return pa.Table.from_arrays(columns, schema=schema)


def designs_of(rows: pa.Table, sample: pa.Table, selection: Selection, scenario: str) -> pa.Table:
    """Return the rows that a report shows beside the front, of those that stand out and of a sample of all."""
    ids, sampled_ids = (table["design_id"].to_numpy() for table in (rows, sample))
    at = [best_rows(rows, selection, scenario), front_rows(rows, selection, scenario)]
    at.append(np.flatnonzero(np.isin(ids, sampled_ids)))
    others = sample.filter(pa.array(~np.isin(sampled_ids, ids)))
    return joined([rows.take(np.unique(np.concatenate(at))), others], rows.schema)


def best_rows(rows: pa.Table, selection: Selection, scenario: str) -> Int[IndexArray, " selected"]:
    """Return the rows that are not swept, and a scenario's best swept rows of each CFA."""
    swept = _feasible_of(rows, scenario)
    cfas = rows["cfa"].unique().to_pylist()
    best = [best_at(rows, selection.order, BEST_PER_CFA, swept & word_mask(rows, "cfa", cfa)) for cfa in cfas]
    return np.unique(np.concatenate([np.flatnonzero(word_mask(rows, "kind", *NAMED_KINDS)), *best]))


def front_rows(rows: pa.Table, selection: Selection, scenario: str) -> Int[IndexArray, " selected"]:
    """Return swept rows: an even sample of a scenario's feasible front, and those that lead a scenario."""
    leaders = leading_rows(rows, selection.front[0])
    at = [leaders[word_mask(rows, "kind", SWEPT)[leaders]]]
    front, sensitivity = _feasible_of(rows, scenario) & rows[ON_FRONT].to_numpy(), rows[selection.front[1]].to_numpy()
    for cfa in rows["cfa"].unique().to_pylist():
        of_cfa = np.flatnonzero(front & word_mask(rows, "cfa", cfa))
        of_cfa = of_cfa[np.argsort(sensitivity[of_cfa], kind="stable")]
        at.append(of_cfa[np.linspace(0, max(0, of_cfa.size - 1), min(FRONT_ROWS, of_cfa.size)).round().astype(int)])
    return np.unique(np.concatenate(at))


def _feasible_of(rows: pa.Table, scenario: str) -> Bool[BoolArray, " rows"]:
    swept = word_mask(rows, "kind", SWEPT) & word_mask(rows, "scenario", scenario)
    return np.asarray(swept & rows["feasible"].to_numpy())


def row_groups(table: pa.Table) -> dict[tuple[str, str], Int[IndexArray, " _rows"]]:
    """Return the rows of each CFA and scenario."""
    cfas, scenarios = (
        {name: word_mask(table, column, name) for name in table[column].unique().to_pylist()}
        for column in ("cfa", "scenario")
    )
    groups = {(cfa, scene): np.flatnonzero(cfas[cfa] & scenarios[scene]) for cfa, scene in product(cfas, scenarios)}
    return {group: at for group, at in groups.items() if at.size}


def best_at(
    table: pa.Table, order: Sequence[str], most: int, among: Bool[BoolArray, " rows"]
) -> Int[IndexArray, " kept"]:
    """Return the indices of the best rows, best first; of equal ones the smallest `design_id` is first."""
    at = np.flatnonzero(among)
    if len(at) > most:
        first = np.nan_to_num(table[order[0]].to_numpy()[at], nan=-np.inf, posinf=np.inf, neginf=-np.inf)
        at = at[first >= np.partition(first, -most)[-most]]
    keys = [*((name, "descending") for name in dict.fromkeys(order)), ("design_id", "ascending")]
    sort_columns = table.select([name for name, _ in keys]).take(at)
    return np.asarray(at[pc.sort_indices(sort_columns, sort_keys=keys)[:most].to_numpy()])


def leading_rows(
    table: pa.Table, separation: str, among: Bool[BoolArray, " rows"] | None = None
) -> Int[IndexArray, " kept"]:
    """Return the rows with the largest separation, and the largest per exposure time, in each scenario.

    `separation`: a column, DN. Of equal rows the one with the smallest `design_id` counts; `among`: rows that take
    part; all without it.
    """
    among = np.ones(table.num_rows, dtype=bool) if among is None else among
    csd, ids = table[separation].to_numpy(), table["design_id"].to_numpy()
    with np.errstate(divide="ignore", invalid="ignore"):
        measures = [
            np.nan_to_num(values, nan=-np.inf, posinf=np.inf, neginf=-np.inf)
            for values in (csd, csd / table[EXPOSURE].to_numpy())
        ]
    leaders = []
    for scenario in table["scenario"].unique().to_pylist():
        rows = np.flatnonzero(among & word_mask(table, "scenario", scenario))
        for values in measures if rows.size else ():
            most = rows[values[rows] == values[rows].max()]
            leaders.append(most[ids[most].argmin()])
    return np.array(leaders, dtype=np.intp)
