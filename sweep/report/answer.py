"""The answer to a study's question: sentences that can be said in a meeting, the first one before all others."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..metrics.columns.confusion import CNR, D_PRIME
from ..metrics.columns.sensitivity import CFA_SENSITIVITY
from ..metrics.limiting import limited_by_name
from ..metrics.quantity import DECADES, OF_A_SHARE, WORST_CASE
from ..results.output import Output
from ..results.tables import FOUND, NAMED, PLAIN, SWEPT
from ..results.thinning import per_exposure
from ..study.axes import series_of
from .allowed_lamps import lamp_lines
from .assumed import assumed, moves_with_light, technology_of
from .leaders import Leaders, Row, leaders_of
from .names import capital, full_name, label, of_reference, rate_told
from .noise import usable_lines
from .robustness import over_population, robustness_lines, worst_over
from .series import lead_sentence, leads_of
from .terms import constraints_told, missed_told, unknown_lines
from .unseen import unseen_lines, unseen_told
from .upper_bound import upper_bound_beside
from .values import series_figures

_MOST_SCENARIOS = 6
"""Scenarios beside the leading one whose best design the answer names."""
_BY_NOISE = (D_PRIME, CNR)
"""Metrics of separations in units of the noise."""


def answer_sentences(output: Output) -> list[str]:
    """What images say first; then over scenarios that differ in one number who leads where, else who is best."""
    return output.once("answer", lambda: [*_of_images(output), *_of_designs(output)])


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
        under = constraints_told(output)
        return [
            f"No design meets every constraint{f': {under}' if under else ''}.",
            *unknown_lines(output),
            *who_else(output),
        ]
    usable = list(usable_lines(output))
    # Where the question is of noise, separations matter where another CFA begins to lead.
    series = usable + [lead_sentence(s) for s in series_figures(output) if not usable or len(leads_of(s)) > 1]
    if series and output.best.empty:
        return series
    leaders = leaders_of(output)
    lamps = robustness_lines(output, leaders.chosen)
    others = _best_of_other_scenarios(output)
    return [*_best(output, leaders), *others, *lamps, *lamp_lines(output), *who_else(output), *series]


def said_separation(output: Output, row: Row) -> str:
    """How far a row separates the pair of signal types of the trade-off, and at which light."""
    separation = output.trade_off[0]
    told = separation.told(row[separation.name])
    light = f"at {row[CFA_SENSITIVITY]:.3f} {of_reference(output)}"
    if separation.pair is None or separation.metric in _BY_NOISE:
        return f"reaches {separation.words} {told} {light}"
    worst = f" in the worst case of {worst_over(output)}" if separation.extreme == WORST_CASE else ""
    if separation.extreme == OF_A_SHARE:
        worst = separation.words.removeprefix(output.columns[separation.of].words).replace(" of ", " for ", 1)
    return f"separates {' from '.join(separation.pair)} by {told}{worst} {light}"


def _best(output: Output, leaders: Leaders) -> Iterator[str]:
    """Who is best under the constraints, beside the plain CFA that separates most; then what limits it, and others."""
    best, plain, separation = leaders.chosen, leaders.plain, output.trade_off[0]
    if best is None:
        if len(output.scenarios) > 1:
            yield f"In {leaders.scenario}, no design meets every constraint."
        return
    under = constraints_told(output)
    who = full_name(best) + technology_of(output, best)
    if best["kind"] in (PLAIN, NAMED):
        who = f"the best {'CFA' if best['kind'] == PLAIN else 'design'} of this study, {who},"
    text = f"With {under}, {who}" if under else capital(who)
    if output.goal.name not in (separation.name, separation.of):
        text += f" has the best {output.goal.words}, {output.goal.amount(best[output.goal.name])}, and"
    text += f" {said_separation(output, best)}{unseen_told(output, best)}"
    if len(output.scenarios) > 1:
        text += f" in {leaders.scenario}"
    if plain is not None:
        text += _times(output, best, plain)
    yield f"{text}."
    yield from _of_least(output, best, plain)
    if filter_told := assumed(output, best):
        yield filter_told
    parts = _band(best)
    if lights := _limited(output, best):
        parts.append(f"The two lights that limit it are {lights}.")
    bound = upper_bound_beside(output, best)
    if bound is not None:
        where = f" in {bound.scenario}" if len(output.scenarios) > 1 else ""
        alike = " that moves like it" if moves_with_light(output, best) else ""
        same = "the same constraints" if output.constraints else "no constraint"
        parts.append(
            f"Upper bound for any filter{alike} in {bound.channel} of {bound.cfa} under {same}{where}: "
            f"{separation.told_bound(bound.value)} (proven, before quantization)."
        )
    if parts:
        yield " ".join(parts)
    yield from unseen_lines(output)
    yield from (_best_of_other(output, row) for row in leaders.others)


def _best_of_other_scenarios(output: Output) -> Iterator[str]:
    """Best design of each scenario but the leading one, up to a few; those of a series by its two ends."""
    inner = {name for members in series_of(output.scenarios).values() for name in list(members)[1:-1]}
    others = [name for name in output.scenarios if name not in inner and name != output.scenario]
    for scenario in others[:_MOST_SCENARIOS]:
        leaders = leaders_of(output, scenario)
        if leaders.chosen is None:
            yield f"In {scenario}, no design meets every constraint."
            continue
        best = f"{full_name(leaders.chosen)} {said_separation(output, leaders.chosen)}"
        against = "" if leaders.plain is None else _times(output, leaders.chosen, leaders.plain)
        yield f"In {scenario}, {best}{against}."
    if left := len(output.scenarios) - 1 - len(others[:_MOST_SCENARIOS]):
        yield f"Of {left} more scenario{'s' if left > 1 else ''}, the report's tables have the best designs."


def _limited(output: Output, row: Row) -> str:
    """The two lights that limit the separation of a row, where it is that of two lights of the study."""
    separation = output.trade_off[0]
    lights = row.get(limited_by_name(separation.pair)) if separation.pair else None
    of_two = separation.extreme != OF_A_SHARE and not over_population(output)
    return lights if isinstance(lights, str) and of_two else ""


def _limited_told(output: Output, row: Row) -> str:
    """The same behind a figure."""
    lights = _limited(output, row)
    return f" (limited by {lights})" if lights else ""


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


def _best_of_other(output: Output, row: Row) -> str:
    """What the best design of another CFA than that of the best one has."""
    same = " that meets the same" if output.constraints else ""
    name = label(row) if row["kind"] == FOUND else f"{label(row)},"
    who = f"the {name} of {row['cfa']}" if row["kind"] == FOUND else f"the best of {row['cfa']}{same}, {name}"
    return f"{capital(who)} {said_separation(output, row)}{_limited_told(output, row)}."


def _band(row: Row) -> list[str]:
    """Where the band of a found filter lies, between the middles of its edges; nothing of other filters."""
    ends = [row.get(name, np.nan) for name in ("left_nm", "right_nm")]
    found = _made(row) and np.isfinite(ends).all()
    return [f"Its edges are at {ends[0]:.0f} and {ends[1]:.0f} nm."] if found else []


def _made(row: Row) -> bool:
    """Whether the study swept or searched a design."""
    return row["kind"] in (SWEPT, FOUND)


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
    """Who separates most, and most for its exposure, where that is not the best one under the constraints."""
    found = " ".join(_others(output, leaders_of(output)))
    return [found] if found else []


def _others(output: Output, leaders: Leaders) -> Iterator[str]:
    """Who separates most and who does so for its exposure, where that is somebody else."""
    best, most, rate = leaders.chosen, leaders.separates, leaders.per_exposure
    separation = output.trade_off[0]
    per_time = separation.unit != DECADES and separation.metric not in _BY_NOISE
    where = f" in {leaders.scenario}" if len(output.scenarios) > 1 else ""
    if most is not None and best is not None and most["design_id"] == best["design_id"] and _made(best):
        yield f"Nothing else in this run {'separates' if per_time else 'has'} more{where}."
    more = most is not None and (best is None or most[separation.name] > best[separation.name])
    if most is not None and more:
        verb = "separates most" if per_time else "has the most"
        yield f"{capital(full_name(most))} {verb} of all{where}: {_figures(output, most)}{_missed(output, most)}."
    if rate is None or not per_time:
        return
    measure = per_exposure(separation.name)
    same = more and most is not None and most["design_id"] == rate["design_id"]
    told = rate_told(rate[measure])
    rivals = [r for r in (best, leaders.plain) if r is not None and r["design_id"] != rate["design_id"]]
    others = {full_name(r): rate_told(r[measure]) for r in rivals}
    tied = [name for name, value in others.items() if value == told]
    who = " and ".join(["it" if same else full_name(rate), *tied])
    text = f"{capital(who)} separate{' most for their' if tied else 's most for its'} exposure{where}"
    text += f"{', too' if same else ''}: {told} {separation.unit} per ms of exposure"
    against = ", ".join(f"{name} {value}" for name, value in others.items() if name not in tied)
    yield text + (f" ({against})" if against else "") + ("" if same else _missed(output, rate)) + "."


def _figures(output: Output, row: Row) -> str:
    separation = output.trade_off[0]
    light = f"{row[CFA_SENSITIVITY]:.3f} {of_reference(output)}"
    return f"{separation.told(row[separation.name])} at {light}{_limited_told(output, row)}"


def _missed(output: Output, row: Row) -> str:
    """Constraints that a row does not meet, in words; of a plain CFA none are asked."""
    missed = missed_told(output, row)
    return f", but {missed}" if missed and row["kind"] != PLAIN else ""
