"""The large numbers of the first screen: separation, light, and what is left up to the limit."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ..metrics.columns.confusion import CNR, D_PRIME
from ..metrics.columns.sensitivity import CFA_SENSITIVITY
from ..metrics.quantity import DECADES
from ..results.output import Output
from ..results.tables import PLAIN
from ..results.thinning import per_exposure
from .leaders import Row, leaders_of
from .names import of_reference, rate_told
from .noise import UsableEnds, usable_ends
from .series import SeriesFigure, leads_of
from .upper_bound import upper_bound_beside
from .values import series_figures


@dataclass(frozen=True)
class LargeNumber:
    """A large number of the first screen: `value` with its unit, what it is, and what it compares with."""

    value: str
    name: str
    comparison: str


def large_numbers(output: Output) -> list[LargeNumber]:
    """Separation, light and distance to the upper bound of the best one; else what it separates for its exposure.

    Over scenarios that differ in one number: who leads first, its light, and up to where. Where the question is of
    noise: how much the one bears that bears most, and its light.
    """
    ends = list(usable_ends(output))
    if ends and output.best.empty:
        return list(_numbers_under_noise(output, ends))
    figures = sorted(series_figures(output), key=lambda series: len(leads_of(series)) < 2)
    if figures and output.best.empty:
        return list(_numbers_over(output, figures[0]))
    leaders = leaders_of(output)
    best, plain, separation = leaders.chosen, leaders.plain, output.trade_off[0]
    if best is None:
        return []
    value, measure = float(best[separation.name]), per_exposure(separation.name)
    against = _beside(plain, separation.name, value, separation.told)
    if plain is not None and separation.unit == DECADES:
        against = f"{plain['name']} {separation.told(float(plain[separation.name]))}"
    numbers = [
        LargeNumber(separation.told(value), separation.words, against),
        LargeNumber(
            f"{best[CFA_SENSITIVITY]:.3f}",
            of_reference(output),
            _beside(plain, CFA_SENSITIVITY, float(best[CFA_SENSITIVITY]), "{:.3f}".format),
        ),
    ]
    bound = upper_bound_beside(output, best)
    if bound is not None:
        shown = f"{separation.told_bound(bound.value)}: proven under the same constraints, before quantization"
        name = f"below the upper bound for any filter in {bound.channel} of {bound.cfa}"
        numbers.append(LargeNumber(separation.told(bound.value - value), name, shown))
    elif best[measure] == best[measure] and separation.unit != DECADES and separation.metric not in (D_PRIME, CNR):
        rate = float(best[measure])
        beside = _beside(plain, measure, rate, rate_told)
        numbers.append(LargeNumber(f"{rate_told(rate)} {separation.unit}", "per ms of exposure", beside))
    return numbers


def _numbers_under_noise(output: Output, ends: Sequence[UsableEnds]) -> Iterator[LargeNumber]:
    """Of the one that stays usable longest in the first series: its ends, beside the best plain CFA, and its light."""
    name = next(iter(ends[0].at))
    rows = {str(row["name"]): row for row in output.few.to_dict("records")}
    plain = next((other for other in ends[0].at if rows[other]["kind"] == PLAIN and other != name), None)
    numbers = [
        LargeNumber(
            f"{end.told(name)}{'' if ' ' in end.unit else f' {end.unit}'}".rstrip(),
            f"{f'of {end.unit}: ' if ' ' in end.unit else ''}{'most' if end.more else 'least'} {end.name} "
            f"for an error of {end.error_max:g}, {name}",
            f"{plain} {end.told(plain)}{'' if ' ' in end.unit else f' {end.unit}'}".rstrip()
            if plain is not None and plain in end.at
            else "",
        )
        for end in ends
        if name in end.at
    ]
    light = float(rows[name][CFA_SENSITIVITY])
    beside = _beside(None if plain is None else rows[plain], CFA_SENSITIVITY, light, "{:.3f}".format)
    yield numbers[0]
    yield LargeNumber(f"{light:.3f}", of_reference(output), beside)
    yield from numbers[1:2]


def _numbers_over(output: Output, series: SeriesFigure) -> Iterator[LargeNumber]:
    """Of the first one that leads in a series: separation, light beside the plain CFA that separates most there, and
    where its lead ends.
    """
    separation, (_, unit) = output.trade_off[0], series.quantity
    leads = leads_of(series)
    name, start, stop = next((lead for lead in leads if lead[0] is not None), (None, 0, 0))
    if name is None:
        return
    others = {other: line.y for other, line in series.lines.items() if other != name}

    def at(place: int) -> str:
        return f"{series.x[place]:g} {unit}".rstrip()

    def rival(place: int) -> str:
        ranked = sorted(others, key=lambda other: -np.nan_to_num(others[other][place], nan=-np.inf))
        return "" if not ranked else f"{ranked[0]} {separation.told(others[ranked[0]][place])}"

    own = series.lines[name].y
    yield LargeNumber(separation.told(own[start]), f"{separation.words}, {name} at {at(start)}", rival(start))
    rows = {str(row["name"]): row for row in output.few.to_dict("records")}
    light = float(rows[name][CFA_SENSITIVITY])
    plain = [other for other in others if rows[other]["kind"] == PLAIN]
    most = max(plain, key=lambda other: np.nan_to_num(others[other][start], nan=-np.inf), default="")
    beside = _beside(rows.get(most), CFA_SENSITIVITY, light, "{:.3f}".format)
    yield LargeNumber(f"{light:.3f}", of_reference(output), beside)
    figures = ", ".join(part for part in (f"{separation.told(own[stop])}", rival(stop)) if part)
    yield LargeNumber(at(stop), f"{name} leads up to here" if leads[-1][2] != stop else "and still leads here", figures)


def _beside(other: Row | None, column: str, value: float, told: Callable[[float], str]) -> str:
    """A value as a multiple of that of a plain CFA."""
    if other is None or not float(other[column]) > 0:
        return ""
    return f"{value / float(other[column]):.2f} times {other['name']} ({told(float(other[column]))})"
