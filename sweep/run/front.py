"""Rows of the report and Pareto front of a run, reduced from its tables as they come."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pyarrow as pa

from ..base.types import Array, Bool, BoolArray, Float, IndexArray, Int
from ..metrics.pareto import non_dominated
from ..results.tables import NAMED_KINDS, SWEPT, word_mask
from ..results.thinning import best_at, leading_rows, row_groups
from .routes import Rules

if TYPE_CHECKING:
    import pandas as pd

BEST_PER_CFA = 12
"""Best feasible designs of each CFA's sweeps that the report lists and draws."""
FRONT_ROWS = 200
"""Designs of a front, spread evenly over it, whose curves and signals a report can show."""
_AT_ONCE = 50_000
"""Rows that are held before they are reduced."""
_Group = tuple[str, str]
"""A CFA and a scenario."""


def report_rows(table: pa.Table, rules: Rules) -> pa.Table:
    """Select the rows that a report may need: front, best and leading rows of each CFA and scenario.

    Plain CFAs, named designs and answers are all kept. `pareto` marks the front of any part of a run's rows, so that
    the function may be applied again to concatenated results.
    """
    is_named, on_front = word_mask(table, "kind", *NAMED_KINDS), table["pareto"].to_numpy()
    feasible = table["feasible"].to_numpy()
    selected = [np.flatnonzero(is_named), leading_rows(table, rules.front[0], ~is_named)]
    for at in row_groups(table).values():
        swept = at[~is_named[at]]
        marked = swept[on_front[swept]]
        selected.append(marked[non_dominated(_values(table.take(marked), rules.front))])
        eligible = np.zeros(table.num_rows, dtype=bool)
        eligible[swept] = feasible[swept]
        selected.append(best_at(table, rules.order, BEST_PER_CFA, eligible))
    return table.take(np.unique(np.concatenate(selected)).astype(np.int64)).combine_chunks()


def _values(table: pa.Table, axes: tuple[str, str]) -> Float[Array, "rows objectives"]:
    return np.stack([table[name].to_numpy() for name in axes], axis=1)


class RunRows:
    """Rows of a run that its report shows, and the Pareto front of each CFA and scenario."""

    def __init__(self, rules: Rules, scenario: str) -> None:
        self.rules, self.scenario = rules, scenario
        self._waiting: list[pa.Table] = []
        self._rows = pa.table({})
        self._front: dict[_Group, set[tuple[float, ...]]] = {}

    def add(self, rows: pa.Table) -> None:
        """Add the result of `report_rows` for a part of the rows."""
        self._waiting.append(rows)
        if sum(table.num_rows for table in self._waiting) > _AT_ONCE:
            self._waiting = [report_rows(self._all(), self.rules)]

    def _all(self) -> pa.Table:
        return (
            pa.concat_tables([self.rules.schema.empty_table(), *self._waiting])
            .unify_dictionaries()
            .combine_chunks()
            .sort_by("design_id")
        )

    def finish(self) -> None:
        """Compute the front of the whole run, after all rows were added."""
        self._rows, self._waiting = self._all(), []
        marked = self._rows.filter(self._rows["pareto"])
        for group, at in row_groups(marked).items():
            values = _values(marked.take(at), self.rules.front)
            self._front[group] = set(map(tuple, values[non_dominated(values)].tolist()))

    def marked(self, table: pa.Table) -> pa.Table:
        """Return a table of the run with `pareto` only where a row is on the front of the whole run."""
        front: BoolArray = np.zeros(table.num_rows, dtype=bool)
        local = np.flatnonzero(table["pareto"].to_numpy())
        marked_rows = table.take(local)
        groups = zip(marked_rows["cfa"].to_pylist(), marked_rows["scenario"].to_pylist(), strict=True)
        values = map(tuple, _values(marked_rows, self.rules.front).tolist())
        front[local] = [pair in self._front[group] for pair, group in zip(values, groups, strict=True)]
        at = table.schema.get_field_index("pareto")
        return table.set_column(at, table.schema.field(at), pa.array(front))

    def frame(self) -> pd.DataFrame:
        """Return the rows to draw: all that are not swept, and the first scenario's best swept rows of each CFA."""
        is_named, drawn = word_mask(self._rows, "kind", *NAMED_KINDS), self._drawn()
        best = [
            best_at(self._rows, self.rules.order, BEST_PER_CFA, drawn & word_mask(self._rows, "cfa", cfa))
            for cfa in self._cfas()
        ]
        return self._frame([np.flatnonzero(is_named), *best])

    def front_frame(self) -> pd.DataFrame:
        """Return swept rows: an even sample of the first scenario's feasible front, and those that lead a scenario."""
        leaders = leading_rows(self._rows, self.rules.front[0])
        at = [leaders[word_mask(self._rows, "kind", SWEPT)[leaders]]]
        front = self._drawn() & self.marked(self._rows)["pareto"].to_numpy()
        sensitivity = self._rows[self.rules.front[1]].to_numpy()
        for cfa in self._cfas():
            rows = np.flatnonzero(front & word_mask(self._rows, "cfa", cfa))
            rows = rows[np.argsort(sensitivity[rows], kind="stable")]
            at.append(rows[np.linspace(0, max(0, rows.size - 1), min(FRONT_ROWS, rows.size)).round().astype(int)])
        return self._frame(at)

    def _drawn(self) -> Bool[BoolArray, " points"]:
        """Return the feasible swept rows of the first scenario."""
        swept = word_mask(self._rows, "kind", SWEPT) & word_mask(self._rows, "scenario", self.scenario)
        return np.asarray(swept & self._rows["feasible"].to_numpy())

    def _cfas(self) -> list[str]:
        return list(self._rows["cfa"].unique().to_pylist())

    def _frame(self, at: list[Int[IndexArray, " _rows"]]) -> pd.DataFrame:
        """Return the rows at some indices, each once, in the order of their ids."""
        frame: pd.DataFrame = self.marked(self._rows.take(np.unique(np.concatenate(at)))).to_pandas()
        return frame
