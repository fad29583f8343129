"""Leaders of a scenario, their names in sentences, and the upper bound that holds for them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

from ..base.errors import BrokenProofError, Fault
from ..metrics.quantity import DN
from ..results.facts import SearchFacts
from ..results.output import Output
from ..results.tables import FOUND, NAMED, PLAIN, SWEPT

if TYPE_CHECKING:
    import pandas as pd

Row = Mapping[Any, Any]


@dataclass(frozen=True)
class Leaders:
    """Rows of a scenario.

    `chosen`: the best design that the study swept or searched and that meets all constraints; without such designs the
    CFA or named design that does and separates most; None where none does. `separates`: the largest separation of all
    rows, whatever the constraints. `plain`: the other plain CFA that separates most, with which the chosen one is
    compared. `others`: the best design of each other CFA whose designs the study swept or searched.
    """

    scenario: str
    chosen: Row | None
    separates: Row | None
    plain: Row | None
    others: tuple[Row, ...]


def leaders_of(output: Output, scenario: str | None = None) -> Leaders:
    """Return the leaders of a scenario, by default of that of the search, or of the first one."""
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
    return Leaders(scenario, chosen, _most(rows, separation), _most(plain, separation), others)


def _first(rows: pd.DataFrame) -> Row | None:
    return None if rows.empty else rows.iloc[0].to_dict()


def _most(rows: pd.DataFrame, column: str) -> Row | None:
    """The row with the largest value; of equal ones a CFA or design with a name, then the first one."""
    most = rows[rows[column] == rows[column].max()]
    named = most[most["name"].notna()]
    return _first(most if named.empty else named)


def of_reference(output: Output) -> str:
    """Name the unit of a CFA's light: a clear sensor's, or that of the brightest curve in every pixel."""
    sensor = output.provenance.sensor
    return "of a clear sensor's light" if sensor.has_clear else f"of the light of {sensor.reference} pixels alone"


def label(row: Row) -> str:
    """Return a design's name, or its number."""
    return str(row["name"]) if isinstance(row["name"], str) else f"filter {row['filter_id']}"


def full_name(row: Row) -> str:
    """Name a design in a sentence: a CFA or named design by its name, others with the CFA that they are made in."""
    if row["kind"] in (PLAIN, NAMED):
        return label(row)
    return f"the {label(row)} of {row['cfa']}" if row["kind"] == FOUND else f"{label(row)} of {row['cfa']}"


def capital(text: str) -> str:
    """Begin a sentence with an upper-case letter."""
    return text[:1].upper() + text[1:]


def upper_bound(output: Output) -> SearchFacts | None:
    """Return the search that proved an upper bound on the separation of the trade-off; None without one.

    `limit_proven` is the bound of any filter in one channel of a CFA, in one scenario, before quantization. It holds
    under the study's constraints, for filters between the least transmission and the curve that they replace, of the
    kinds and spaces in `bounded`.
    """
    search = output.provenance.search
    if search is None or search.limit_proven is None or output.goal.name != output.trade_off[0].name:
        return None
    return search


def upper_bound_beside(output: Output, row: Row) -> float | None:
    """Return the upper bound that holds for a row's filter and is not below the row's value.

    A value that is read out may be above a bound before quantization by its rounding, sqrt(channels) DN at most; no
    bound stands beside such a value. Raises BrokenProofError where a value is farther above its bound.
    """
    search = upper_bound(output)
    if search is None or not row["feasible"] or row["scenario"] != search.scenario or row["kind"] == PLAIN:
        return None
    if search.limit_proven is None or f"{row['kind']} {row['space']}" not in search.bounded:
        return None
    value, bound = float(row[output.goal.name]), search.limit_proven
    if value <= bound:
        return bound
    if output.goal.unit == DN and value > bound + math.sqrt(len(output.mosaic(search.cfa).channels)):
        problem = f"broken proof: {label(row)} has {value:.9g} DN, but its upper bound is {bound:.9g} DN"
        raise BrokenProofError(Fault(f"{problem}; this is a fault of the program, not of the study"))
    return None


def bounds_figure(output: Output, scenario: str, cfa: str) -> bool:
    """Return whether the search's upper bound holds for all filters that are drawn of a CFA in a scenario."""
    search = upper_bound(output)
    if search is None or (scenario, cfa) != (search.scenario, search.cfa):
        return False
    rows = output.kind(SWEPT, NAMED)
    rows = rows[rows["cfa"] == cfa]
    return {f"{kind} {space}" for kind, space in zip(rows["kind"], rows["space"], strict=True)} <= {*search.bounded}
