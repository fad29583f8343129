"""Who leads in a scenario: under the constraints, in separation, and for its exposure."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

from ..results.output import Output
from ..results.tables import FOUND, PLAIN, SWEPT
from ..results.thinning import per_exposure

if TYPE_CHECKING:
    import pandas as pd

Row = Mapping[Any, Any]


@dataclass(frozen=True)
class Leaders:
    """Rows of a scenario.

    `chosen`: the best design that the study swept or searched and that meets all constraints; without such designs the
    CFA or named design that does and separates most; None where none does. `separates`, `per_exposure`: who
    separates most of all rows, and most for each millisecond of exposure, whatever the constraints. `plain`: the other
    plain CFA that separates most, with which the chosen one is compared. `others`: the best design of each other CFA
    whose designs the study swept or searched.
    """

    scenario: str
    chosen: Row | None
    separates: Row | None
    per_exposure: Row | None
    plain: Row | None
    others: tuple[Row, ...]


def leaders_of(output: Output, scenario: str | None = None) -> Leaders:
    """Return who leads in a scenario, by default in that of the search, or in the first one."""
    scenario = output.scenario if scenario is None else scenario
    return output.once(("leaders", scenario), partial(_leaders, output, scenario))


def _leaders(output: Output, scenario: str) -> Leaders:
    separation = output.trade_off[0].name
    best = output.best
    rows = output.table[(output.table["scenario"] == scenario) & (output.table["status"] == "ok")]
    made = rows["kind"].isin([SWEPT, FOUND])
    own = best[best["scenario"] == scenario]
    chosen = _first(own) if made.any() else _most(rows[rows["feasible"]], separation)
    others = rows if chosen is None else rows[rows["design_id"] != chosen["design_id"]]
    return Leaders(
        scenario,
        chosen,
        _most(rows, separation),
        _most(rows, per_exposure(separation)),
        _most(others[others["kind"] == PLAIN], separation),
        () if chosen is None else tuple(_best_of_others(own, str(chosen["cfa"]))),
    )


def _best_of_others(best: pd.DataFrame, cfa: str) -> Iterator[Row]:
    """The first row of each CFA but `cfa`."""
    for name, rows in best[best["cfa"].astype(str) != cfa].groupby("cfa", sort=False, observed=True):
        del name
        yield rows.iloc[0].to_dict()


def _first(rows: pd.DataFrame) -> Row | None:
    return None if rows.empty else rows.iloc[0].to_dict()


def _most(rows: pd.DataFrame, column: str) -> Row | None:
    """The row with the largest value; of equal ones a CFA or design with a name, then the first one."""
    most = rows[rows[column] == rows[column].max()]
    named = most[most["name"].notna()]
    return _first(most if named.empty else named)
