"""From finished chunks to one table: the front over all of them, and the few rows that reports draw, by streaming."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from ..arrays import BoolArray, FloatArray, IndexArray
from ..pareto import non_dominated
from ..store import ROW_GROUP, atomic, best_rows, holds, release_memory
from .jobs import Rules

BEST_PER_CFA = 5
"""Best feasible designs of each CFA's sweeps that the report lists and draws."""
_MOST_CANDIDATES = 50_000
_ALWAYS = ("reference", "design", "search")


class Front:
    """The non-dominated rows of each CFA and scenario, of tables whose `pareto` marks those of each table alone.

    Both quantities of `axes` are maximized. A design takes part when it meets every constraint but those on these two,
    so that the front shows the whole trade-off.
    """

    def __init__(self, axes: tuple[str, str], kind: str | None = None) -> None:
        """`kind`: of the rows that take part; all without one."""
        self._axes, self._kind = axes, kind
        self._groups: dict[tuple[str, str], FloatArray] = {}

    def add(self, table: pa.Table) -> None:
        """Take in the rows that a table marks."""
        for group, values in self._by_group(table).items():
            both = np.concatenate([self._groups.get(group, np.empty((0, 2))), values])
            if len(both) > _MOST_CANDIDATES:
                both = _thinned(both)
            self._groups[group] = both

    def finish(self) -> None:
        """Nothing more comes."""
        self._groups = {group: _thinned(values) for group, values in self._groups.items()}

    def points(self, cfa: str, scenario: str) -> FloatArray:
        """The two quantities of a front's rows, ndarray[n, 2], each pair once."""
        return self._groups.get((cfa, scenario), np.empty((0, 2)))

    def marked(self, table: pa.Table) -> pa.Table:
        """The table with `pareto` only where a row is on the whole front."""
        local, values, groups = self._candidates(table)
        points = {group: set(map(tuple, found.tolist())) for group, found in self._groups.items()}
        kept = [tuple(v) in points.get(g, ()) for v, g in zip(values.tolist(), groups, strict=True)]
        front: BoolArray = np.zeros(table.num_rows, dtype=bool)
        front[local] = kept
        return table.set_column(table.schema.get_field_index("pareto"), table.schema.field("pareto"), pa.array(front))

    def _candidates(self, table: pa.Table) -> tuple[IndexArray, FloatArray, list[tuple[str, str]]]:
        wanted = table["pareto"].to_numpy()
        if self._kind is not None:
            wanted = wanted & holds(table, "kind", self._kind)
        local = np.flatnonzero(wanted)
        few = table.select([*self._axes, "cfa", "scenario"]).take(pa.array(local))
        values = np.stack([few[name].to_numpy() for name in self._axes], axis=1)
        return local, values, list(zip(few["cfa"].to_pylist(), few["scenario"].to_pylist(), strict=True))

    def _by_group(self, table: pa.Table) -> dict[tuple[str, str], FloatArray]:
        _, values, groups = self._candidates(table)
        return {g: values[[other == g for other in groups]] for g in dict.fromkeys(groups)}


def _thinned(values: FloatArray) -> FloatArray:
    """The non-dominated rows, each once."""
    return np.unique(values[non_dominated(values)], axis=0)


class Highlights:
    """Rows that figures and summaries need: every plain CFA, named design and answer, and the best swept designs."""

    def __init__(self, schema: pa.Schema, order: list[str], scenario: str) -> None:
        """`order`: columns that say what is best, all maximized; swept designs count in `scenario` alone."""
        self._order, self._scenario = order, scenario
        self._always: list[pa.Table] = [schema.empty_table()]
        self._best: dict[str, pa.Table] = {}

    def add(self, table: pa.Table) -> None:
        """Take in a table."""
        always = holds(table, "kind", *_ALWAYS)
        if always.any():
            self._always.append(table.filter(pa.array(always)))
        candidates = holds(table, "kind", "sweep") & holds(table, "scenario", self._scenario)
        swept = table.filter(pa.array(candidates & table["feasible"].to_numpy()))
        for cfa in swept["cfa"].unique().to_pylist():
            own = swept.filter(pa.array(holds(swept, "cfa", cfa)))
            both = pa.concat_tables([self._best[cfa], own]) if cfa in self._best else own
            self._best[cfa] = best_rows(both, self._order, BEST_PER_CFA)

    def frame(self, front: Front) -> pd.DataFrame:
        """All of them, `pareto` as on the whole front; ordered by their ids."""
        tables = [*self._always, *self._best.values()]
        frame: pd.DataFrame = front.marked(pa.concat_tables(tables).unify_dictionaries()).to_pandas()
        return frame.sort_values("design_id", ignore_index=True)


def compact(
    tables: Callable[[], Iterator[pa.Table]], path: Path, rules: Rules, highlights: Highlights
) -> tuple[Front, Front]:
    """Write all tables as one file, atomically; the front of all rows and that of the swept ones alone.

    `tables` is run through twice. No more than a row group is in memory at a time. Raises OutputError when the disk
    refuses.
    """
    front, swept = Front(rules.front), Front(rules.front, "sweep")
    for table in tables():
        for each in (front, swept, highlights):
            each.add(table)
    front.finish()
    swept.finish()
    with atomic(path) as hidden, pq.ParquetWriter(hidden, rules.schema) as writer:
        waiting: list[pa.Table] = []
        for table in tables():
            waiting.append(front.marked(table))
            if sum(part.num_rows for part in waiting) >= ROW_GROUP:
                writer.write_table(pa.concat_tables(waiting).unify_dictionaries(), row_group_size=ROW_GROUP)
                waiting = []
                release_memory()
        if waiting:
            writer.write_table(pa.concat_tables(waiting).unify_dictionaries(), row_group_size=ROW_GROUP)
    release_memory()
    return front, swept
