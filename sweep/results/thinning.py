"""Result table of any length, reduced to the rows that a report shows: the exact front, the best, and a sample."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from ..base.errors import OutputError, ValidationIssue
from ..base.types import Bool, BoolArray, DesignNumbers, IndexArray, Int
from ..metrics.columns.exposure import EXPOSURE
from .tables import REFERENCE, SWEPT, batches, word_mask

if TYPE_CHECKING:
    import pandas as pd

MOST_ROWS = 10_000
"""A table of up to this many rows is kept whole."""
MOST_POINTS = 6_000
"""Swept designs off the front, of those that are feasible and of the others each, that a report draws as points."""
_BEST = 100
_MS = 1e3
_COUNTED = ("kind", "scenario", "cfa", "status", "feasible", "pareto")
_NOT_SWEPT, _INFEASIBLE, _FEASIBLE, _ON_FRONT = range(4)
_Group = tuple[str, str, str, str, bool, bool]


@dataclass(frozen=True)
class Counts:
    """Number of rows by kind, scenario, CFA, status, `feasible` and `pareto`; plain CFAs are not counted as designs."""

    groups: Counter[_Group]

    @property
    def rows(self) -> int:
        """Number of rows."""
        return self.groups.total()

    @property
    def failed(self) -> int:
        """Number of rows that could not be computed."""
        return sum(n for (_, _, _, status, _, _), n in self.groups.items() if status != "ok")

    def feasible(self, scenario: str | None = None, cfa: str | None = None, *, met: bool = True) -> int:
        """Return the number of designs that meet all constraints.

        `scenario`, `cfa`: names; left out, all of them; `met`: False: those that do not.
        """
        return sum(n for _, n in self._designs(scenario, cfa, met))

    def front(self, scenario: str | None = None, cfa: str | None = None) -> int:
        """Return the number of feasible designs on the Pareto front.

        `scenario`, `cfa`: names; left out, all of them.
        """
        return sum(n for pareto, n in self._designs(scenario, cfa, met=True) if pareto)

    def _designs(self, scenario: str | None, cfa: str | None, met: bool) -> Iterator[tuple[bool, int]]:
        for (kind, own_scenario, own_cfa, status, feasible, pareto), n in self.groups.items():
            is_there = scenario in (None, own_scenario) and cfa in (None, own_cfa)
            if kind != REFERENCE and status == "ok" and feasible == met and is_there:
                yield pareto, n


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


def swept_points(path: Path) -> DesignNumbers:
    """Return the swept designs of a result table that a report draws as points.

    The feasible front of each CFA and scenario, and an even sample of the others. A design's id is its row number, so
    that a long table takes one byte per row.
    """
    parts = [np.zeros(0, dtype=np.uint8)]
    for table in batches(path, ["kind", "feasible", "pareto", "status"]):
        swept = word_mask(table, "kind", SWEPT) & word_mask(table, "status", "ok")
        feasible, pareto = table["feasible"].to_numpy(), table["pareto"].to_numpy()
        part = np.where(feasible, _FEASIBLE, _INFEASIBLE).astype(np.uint8)
        part[feasible & pareto] = _ON_FRONT
        part[~swept] = _NOT_SWEPT
        parts.append(part)
    groups = np.concatenate(parts)
    others = (np.flatnonzero(groups == group) for group in (_FEASIBLE, _INFEASIBLE))
    shares = [ids[even(ids.size, MOST_POINTS)] for ids in others]
    return np.sort(np.concatenate([np.flatnonzero(groups == _ON_FRONT), *shares]))


def thinned(
    path: Path,
    order: Sequence[str],
    separation: str,
    keep: Int[IndexArray, " kept"],
) -> tuple[pd.DataFrame, Counts]:
    """Read the table to show and the counts of the whole one, a row group at a time.

    A long table keeps all rows that are no sweep, the whole Pareto front, the best feasible designs of each CFA in each
    scenario, those with most of `separation`, and most of it for their exposure, in each scenario, and every n-th.

    `separation`: a column, DN. Raises OutputError: the file is missing or damaged.
    """
    try:
        total = int(pq.read_metadata(path).num_rows)
    except (OSError, pa.ArrowException) as error:
        raise OutputError(ValidationIssue(f"cannot be read: {error}", str(path))) from None
    step = max(1, -(-total // MOST_ROWS))
    selected: list[pa.Table] = []
    counted: Counter[_Group] = Counter()
    for table in batches(path):
        names = [table[name].cast(pa.string()) for name in _COUNTED[:4]]
        groups = pa.table([*names, table["feasible"], table["pareto"]], names=_COUNTED).group_by(list(_COUNTED))
        for row in groups.aggregate([([], "count_all")]).to_pylist():
            counted[*(row[name] for name in _COUNTED)] += row["count_all"]
        ids, feasible = table["design_id"].to_numpy(), table["feasible"].to_numpy()
        is_kept = ~word_mask(table, "kind", SWEPT) | table["pareto"].to_numpy() | (ids % step == 0) | np.isin(ids, keep)
        if step > 1:
            is_kept[leading_rows(table, separation)] = True
            for rows in row_groups(table).values():
                among = np.zeros(table.num_rows, dtype=bool)
                among[rows] = feasible[rows]
                is_kept[best_at(table, order, _BEST, among)] = True
        selected.append(table.filter(pa.array(is_kept)))
        pa.default_memory_pool().release_unused()
    frame: pd.DataFrame = pa.concat_tables(selected).unify_dictionaries().to_pandas()
    frame = frame.sort_values("design_id", ignore_index=True)
    frame[per_exposure(separation)] = frame[separation] / (frame[EXPOSURE] * _MS)
    return frame, Counts(counted)


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
