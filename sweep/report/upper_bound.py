"""Upper bound of any filter beside the designs that it bounds, and beside no others."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..base.errors import BrokenProofError, Fault
from ..metrics.quantity import DN
from ..results.output import Output
from ..results.tables import NAMED, PLAIN, SWEPT
from .leaders import Row
from .names import label


@dataclass(frozen=True)
class UpperBound:
    """Upper bound on the separation of any filter in one channel of a CFA, in one scenario, before quantization.

    It holds under the study's constraints, for filters between the least transmission and the curve that they replace;
    `bounded`: kind and name of the study's spaces of such filters.
    """

    value: float
    scenario: str
    cfa: str
    channel: str
    bounded: tuple[str, ...]


def upper_bound(output: Output) -> UpperBound | None:
    """Return the upper bound that the search proved on the separation of the trade-off; None without one."""
    search = output.provenance.search
    if search is None or search.limit_proven is None or output.goal.name != output.trade_off[0].name:
        return None
    return UpperBound(search.limit_proven, search.scenario, search.cfa, search.channel, search.bounded)


def upper_bound_beside(output: Output, row: Row) -> UpperBound | None:
    """Return the upper bound that holds for a row's filter and is not below the row's value.

    A value that is read out may be above a bound before quantization by its rounding, sqrt(channels) DN at most; no
    bound stands beside such a value. Raises BrokenProofError where a value is farther above its bound.
    """
    bound = upper_bound(output)
    if bound is None or not row["feasible"] or row["scenario"] != bound.scenario or row["kind"] == PLAIN:
        return None
    if f"{row['kind']} {row['space']}" not in bound.bounded:
        return None
    value = float(row[output.goal.name])
    if value <= bound.value:
        return bound
    rounding = math.sqrt(len(output.mosaic(bound.cfa).channels))
    if output.goal.unit == DN and value > bound.value + rounding:
        problem = f"broken proof: {label(row)} has {value:.9g} DN, but its upper bound is {bound.value:.9g} DN"
        raise BrokenProofError(Fault(f"{problem}; this is a fault of the program, not of the study"))
    return None


def limit_name(output: Output) -> str:
    """Name the filters that the search's upper bound is of, for a legend; empty without a search."""
    search = output.provenance.search
    return "" if search is None else f"upper bound for {search.channel} of {search.cfa}, unquantized"


def bounds_figure(output: Output, scenario: str, cfa: str) -> bool:
    """Return whether the search's upper bound holds for all filters that are drawn of a CFA in a scenario."""
    bound = upper_bound(output)
    if bound is None or (scenario, cfa) != (bound.scenario, bound.cfa):
        return False
    rows = output.kind(SWEPT, NAMED)
    rows = rows[rows["cfa"] == cfa]
    return {f"{kind} {space}" for kind, space in zip(rows["kind"], rows["space"], strict=True)} <= {*bound.bounded}
