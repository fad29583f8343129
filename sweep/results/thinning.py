"""A result table of any length, thinned to what a report shows: the front exactly, the named, the best, a sample."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from ..base.errors import Fault, OutputError
from ..base.types import BoolArray, IndexArray
from ..metrics.columns.exposure import EXPOSURE
from .tables import PLAIN, SWEPT, batches, holds, release_memory

if TYPE_CHECKING:
    import pandas as pd

MOST_ROWS = 150_000
"""A table of up to this many rows is kept whole."""
MOST_POINTS = 6_000
"""Swept designs off the front, of those that are feasible and of the others each, that a report draws as points."""
_BEST = 100
_MS = 1e3
_NOT_SWEPT, _INFEASIBLE, _FEASIBLE, _ON_FRONT = range(4)


@dataclass(frozen=True)
class Counts:
    """Rows of the whole table, counted by (kind, scenario, CFA, ok, feasible, pareto).

    Plain CFAs are no designs: they count among the rows alone.
    """

    groups: Mapping[tuple[str, str, str, bool, bool, bool], int]

    @property
    def rows(self) -> int:
        """All rows."""
        return sum(self.groups.values())

    @property
    def failed(self) -> int:
        """Rows that could not be computed."""
        return sum(n for (_, _, _, ok, _, _), n in self.groups.items() if not ok)

    def feasible(self, scenario: str | None = None, cfa: str | None = None, *, met: bool = True) -> int:
        """Return the number of designs that meet all constraints, or do not, in a scenario and a CFA, or in all."""
        return sum(n for _, n in self._designs(scenario, cfa, met))

    def front(self, scenario: str | None = None, cfa: str | None = None) -> int:
        """Return the number of feasible designs on the Pareto front."""
        return sum(n for pareto, n in self._designs(scenario, cfa, met=True) if pareto)

    def _designs(self, scenario: str | None, cfa: str | None, met: bool) -> Iterator[tuple[bool, int]]:
        for (kind, own_scenario, own_cfa, ok, feasible, pareto), n in self.groups.items():
            if kind != PLAIN and ok and feasible == met and scenario in (None, own_scenario) and cfa in (None, own_cfa):
                yield pareto, n


def _counted(table: pa.Table) -> Counter[tuple[str, str, str, bool, bool, bool]]:
    """Count the rows of a row group."""
    named = {name: table[name].cast(pa.string()) for name in ("kind", "scenario", "cfa")}
    flags = {
        "ok": pc.equal(table["status"].cast(pa.string()), "ok"),
        "feasible": table["feasible"],
        "pareto": table["pareto"],
    }
    columns = named | flags
    grouped = pa.table(columns).group_by(list(columns)).aggregate([([], "count_all")])
    return Counter({tuple(row[name] for name in columns): row["count_all"] for row in grouped.to_pylist()})


def per_exposure(separation: str) -> str:
    """A derived column of the table to show: a separation for each millisecond of exposure."""
    return f"{separation}_per_ms"


def even(size: int, most: int) -> IndexArray:
    """At most `most` of `size` indices, in order, spread evenly and not in step with a grid."""
    if size <= most:
        return np.arange(size)
    golden = (np.arange(most) * ((5**0.5 - 1) / 2)) % 1
    return np.unique((golden * size).astype(np.intp))


def swept_points(path: Path) -> IndexArray:
    """Ids of the swept designs of a result table that a report draws as points, in order.

    They are the feasible front of each CFA and scenario, and an even share of the others, feasible or not. A design's
    id is the number of its row, so that a byte for each row is all that is held of a long table.
    """
    groups = [np.zeros(0, dtype=np.uint8)]
    for table in batches(path, ["kind", "feasible", "pareto", "status"]):
        swept = holds(table, "kind", SWEPT) & holds(table, "status", "ok")
        feasible, pareto = table["feasible"].to_numpy(), table["pareto"].to_numpy()
        found = np.where(feasible, _FEASIBLE, _INFEASIBLE).astype(np.uint8)
        found[feasible & pareto] = _ON_FRONT
        found[~swept] = _NOT_SWEPT
        groups.append(found)
    every = np.concatenate(groups)
    others = (np.flatnonzero(every == group) for group in (_FEASIBLE, _INFEASIBLE))
    shares = [some[even(some.size, MOST_POINTS)] for some in others]
    return np.sort(np.concatenate([np.flatnonzero(every == _ON_FRONT), *shares]))


def thinned(
    path: Path,
    order: Sequence[str],
    separation: str,
    keep: IndexArray,
    see: Callable[[pa.Table], None] = lambda _: None,
) -> tuple[pd.DataFrame, Counts]:
    """The table to show and the counts of the whole one; no more than a row group and what is kept are in memory.

    Kept are all rows that are no sweep, the whole Pareto front, those with the ids `keep`, the best feasible designs by
    `order` (columns, all maximized), the best of each CFA in each scenario, the designs of each scenario that have most
    of `separation`, and most of it for their exposure, whatever the constraints, and of the others every n-th. `see` is
    handed every row group of the whole table.
    """
    try:
        total = int(pq.read_metadata(path).num_rows)
    except (OSError, pa.ArrowException) as error:
        raise OutputError(Fault(f"cannot be read: {error}", str(path))) from None
    every = max(1, -(-total // MOST_ROWS))
    kept: list[pa.Table] = []
    best: pa.Table | None = None
    counted: Counter[tuple[str, str, str, bool, bool, bool]] = Counter()
    for table in batches(path):
        see(table)
        ok, on_front = table["feasible"].to_numpy(), table["pareto"].to_numpy()
        counted += _counted(table)
        always = ~holds(table, "kind", SWEPT) | on_front
        ids = table["design_id"].to_numpy()
        kept.append(table.filter(pa.array(always | (ids % every == 0) | np.isin(ids, keep))))
        if every > 1:
            few = table.filter(pa.array(ok & ~always))
            best = best_rows(few if best is None else pa.concat_tables([best, few]), order, _BEST)
            kept += [leading(table, separation), _best_of_each(few, order)]
        release_memory()
    if best is not None:
        kept.append(best)
    frame: pd.DataFrame = pa.concat_tables(kept).unify_dictionaries().to_pandas()
    frame = frame.drop_duplicates("design_id").sort_values("design_id", ignore_index=True)
    frame[per_exposure(separation)] = frame[separation] / (frame[EXPOSURE] * _MS)
    return frame, Counts(counted)


def best_at(table: pa.Table, order: Sequence[str], most: int, among: BoolArray | None = None) -> IndexArray:
    """Where the best rows are by columns that are maximized, in their order; of equal ones the smallest `design_id`.

    `among`: rows to look at, ndarray[n_rows]; all without it.
    """
    at = np.arange(table.num_rows) if among is None else np.flatnonzero(among)
    if len(at) > most:
        first = table[order[0]].to_numpy()[at]
        first = np.where(np.isnan(first), -np.inf, first)
        at = at[first >= np.partition(first, -most)[-most]]
    keys = [*((name, "descending") for name in dict.fromkeys(order)), ("design_id", "ascending")]
    few = table.select([name for name, _ in keys]).take(at)
    return np.asarray(at[pc.sort_indices(few, sort_keys=keys)[:most].to_numpy()])


def best_rows(table: pa.Table, order: Sequence[str], most: int) -> pa.Table:
    """The rows of `best_at`."""
    return table.take(best_at(table, order, most)).combine_chunks()


def leading_at(table: pa.Table, separation: str, among: BoolArray | None = None) -> IndexArray:
    """Where, in each scenario, the design is that separates most, and the one that separates most for its exposure.

    Of equal ones the smallest `design_id`; `among`: rows to look at, ndarray[n_rows]; all without it.
    """
    seen = np.ones(table.num_rows, dtype=bool) if among is None else among
    apart, ids = table[separation].to_numpy(), table["design_id"].to_numpy()
    with np.errstate(divide="ignore", invalid="ignore"):
        measures = [
            np.nan_to_num(v, nan=-np.inf, posinf=np.inf, neginf=-np.inf)
            for v in (apart, apart / table[EXPOSURE].to_numpy())
        ]
    found = []
    for scenario in table["scenario"].unique().to_pylist():
        own = np.flatnonzero(seen & holds(table, "scenario", scenario))
        for measured in measures if own.size else ():
            most = own[measured[own] == measured[own].max()]
            found.append(most[ids[most].argmin()])
    return np.array(found, dtype=np.intp)


def leading(table: pa.Table, separation: str) -> pa.Table:
    """The rows of `leading_at`."""
    return table.take(leading_at(table, separation))


def _best_of_each(table: pa.Table, order: Sequence[str]) -> pa.Table:
    """The best design of each CFA in each scenario."""
    found = [table.schema.empty_table()]
    for scenario in table["scenario"].unique().to_pylist():
        own = table.filter(pa.array(holds(table, "scenario", scenario)))
        for cfa in own["cfa"].unique().to_pylist():
            found.append(best_rows(own.filter(pa.array(holds(own, "cfa", cfa))), order, 1))
    return pa.concat_tables(found)
