"""The large numbers of the first screen: separation, light, and the distance to the upper bound."""

from __future__ import annotations

from collections.abc import Callable

from ..metrics.columns.confusion import CNR, D_PRIME
from ..metrics.columns.sensitivity import CFA_SENSITIVITY
from ..metrics.quantity import DECADES
from ..results.output import Output
from ..results.thinning import per_exposure
from .leaders import leaders_of
from .names import of_reference, rate_told
from .upper_bound import upper_bound_beside


def large_numbers(output: Output) -> list[tuple[str, str, str]]:
    """(value, name, comparison) of separation, light and distance to the upper bound of the best design.

    Without a bound, its separation per exposure. Without a best design there are none.
    """
    leaders = leaders_of(output)
    best, plain, separation = leaders.chosen, leaders.plain, output.trade_off[0]
    if best is None:
        return []

    def beside(column: str, told: Callable[[float], str]) -> str:
        """A value as a multiple of that of a plain CFA."""
        if plain is None or not float(plain[column]) > 0:
            return ""
        if column == separation.name and separation.unit == DECADES:  # a ratio of logarithms says nothing
            return f"{plain['name']} {told(float(plain[column]))}"
        return f"{best[column] / plain[column]:.2f} times {plain['name']} ({told(float(plain[column]))})"

    value, measure = float(best[separation.name]), per_exposure(separation.name)
    light = beside(CFA_SENSITIVITY, "{:.3f}".format)
    numbers = [
        (separation.told(value), separation.words, beside(separation.name, separation.told)),
        (f"{best[CFA_SENSITIVITY]:.3f}", of_reference(output), light),
    ]
    bound = upper_bound_beside(output, best)
    if bound is not None:
        shown = f"{separation.told_bound(bound.value)}: proven under the same constraints, before quantization"
        name = f"below the upper bound for any filter in {bound.channel} of {bound.cfa}"
        numbers.append((separation.told(bound.value - value), name, shown))
    elif best[measure] == best[measure] and separation.unit != DECADES and separation.metric not in (D_PRIME, CNR):
        rate = f"{rate_told(float(best[measure]))} {separation.unit}"
        numbers.append((rate, "per ms of exposure", beside(measure, rate_told)))
    return numbers
