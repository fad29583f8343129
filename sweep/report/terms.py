"""Words that a newcomer needs: constraints as people say them, and what the terms of the first screen mean."""

from __future__ import annotations

import math
from collections.abc import Iterator

from ..metrics.bound import FEASIBLE, Bound
from ..metrics.quantity import DN, Column
from ..results.output import Output
from ..results.tables import FOUND, NAMED, SWEPT
from .leaders import Row
from .names import capital
from .values import modifications


def constraint_told(output: Output, name: str, bound: Bound) -> str:
    """What a constraint asks for: `slope at most 0.06 per nm`."""
    words, column = output.words(name), output.columns.get(name)
    if bound.min is None or bound.max is None:
        least, end = ("least", bound.min) if bound.max is None else ("most", bound.max)
        return f"{words} at {least} {_amount(column, end)}"
    if bound.min == bound.max:
        return f"{words} of {_amount(column, bound.min)}"
    return f"{words} from {bound.min:g} to {_amount(column, bound.max)}"


def constraints_told(output: Output) -> str:
    """What all constraints ask for; empty where there are none."""
    return " and ".join(constraint_told(output, name, bound) for name, bound in output.constraints.items())


def missed_told(output: Output, row: Row) -> str:
    """Which constraints a row does not meet: `its sensitivity is below 0.9`; empty where it meets all."""
    parts = list[str]()
    for name, bound in output.constraints.items():
        value = float(row[name])
        if math.isnan(value):
            parts.append(f"its {output.words(name)} {'' if parts else 'is '}unknown")
        for side, end, past in (("below", bound.min, -1), ("above", bound.max, 1)):
            if end is not None and past * (value - end) / bound.scale > FEASIBLE:
                verb = "" if parts else "is "
                parts.append(f"its {output.words(name)} {verb}{side} {_amount(output.columns.get(name), end)}")
    return " and ".join(parts)


def unknown_lines(output: Output) -> Iterator[str]:
    """Say which constrained quantities designs lack; unknown is not feasible."""
    rows = output.kind(NAMED, SWEPT, FOUND)
    rows = rows[rows["status"] == "ok"]
    for name in output.constraints:
        unknown = rows[rows[name].isna()]
        if len(unknown):
            families = ", ".join(dict.fromkeys(map(str, unknown["family"])))
            yield f"Designs of {families} have no {output.words(name)}: unknown is not feasible."


def _amount(column: Column | None, value: float | None) -> str:
    """A bound with the unit of its column."""
    unit = "" if column is None else column.unit
    return f"{value:g} {unit.replace('1/', 'per ', 1)}".rstrip()


def terms_of(output: Output) -> list[str]:
    """What the separation of the first screen is and what the constraints bound, and which pixels have a filter of the
    study.
    """
    asked = (output.trade_off[0].name, *output.constraints)
    columns = [output.columns[name] for name in asked if name in output.columns]
    plain = {each.of if each.extreme else each.name: None for each in columns}
    return [*(_meaning(output.columns[name]) for name in plain), *_changed(output)]


def _meaning(column: Column) -> str:
    unit = ", in digital numbers (DN)" if column.unit == DN else ""
    return f"{capital(column.words)}: {column.meaning}{unit}."


def _changed(output: Output) -> Iterator[str]:
    """Which letters of a CFA's name stand for pixels with a filter of the study."""
    changed = {(each.cfa, *each.channel): each.base for each in modifications(output) if each.channel and each.base}
    for (cfa, *channels), base in changed.items():
        what = f"is a {base} pixel whose filter changes"
        if len(channels) > 1:
            what = f"are {base} pixels whose filters change"
        yield f"In {cfa}, {' and '.join(channels)} {what}."
