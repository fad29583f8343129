"""The answer to a study's question: sentences that can be said in a meeting, and three numbers."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from ..metrics.bound import FEASIBLE
from ..metrics.columns.confusion import CNR, D_PRIME
from ..metrics.columns.sensitivity import CFA_SENSITIVITY
from ..metrics.limiting import limited_by_name
from ..metrics.quantity import DECADES, OF_A_SHARE, WORST_CASE
from ..results.output import Output
from ..results.tables import FOUND, PLAIN, SWEPT
from ..results.thinning import per_light
from .allowed_lamps import lamp_lines
from .assumed import assumed, moves_with_light
from .leaders import Leaders, Row, leaders_of
from .names import capital, full_name
from .noise import usable_lines
from .robustness import over_population, robustness_lines, worst_over
from .series import SeriesFigure, lead_sentence, leads_of
from .unseen import unseen_lines
from .values import series_figures

_BY_NOISE = (D_PRIME, CNR)
"""Metrics of separations in units of the noise."""
_OF_CLEAR = "of a clear sensor's light"


@dataclass(frozen=True)
class LargeNumber:
    """A large number of the first screen: `value` with its unit, what it is, and what it compares with."""

    value: str
    name: str
    comparison: str


def answer_sentences(output: Output) -> list[str]:
    """What images say first; then over scenarios that differ in one number who leads where, else who is best."""
    return [*_of_images(output), *_of_designs(output)]


def _of_images(output: Output) -> Iterator[str]:
    """What the benchmark of vision says, where a study asks for one."""
    if output.study.vision is not None:
        from .vision_tables import vision_sentences  # noqa: PLC0415  (only where a study asks for images)

        yield from vision_sentences(output)


def _of_designs(output: Output) -> list[str]:
    """Over scenarios that differ in one number who leads where; else who is best, and what limits it."""
    searched = output.kind(SWEPT, FOUND)
    if len(searched) and output.best.empty:
        failed = searched[searched["status"] != "ok"]
        if len(failed) == len(searched):
            return [f"Every design failed: {failed['status'].iloc[0]}."]
        return [f"No design is feasible{_under(output)}.", *who_else(output)]
    usable = list(usable_lines(output))
    # Where the question is of noise, separations matter where another CFA begins to lead.
    series = usable + [lead_sentence(s) for s in series_figures(output) if not usable or len(leads_of(s)) > 1]
    if series and output.best.empty:
        return series
    leaders = leaders_of(output)
    lamps = robustness_lines(output, leaders.chosen)
    return [*_best(output, leaders), *lamps, *lamp_lines(output), *who_else(output), *series]


def _under(output: Output) -> str:
    limits = " and ".join(f"{output.words(q)} {bound}" for q, bound in output.constraints.items())
    return f" with {limits}" if limits else ""


def said_separation(output: Output, row: Row) -> str:
    """How far a row separates the pair of signal types of the trade-off, and at which light."""
    separation = output.trade_off[0]
    told = separation.told(row[separation.name])
    light = f"at {row[CFA_SENSITIVITY]:.3f} {_OF_CLEAR}"
    if separation.pair is None or separation.metric in _BY_NOISE:
        return f"reaches {separation.words} {told} {light}"
    worst = f" in the worst case of {worst_over(output)}" if separation.extreme == WORST_CASE else ""
    if separation.extreme == OF_A_SHARE:
        worst = separation.words.removeprefix(output.columns[separation.of].words).replace(" of ", " for ", 1)
    return f"separates {' from '.join(separation.pair)} by {told}{worst} {light}"


def _best(output: Output, leaders: Leaders) -> Iterator[str]:
    """Who is best under the constraints, beside the plain CFA that separates most; and what limits it."""
    best, plain, separation = leaders.chosen, leaders.plain, output.trade_off[0]
    if best is None:
        return
    under = _under(output).removeprefix(" with ")
    text = f"Under {under}, {full_name(best)}" if under else capital(full_name(best))
    text += _band(best)
    if output.goal.name not in (separation.name, separation.of):
        text += f" has the best {output.goal.words}, {output.goal.amount(best[output.goal.name])}, and"
    text += f" {said_separation(output, best)}"
    if len(output.scenarios) > 1:
        text += f" in {leaders.scenario}"
    if plain is not None:
        text += _times(output, best, plain)
    yield f"{text}."
    yield from _of_least(output, best, plain)
    if filter_told := assumed(output, best):
        yield filter_told
    lights = best.get(limited_by_name(separation.pair)) if separation.pair else None
    search = output.provenance.search
    proven = None if search is None or best["kind"] not in (SWEPT, FOUND) else search.limit_proven
    parts = []
    if proven is not None and output.goal.name == separation.name:
        most = separation.told_bound(proven)
        alike = " and moves like it" if moves_with_light(output, best) else ""
        parts.append(f"No filter in its place that meets the same{alike} exceeds {most} (proven, before quantization).")
    if isinstance(lights, str) and separation.extreme != OF_A_SHARE and not over_population(output):
        parts.append(f"The two lights that limit it are {lights}.")
    if parts:
        yield " ".join(parts)
    yield from unseen_lines(output, best)


def _of_least(output: Output, best: Row, plain: Row | None) -> Iterator[str]:
    """What is to be the least, in its own unit, where the objective says it in decades."""
    if output.objective.rule.wanted == "more":
        return
    for name in output.objective.weights:
        told = [
            f"{float(row[name]):.3g} {output.columns[name].unit}".rstrip() for row in (best, plain) if row is not None
        ]
        beside = f" ({plain['name']} {told[1]})" if plain is not None else ""
        yield f"Its {output.words(name)} is {told[0]}{beside}."


def _band(row: Row) -> str:
    """Where the band of a found filter lies, between the middles of its edges; nothing of other filters."""
    ends = [row.get(name, np.nan) for name in ("left_nm", "right_nm")]
    return f" ({ends[0]:.0f} to {ends[1]:.0f} nm)" if row["kind"] in (SWEPT, FOUND) and np.isfinite(ends).all() else ""


def _times(output: Output, best: Row, plain: Row) -> str:
    """The separation and the light of a row as multiples of those of a plain CFA."""
    separation = output.trade_off[0]
    of, light = float(plain[separation.name]), float(plain[CFA_SENSITIVITY])
    if not of > 0:
        return f" ({plain['name']} by {separation.told(of)} at {light:.3f})"
    times, name = f"{best[CFA_SENSITIVITY] / light:.2f} times its light ({light:.3f})", plain["name"]
    if separation.unit == DECADES:  # a ratio of logarithms says nothing
        more = separation.told(best[separation.name] - of)
        return f": {more} beyond {name} ({separation.told(of)}), and {times}"
    what = "that" if separation.metric in _BY_NOISE else "the separation"
    return f": {best[separation.name] / of:.2f} times {what} of {name} ({separation.told(of)}) and {times}"


def who_else(output: Output) -> list[str]:
    """Who separates most, and most per light, where that is not the best one under the constraints."""
    found = " ".join(_others(output, leaders_of(output)))
    return [found] if found else []


def _others(output: Output, leaders: Leaders) -> Iterator[str]:
    """Who separates most and who does so per light, where that is somebody else."""
    best, most, rate = leaders.chosen, leaders.separates, leaders.per_light
    separation = output.trade_off[0]
    per_time = separation.unit != DECADES and separation.metric not in _BY_NOISE
    if most is not None and best is not None and most["design_id"] == best["design_id"]:
        yield f"Nothing else in this run {'separates' if per_time else 'has'} more."
    more = most is not None and (best is None or most[separation.name] > best[separation.name])
    if most is not None and more:
        verb = "separates most" if per_time else "has the most"
        yield f"{capital(full_name(most))} {verb} of all: {_figures(output, most)}{_missed(output, most)}."
    if rate is None or not per_time:
        return
    measure = per_light(separation.name)
    same = more and most is not None and most["design_id"] == rate["design_id"]
    told = _rate_told(rate[measure])
    rivals = [r for r in (best, leaders.plain) if r is not None and r["design_id"] != rate["design_id"]]
    others = {full_name(r): _rate_told(r[measure]) for r in rivals}
    tied = [name for name, value in others.items() if value == told]
    who = " and ".join(["it" if same else full_name(rate), *tied])
    text = f"{capital(who)} separate{'' if tied else 's'} most per light{', too' if same else ''}: "
    text += f"{told} {separation.unit} per ms of exposure"
    against = ", ".join(f"{name} {value}" for name, value in others.items() if name not in tied)
    yield text + (f" ({against})" if against else "") + ("" if same else _missed(output, rate)) + "."


def _figures(output: Output, row: Row) -> str:
    separation = output.trade_off[0]
    return f"{separation.told(row[separation.name])} at {row[CFA_SENSITIVITY]:.3f} {_OF_CLEAR}"


def _missed(output: Output, row: Row) -> str:
    """Constraints that a row does not meet, in words."""
    missed = [
        f"{output.words(name)} {bound}"
        for name, bound in output.constraints.items()
        if bound.violation(np.array([row[name]], dtype=float))[0] > FEASIBLE
    ]
    return f", but it does not meet {' and '.join(missed)}" if missed and row["kind"] != PLAIN else ""


def _rate_told(rate: float) -> str:
    """A separation per light, DN/ms."""
    return f"{rate:.{0 if rate >= 100 else 1}f}"


def large_numbers(output: Output) -> list[LargeNumber]:
    """Separation, light and distance to the limit of the best one, or what it separates per light without a limit.

    Over scenarios that differ in one number: who leads first, its light, and up to where.
    """
    figures = sorted(series_figures(output), key=lambda series: len(leads_of(series)) < 2)
    if figures and output.best.empty:
        return list(_numbers_over(output, figures[0]))
    leaders = leaders_of(output)
    best, plain, separation = leaders.chosen, leaders.plain, output.trade_off[0]
    if best is None:
        return []
    value, measure = float(best[separation.name]), per_light(separation.name)
    against = _beside(plain, separation.name, value, separation.told)
    if plain is not None and separation.unit == DECADES:
        against = f"{plain['name']} {separation.told(float(plain[separation.name]))}"
    numbers = [
        LargeNumber(separation.told(value), separation.words, against),
        LargeNumber(
            f"{best[CFA_SENSITIVITY]:.3f}",
            _OF_CLEAR,
            _beside(plain, CFA_SENSITIVITY, float(best[CFA_SENSITIVITY]), "{:.3f}".format),
        ),
    ]
    search = output.provenance.search
    if search is not None and search.limit_proven is not None and output.goal.name == separation.name:
        left = separation.told(max(0.0, search.limit_proven - value))
        limit = f"{separation.told_bound(search.limit_proven)}: no filter exceeds it before quantization"
        numbers.append(LargeNumber(left, "below the limit of any filter", limit))
    elif best[measure] == best[measure] and separation.unit != DECADES and separation.metric not in _BY_NOISE:
        rate = float(best[measure])
        beside = _beside(plain, measure, rate, _rate_told)
        numbers.append(LargeNumber(f"{_rate_told(rate)} {separation.unit}/ms", "per light (ms of exposure)", beside))
    return numbers


def _numbers_over(output: Output, series: SeriesFigure) -> Iterator[LargeNumber]:
    """Of the first one that leads in a series: separation, light, and where its lead ends."""
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
    yield LargeNumber(separation.told(own[start]), f"{name} at {at(start)}", rival(start))
    rows = output.few[output.few["name"] == name]
    yield LargeNumber(f"{rows[CFA_SENSITIVITY].iloc[0]:.3f}", _OF_CLEAR, name)
    figures = ", ".join(part for part in (f"{separation.told(own[stop])}", rival(stop)) if part)
    yield LargeNumber(at(stop), f"{name} leads up to here" if leads[-1][2] != stop else "and still leads here", figures)


def _beside(other: Row | None, column: str, value: float, told: Callable[[float], str]) -> str:
    """A value as a multiple of that of a plain CFA."""
    if other is None or not float(other[column]) > 0:
        return ""
    return f"{value / float(other[column]):.2f} times {other['name']} ({told(float(other[column]))})"
