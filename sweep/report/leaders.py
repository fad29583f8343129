"""Leaders of a scenario, their names in sentences, and the upper bound that holds for them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

from ..base.errors import UpperBoundExceededError, ValidationIssue
from ..metrics.columns.pixel_separation import CHROMATIC_PIXEL_CSD, PIXEL_CSD
from ..metrics.columns.sensitivity import CFA_SENSITIVITY
from ..metrics.quantity import DN
from ..results.facts import SearchFacts
from ..results.output import Output
from ..results.tables import NAMED, REFERENCE, RGGB, SEARCHED, SWEPT
from ..study.schema import Modification

if TYPE_CHECKING:
    import pandas as pd

Row = Mapping[Any, Any]


@dataclass(frozen=True)
class Leaders:
    """Leading rows of a scenario.

    `chosen`: best swept or searched design that meets all constraints; without such designs, the CFA or named design
    that does and separates most.
    """

    scenario: str
    chosen: Row | None
    separates: Row | None
    plain: Row | None
    others: tuple[Row, ...]


def leaders_of(output: Output, scenario: str | None = None) -> Leaders:
    """Return the leaders of a scenario.

    `scenario`: scenario; left out, that of the search, or the first one.
    """
    scenario = output.scenario if scenario is None else scenario
    return output.cached(("leaders", scenario), partial(_leaders, output, scenario))


def _leaders(output: Output, scenario: str) -> Leaders:
    separation = output.trade_off[0].name
    rows = output.table[(output.table["scenario"] == scenario) & (output.table["status"] == "ok")]
    best = output.best[output.best["scenario"] == scenario]
    has_filters = rows["kind"].isin([SWEPT, SEARCHED]).any()
    chosen = _first(best) if has_filters else _most(rows[rows["feasible"]], separation)
    plain = rows[rows["kind"] == REFERENCE]
    others: tuple[Row, ...] = ()
    if chosen is not None:
        plain = plain[plain["design_id"] != chosen["design_id"]]
        others = tuple(best[best["cfa"] != chosen["cfa"]].drop_duplicates("cfa").to_dict("records"))
    return Leaders(scenario, chosen, _most(rows, separation), _most(plain, separation), others)


def _first(rows: pd.DataFrame) -> Row | None:
    return None if rows.empty else rows.iloc[0].to_dict()


def _most(rows: pd.DataFrame, column: str) -> Row | None:
    """Return the row with the largest value; of equal ones a named one, then that with the most light."""
    most = rows[rows[column] == rows[column].max()]
    named = most[most["name"].notna()]
    return _first((most if named.empty else named).sort_values(CFA_SENSITIVITY, ascending=False, kind="stable"))


def of_reference(output: Output) -> str:
    """Return the unit of a CFA's light: a clear sensor's, or that of the brightest curve in every pixel."""
    sensor = output.provenance.sensor
    return "of a clear sensor's light" if sensor.has_clear else f"of the light of {sensor.reference} pixels alone"


def label(row: Row) -> str:
    """Return a design's name, or its number."""
    return str(row["name"]) if isinstance(row["name"], str) else f"filter {row['filter_id']}"


def upper_bound(output: Output) -> SearchFacts | None:
    """Return the search that proved an upper bound on the separation of the trade-off.

    `upper_bound_proven` bounds any filter in one channel of a CFA, in one scenario, before quantization, under the
    study's constraints, between the least transmission and the replaced curve, of the kinds and spaces in `bounded`.

    None without one.
    """
    search = output.provenance.search
    if search is None or search.upper_bound_proven is None or output.goal.name != output.trade_off[0].name:
        return None
    return search


def upper_bound_beside(output: Output, row: Row) -> float | None:
    """Return the upper bound that holds for a row's filter and is not below the row's value.

    A value that is read out may exceed a bound before quantization by its rounding, at most sqrt(channels) DN, or 2 DN
    with every pixel counted; no bound stands beside such a value.

    Raises UpperBoundExceededError if a value exceeds its bound by more.
    """
    search = upper_bound(output)
    if search is None or not row["feasible"] or row["scenario"] != search.scenario or row["kind"] == REFERENCE:
        return None
    if search.upper_bound_proven is None or f"{row['kind']} {row['space']}" not in search.bounded:
        return None
    value, bound = float(row[output.goal.name]), search.upper_bound_proven
    if value <= bound:
        return bound
    by_pixel = output.goal.metric in (PIXEL_CSD, CHROMATIC_PIXEL_CSD)
    rounding = 2.0 if by_pixel else math.sqrt(len(output.mosaic(search.cfa).channels))
    if output.goal.unit == DN and value > bound + rounding:
        problem = f"upper bound exceeded (bug): {label(row)} has {value:.9g} DN, but its upper bound is {bound:.9g} DN"
        raise UpperBoundExceededError(ValidationIssue(f"{problem}; this is an error of the program, not of the study"))
    return None


def bounds_figure(output: Output, scenario: str, cfa: str) -> bool:
    """Return whether the upper bound holds for all filters that are drawn of a CFA in a scenario."""
    search = upper_bound(output)
    if search is None or (scenario, cfa) != (search.scenario, search.cfa):
        return False
    rows = output.kind(SWEPT, NAMED)
    rows = rows[rows["cfa"] == cfa]
    return {f"{kind} {space}" for kind, space in zip(rows["kind"], rows["space"], strict=True)} <= {*search.bounded}


def answering(output: Output) -> Row | None:
    """Return the design that a page is about: the best one, or where that is a plain CFA, the best named design."""
    leaders = leaders_of(output)
    chosen = leaders.chosen
    if chosen is not None and chosen["kind"] != REFERENCE:
        return chosen
    rows = output.kind(NAMED)
    rows = rows[(rows["scenario"] == leaders.scenario) & (rows["status"] == "ok")]
    return _most(rows, output.trade_off[0].name)


def reference_of(output: Output, scenario: str) -> Row | None:
    """Return the plain CFA to compare with: RGGB, else the one that separates most."""
    rows = output.kind(REFERENCE)
    rows = rows[(rows["scenario"] == scenario) & (rows["status"] == "ok")]
    rggb = rows[rows["name"] == RGGB]
    return _first(rggb) if len(rggb) else _most(rows, output.trade_off[0].name)


def own_tile(output: Output, row: Row) -> Row | None:
    """Return the plain CFA whose pixel a design modifies, where the study has it."""
    bases = {entry.cfa: dict.fromkeys(entry.channel, entry.base) for entry in modifications(output)}.get(row["cfa"], {})
    mosaic = output.mosaic(row["cfa"])
    name = "".join(bases.get(mosaic.channels[at]) or mosaic.channels[at] for line in mosaic.tile for at in line)
    rows = output.kind(REFERENCE)
    return _first(rows[(rows["scenario"] == row["scenario"]) & (rows["name"] == name)])


def modifications(output: Output) -> list[Modification]:
    """Return the study's named designs, sweeps and boxes; of a box over tiles that of the best tile."""
    study, search = output.study, output.provenance.search
    boxes = [box for name, box in study.boxes.items() if not box.group or (search is not None and name == search.space)]
    return [*study.designs.values(), *study.sweeps.values(), *boxes]
