"""From finished chunks to one table: the front over all of them, and the few rows that reports draw, by streaming."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pyarrow as pa

from ..base.types import BoolArray, FloatArray, IndexArray
from ..metrics.pareto import non_dominated
from ..results.tables import FEW, SWEPT, holds
from ..results.thinning import best_at, best_rows, leading, leading_at
from .rows import Rules

if TYPE_CHECKING:
    import pandas as pd

BEST_PER_CFA = 12
"""Best feasible designs of each CFA's sweeps that the report lists and draws."""
FRONT_ROWS = 200
"""Designs of a front, spread evenly over it, whose curves and signals a report can show."""
_MOST_CANDIDATES, _AT_ONCE = 50_000, 10_000
"""Rows from which on fronts are thinned, and from which on rows that came are taken in."""


class Front:
    """The non-dominated rows of each CFA and scenario, of tables whose `pareto` marks those of each table alone.

    Both quantities of `axes` are maximized. A design takes part when it meets every constraint but those on these two,
    so that the front shows the whole trade-off.
    """

    def __init__(self, axes: tuple[str, str], kind: str | None = None) -> None:
        """`kind`: of the rows that take part; all without one."""
        self._axes, self._kind = axes, kind
        self._groups: dict[tuple[str, str], FloatArray] = {}
        self._on_it: dict[tuple[str, str], set[tuple[float, ...]]] = {}

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
        self._on_it = {group: set(map(tuple, values.tolist())) for group, values in self._groups.items()}

    def points(self, cfa: str, scenario: str) -> FloatArray:
        """The two quantities of a front's rows, ndarray[n, 2], each pair once."""
        return self._groups.get((cfa, scenario), np.empty((0, 2)))

    def holds(self, table: pa.Table) -> BoolArray:
        """Which rows of a table are on the whole front, which is finished, ndarray[n_rows]."""
        local, values, groups = self._candidates(table)
        front: BoolArray = np.zeros(table.num_rows, dtype=bool)
        front[local] = [tuple(v) in self._on_it.get(g, ()) for v, g in zip(values.tolist(), groups, strict=True)]
        return front

    def marked(self, table: pa.Table) -> pa.Table:
        """The table with `pareto` only where a row is on the whole front, which is finished."""
        at, field = table.schema.get_field_index("pareto"), table.schema.field("pareto")
        return table.set_column(at, field, pa.array(self.holds(table)))

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


class Gathered:
    """What a run keeps of its rows: the front of all of them, that of the swept ones, and those that reports draw.

    Those are every plain CFA, named design and answer, in the first scenario the best swept designs of each CFA and
    some of its front, and in each scenario who separates most, and most for its exposure, whatever the constraints.
    """

    def __init__(self, rules: Rules, scenario: str) -> None:
        """`scenario`: the first one, in which swept designs are drawn."""
        self.rules, self.scenario = rules, scenario
        self.front, self.swept = Front(rules.front), Front(rules.front, "sweep")
        self._waiting: list[pa.Table] = []
        self._waiting_rows = 0
        self._always: list[pa.Table] = []
        self._best: dict[str, pa.Table] = {}
        self._feasible: dict[str, pa.Table] = {}
        self._leading: dict[str, pa.Table] = {}

    def add(self, few: pa.Table) -> None:
        """Take in what `few_of` a table gives; several at once, since they are few rows."""
        self._waiting.append(few)
        self._waiting_rows += few.num_rows
        if self._waiting_rows >= _AT_ONCE:
            self._take_in()

    def _take_in(self) -> None:
        if not self._waiting:
            return
        few = pa.concat_tables(self._waiting).unify_dictionaries().combine_chunks()
        self._waiting.clear()
        self._waiting_rows = 0
        self.front.add(few)
        self.swept.add(few)
        always = holds(few, "kind", *FEW)
        if always.any():
            self._always.append(few.filter(pa.array(always)))
        every = few.filter(pa.array(holds(few, "kind", SWEPT)))
        for scenario in every["scenario"].unique().to_pylist():
            own = every.filter(pa.array(holds(every, "scenario", scenario)))
            both = pa.concat_tables([self._leading[scenario], own]) if scenario in self._leading else own
            self._leading[scenario] = leading(both.unify_dictionaries(), self.rules.front[0])
        swept = every.filter(pa.array(holds(every, "scenario", self.scenario) & every["feasible"].to_numpy()))
        for cfa in swept["cfa"].unique().to_pylist():
            own = swept.filter(pa.array(holds(swept, "cfa", cfa)))
            both = pa.concat_tables([self._best[cfa], own]) if cfa in self._best else own
            self._best[cfa] = best_rows(both, self.rules.order, BEST_PER_CFA)
            marked = own.filter(own["pareto"])
            both = pa.concat_tables([self._feasible[cfa], marked]) if cfa in self._feasible else marked
            self._feasible[cfa] = self._non_dominated(both) if both.num_rows > _MOST_CANDIDATES else both

    @property
    def _kept(self) -> list[pa.Table]:
        """Rows that are always drawn. An empty table, for which PyArrow loads pandas, is made when workers are done."""
        return [self.rules.schema.empty_table(), *self._always]

    def _non_dominated(self, table: pa.Table) -> pa.Table:
        values = np.stack([table[name].to_numpy() for name in self.rules.front], axis=1)
        return table.filter(pa.array(non_dominated(values))).combine_chunks()

    def finish(self) -> None:
        """Nothing more comes."""
        self._take_in()
        self.front.finish()
        self.swept.finish()

    def frame(self) -> pd.DataFrame:
        """The rows to draw, `pareto` as on the whole front; ordered by their ids."""
        return self._frame([*self._kept, *self._best.values()])

    def front_frame(self) -> pd.DataFrame:
        """Swept rows: feasible ones of the whole front in the first scenario, evenly up to FRONT_ROWS; who leads."""
        every = leading(
            pa.concat_tables([*self._kept, *self._leading.values()]).unify_dictionaries(), self.rules.front[0]
        )
        tables = [every.filter(pa.array(holds(every, "kind", SWEPT)))]
        for table in self._feasible.values():
            found = self.front.marked(table)
            found = found.filter(found["pareto"]).sort_by([(self.rules.front[1], "ascending")])
            spread = np.linspace(0, max(0, found.num_rows - 1), min(FRONT_ROWS, found.num_rows)).round().astype(int)
            tables.append(found.take(pa.array(spread)))
        return self._frame(tables)

    def _frame(self, tables: list[pa.Table]) -> pd.DataFrame:
        frame: pd.DataFrame = self.front.marked(pa.concat_tables(tables).unify_dictionaries()).to_pandas()
        return frame.drop_duplicates("design_id").sort_values("design_id", ignore_index=True)


def few_of(table: pa.Table, rules: Rules) -> pa.Table:
    """The rows of a chunk that `Gathered` may keep: its front, those that are no sweep, its best designs, who leads."""
    wanted = table["pareto"].to_numpy() | holds(table, "kind", *FEW)
    best = best_at(table, rules.order, BEST_PER_CFA, table["feasible"].to_numpy() & ~wanted)
    leaders = leading_at(table, rules.front[0], ~wanted)
    found = dict.fromkeys([*np.flatnonzero(wanted).tolist(), *best.tolist(), *leaders.tolist()])
    return table.take(np.array([*found], dtype=np.int64)).combine_chunks()
