"""Upper bound of any filter beside the designs that it bounds, and beside no others."""

from __future__ import annotations

import math

from ..base.errors import BrokenProofError, Fault
from ..metrics.quantity import DN
from ..results.facts import SearchFacts
from ..results.output import Output
from ..results.tables import NAMED, PLAIN, SWEPT
from .leaders import Row
from .names import label


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


def limit_name(output: Output) -> str:
    """Name the filters of the search's upper bound for a legend; empty without a search."""
    search = output.provenance.search
    return "" if search is None else f"upper bound for {search.channel} of {search.cfa}, unquantized"


def bounds_figure(output: Output, scenario: str, cfa: str) -> bool:
    """Return whether the search's upper bound holds for all filters that are drawn of a CFA in a scenario."""
    search = upper_bound(output)
    if search is None or (scenario, cfa) != (search.scenario, search.cfa):
        return False
    rows = output.kind(SWEPT, NAMED)
    rows = rows[rows["cfa"] == cfa]
    return {f"{kind} {space}" for kind, space in zip(rows["kind"], rows["space"], strict=True)} <= {*search.bounded}
