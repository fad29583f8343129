"""Leaders of a scenario: under the constraints, in separation, and for their exposure."""

from __future__ import annotations

from collections.abc import Mapping
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
    CFA or named design that does and separates most; None where none does. `separates`, `per_exposure`: the largest
    separation of all rows, and for each millisecond of exposure, whatever the constraints. `plain`: the other
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
    """Return the leaders of a scenario, by default in that of the search, or in the first one."""
    scenario = output.scenario if scenario is None else scenario
    return output.once(("leaders", scenario), partial(_leaders, output, scenario))


def _leaders(output: Output, scenario: str) -> Leaders:
    separation = output.trade_off[0].name
    rows = output.table[(output.table["scenario"] == scenario) & (output.table["status"] == "ok")]
    best = output.best[output.best["scenario"] == scenario]
    made = rows["kind"].isin([SWEPT, FOUND]).any()
    chosen = _first(best) if made else _most(rows[rows["feasible"]], separation)
    plain = rows[rows["kind"] == PLAIN]
    others: tuple[Row, ...] = ()
    if chosen is not None:
        plain = plain[plain["design_id"] != chosen["design_id"]]
        others = tuple(best[best["cfa"] != chosen["cfa"]].drop_duplicates("cfa").to_dict("records"))
    rate = _most(rows, per_exposure(separation))
    return Leaders(scenario, chosen, _most(rows, separation), rate, _most(plain, separation), others)


def _first(rows: pd.DataFrame) -> Row | None:
    return None if rows.empty else rows.iloc[0].to_dict()


def _most(rows: pd.DataFrame, column: str) -> Row | None:
    """The row with the largest value; of equal ones a CFA or design with a name, then the first one."""
    most = rows[rows[column] == rows[column].max()]
    named = most[most["name"].notna()]
    return _first(most if named.empty else named)
