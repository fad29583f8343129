"""Answer to a study's question in sentences, the first one before all others."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from ..base.types import Array, Float
from ..metrics.columns.confusion import CNR, D_PRIME
from ..metrics.columns.sensitivity import CFA_SENSITIVITY
from ..metrics.limiting import limited_by_name
from ..metrics.quantity import LOG10, OF_A_SHARE, WORST_CASE
from ..results.output import Output
from ..results.shown import per_exposure
from ..results.tables import NAMED, REFERENCE, SEARCHED, SWEPT
from ..study.axes import series_of
from .lamps import cost_of_worst_case, lamp_lines, over_population, robustness_lines
from .leaders import Leaders, Row, capital, full_name, label, leaders_of, of_reference, upper_bound_beside
from .noise import usable_lines
from .over_series import flicker_lines, worst_of_series
from .parameter_map import map_lines
from .scorecard import score_lines, scorecard
from .series import lead_sentence, leads_of, scene_in_words, series_figures, vanishing_line
from .terms import (
    angle_note,
    format_constraints,
    format_missed_constraints,
    is_angle_dependent,
    technology_of,
    unknown_lines,
)
from .uncertain import uncertain_lines

_MOST_ANSWERS = 2
"""Lines above the first plot where scenarios that differ in one number are compared."""
_MOST_SCENARIOS = 6
"""Scenarios beside the leading one whose best design the answer names."""
_BY_NOISE = (D_PRIME, CNR)
"""Metrics of separations in units of the noise."""


def answer_parts(output: Output) -> tuple[list[str], list[str]]:
    """Return the answer to the study's question, which stands above the first plot, and what else was found.

    The answer is that of images; else leaders over scenarios that differ in one number, tasks, or the best design.
    """
    answer, further = _of_designs(output)
    further = [*uncertain_lines(output), *further]
    if output.study.vision is None:
        return answer, further
    from .vision_report import vision_sentences  # noqa: PLC0415  (only where a study asks for images)

    return list(vision_sentences(output)), answer + further


def _of_designs(output: Output) -> tuple[list[str], list[str]]:
    searched = output.kind(SWEPT, SEARCHED)
    if len(searched) and output.best.empty:
        failed = searched[searched["status"] != "ok"]
        if len(failed) == len(searched):
            return [f"Every design failed: {failed['status'].iloc[0]}."], []
        under = format_constraints(output)
        none = f"No design meets every constraint{f': {under}' if under else ''}."
        return [none], [*unknown_lines(output), *largest_separation_elsewhere(output)]
    usable = [*usable_lines(output)]
    pulses = [*flicker_lines(output)]
    if usable:  # where the question is of noise, separations matter where another CFA begins to lead
        series = [lead_sentence(drawn) for drawn in series_figures(output) if len(leads_of(drawn)) > 1]
    else:
        series = [line for drawn in series_figures(output) for line in (*vanishing_line(drawn), lead_sentence(drawn))]
    if output.best.empty and usable:
        return [*pulses, *usable], series
    if output.best.empty and series:
        return [*pulses, *series[:_MOST_ANSWERS]], series[_MOST_ANSWERS:]
    leaders = leaders_of(output)
    if output.best.empty and (scores := score_lines(scorecard(output))):
        return scores, list(_best(output, leaders))
    best = list(_best(output, leaders))
    return [
        *best[:1],
        *cost_of_worst_case(output, leaders.chosen),
        *_over_field(output, leaders),
        *map_lines(output),
    ], [
        *best[1:],
        *_best_of_other_scenarios(output),
        *robustness_lines(output, leaders.chosen),
        *lamp_lines(output),
        *largest_separation_elsewhere(output),
        *pulses,
        *usable,
        *series,
    ]


def _format_separation(output: Output, row: Row) -> str:
    """Return the separation of a row and its light in words."""
    separation = output.trade_off[0]
    amount = separation.formatted(row[separation.name])
    light = f"at {row[CFA_SENSITIVITY]:.3f} {of_reference(output)}"
    if separation.pair is None or separation.metric in _BY_NOISE:
        return f"reaches {separation.words} {amount} {light}"
    worst = ""
    if separation.extreme == WORST_CASE:
        over = ["production"] if output.study.production.tolerance else []
        worst = f" in the worst case of {' and '.join([*over, *(['all lamps'] if over_population(output) else [])])}"
    elif separation.extreme == OF_A_SHARE:
        worst = separation.words.removeprefix(output.columns[separation.of].words).replace(" of ", " for ", 1)
    return f"separates {' from '.join(separation.pair)} by {amount}{worst} {light}"


def _in(output: Output, scenario: str) -> str:
    """Return a scenario for the end of a sentence, if there are several."""
    return f" in {scene_in_words(scenario)}" if len(output.scenarios) > 1 else ""


def _best(output: Output, leaders: Leaders) -> Iterator[str]:  # noqa: PLR0912  (one sentence after another)
    """Yield the best design beside the plain CFA with the largest separation, its limits, and others."""
    best, plain, separation = leaders.chosen, leaders.plain, output.trade_off[0]
    if best is None:
        if len(output.scenarios) > 1:
            yield f"In {scene_in_words(leaders.scenario)}, no design meets every constraint."
        return
    under, stated = format_constraints(output), technology_of(output, best)
    notes = [
        *_colorants(output, best),
        *([edges] if (edges := _edges(best)) else []),
        *_convergence(output, best),
        *([] if stated is None else [stated.description]),
    ]
    who = full_name(best) + (f" ({'; '.join(notes)})" if notes else "")
    if best["kind"] in (REFERENCE, NAMED):
        who = f"the best {'CFA' if best['kind'] == REFERENCE else 'design'} of this study, {who},"
    text = f"With {under}, {who}" if under else capital(who)
    if output.goal.name not in (separation.name, separation.of):
        text += f" has the best {output.goal.words}, {output.goal.amount(best[output.goal.name])}, and"
    if (over := worst_of_series(output, best)) is not None:
        yield f"{text} {over.words}."
    else:
        text += f" {_format_separation(output, best)}"
        yield f"{text}{_in(output, leaders.scenario)}{_times(output, best, plain)}.{_equal(output, best)}"
    search = output.provenance.search
    if search is not None and search.scenarios > 1 and best["kind"] == SEARCHED:
        more = f" and {search.scenes_added} scenes between them" if search.scenes_added else ""
        yield f"It was searched for its worst value over {search.scenarios} scenarios{more}."
    if output.objective.rule.direction != "more":  # decades of what is to be the least, in its own unit
        for name in output.objective.weights:
            rows = [row for row in (best, plain) if row is not None]
            values = [f"{float(row[name]):.3g} {output.columns[name].unit}".rstrip() for row in rows]
            beside = f" ({plain['name']} {values[1]})" if plain is not None else ""
            yield f"Its {output.words(name)} is {values[0]}{beside}."
    if output.study.scenarios[leaders.scenario].field is None and (assumption := angle_note(output, best)):
        yield assumption
    if limits := _limits(output, best):
        yield limits
    yield from unseen_lines(output)
    for row in leaders.others:
        name = " ".join([full_name(row), *(f"({note})" for note in _convergence(output, row))])
        if row["kind"] != SEARCHED:
            same = " that meets the same" if output.constraints else ""
            name = f"the best of {row['cfa']}{same}, {label(row)},"
        yield f"{capital(name)} {_format_separation(output, row)}{_format_limit(output, row)}."


def _convergence(output: Output, row: Row) -> Iterator[str]:
    """Yield a note on the answer of a search that did not converge."""
    search = output.provenance.search
    if row["kind"] == SEARCHED and search is not None and not search.converged:
        yield "best found; no start converged"


def _equal(output: Output, best: Row) -> str:
    """Return a sentence on CFAs and named designs whose separation is the best one's in all digits that are shown."""
    if best["kind"] not in (REFERENCE, NAMED):
        return ""
    separation = output.trade_off[0]
    rows = output.named_rows[
        (output.named_rows["scenario"] == best["scenario"]) & (output.named_rows["design_id"] != best["design_id"])
    ]
    shown = separation.formatted(best[separation.name])
    names = [label(row) for row in rows.to_dict("records") if separation.formatted(row[separation.name]) == shown]
    return f" {' and '.join(names)} {'has' if len(names) == 1 else 'have'} {shown}, too." if names else ""


def _colorants(output: Output, best: Row) -> Iterator[str]:
    """Yield the colorants of a filter with their absorbances, or the peak and width of its only modeled band."""
    names = list(output.curves.colorants)
    slots = [name.removeprefix("colorant_") for name in output.parameters if name.startswith("colorant_")]
    for slot in slots:
        number, absorbance = float(best[f"colorant_{slot}"]), float(best[f"absorbance_{slot}"])
        if np.isfinite(number) and absorbance > 0:
            yield f"{names[round(number) - 1]} with an absorbance of {absorbance:.2f}"
    peak_nm, fwhm_nm = (float(best.get(name, np.nan)) for name in ("peak_nm", "fwhm_nm"))
    if np.isfinite([peak_nm, fwhm_nm]).all():
        yield f"a band at {peak_nm:.0f} nm of {fwhm_nm:.0f} nm FWHM with an absorbance of {best['absorbance']:.2f}"


def _edges(best: Row) -> str:
    """Return the edges of a filter that was swept or found, in words; empty without a left and a right one."""
    left_nm, right_nm = (float(best.get(name, np.nan)) for name in ("left_nm", "right_nm"))
    if best["kind"] not in (SWEPT, SEARCHED) or not np.isfinite([left_nm, right_nm]).all():
        return ""
    return f"edges at {left_nm:.0f} and {right_nm:.0f} nm"


def _constraints_of_bound(output: Output) -> str:
    """Return the constraints that the upper bound uses, in words."""
    search = output.provenance.search
    if not output.constraints or search is None:
        return "no constraint"
    without = [output.words(name) for name in search.limit_left_out]
    return "the same constraints" + (f" except {' and '.join(without)}" if without else "")


def _limits(output: Output, best: Row) -> str:
    """Return limiting lights, and the upper bound for any filter."""
    parts = []
    if lights := _limited(output, best):
        parts.append(f"The two lights that limit it are {lights}.")
    bound, search = upper_bound_beside(output, best), output.provenance.search
    if bound is not None and search is not None:
        alike = " that moves like it" if is_angle_dependent(output, best) else ""
        under = _constraints_of_bound(output)
        parts.append(
            f"Upper bound for any filter{alike} in {search.channel} of {search.cfa} under {under}"
            f"{_in(output, search.scenario)}: {output.trade_off[0].format_bound(bound)} "
            "(proven, before quantization)."
        )
    return " ".join(parts)


def _over_field(output: Output, leaders: Leaders) -> Iterator[str]:
    """Yield the angles of several field positions, and the separations of named designs at the first and the worst."""
    best = leaders.chosen
    if best is None or output.places is None or output.study.scenarios[leaders.scenario].field is None:
        return
    if note := angle_note(output, best):
        yield note
    separation, places = output.trade_off[0], output.places
    if separation.name not in places:
        return
    named = output.kind(NAMED)
    named = named[(named["scenario"] == leaders.scenario) & (named["status"] == "ok")]
    parts = []
    for row in named.sort_values(separation.name, ascending=False).to_dict("records"):
        of_design = places[places["design_id"] == row["design_id"]]
        if row["design_id"] != best["design_id"] and len(of_design):
            center = float(of_design.nsmallest(1, "height")[separation.name].iloc[0])
            parts.append(f"{label(row)} {separation.formatted(center)} to {separation.formatted(row[separation.name])}")
    if parts:
        yield f"From the center to the worst field position: {', '.join(parts)}."


def _best_of_other_scenarios(output: Output) -> Iterator[str]:
    """Yield the best design of each scenario but the leading one, up to a few; a series by its two ends."""
    inner = {name for members in series_of(output.scenarios).values() for name in list(members)[1:-1]}
    others = [name for name in output.scenarios if name not in inner and name != output.scenario]
    for scenario in others[:_MOST_SCENARIOS]:
        leaders = leaders_of(output, scenario)
        best = leaders.chosen
        if best is None:
            yield f"In {scene_in_words(scenario)}, no design meets every constraint."
        else:
            against = _times(output, best, leaders.plain)
            yield f"In {scene_in_words(scenario)}, {full_name(best)} {_format_separation(output, best)}{against}."
    if left := len(output.scenarios) - 1 - len(others[:_MOST_SCENARIOS]):
        yield f"Of {left} more scenario{'s' if left > 1 else ''}, the report's tables have the best designs."


def _limited(output: Output, row: Row) -> str:
    """Return the two lights that limit a row's separation, if they are lights of the study."""
    separation = output.trade_off[0]
    lights = row.get(limited_by_name(separation.pair)) if separation.pair else None
    of_two = separation.role == "separation" and separation.extreme != OF_A_SHARE and not over_population(output)
    return lights if isinstance(lights, str) and of_two else ""


def _format_limit(output: Output, row: Row) -> str:
    lights = _limited(output, row)
    return f" (limited by {lights})" if lights else ""


def _times(output: Output, best: Row, plain: Row | None) -> str:
    """Return separation and light of a row as multiples of those of a plain CFA."""
    if plain is None:
        return ""
    separation = output.trade_off[0]
    of, light, name = float(plain[separation.name]), float(plain[CFA_SENSITIVITY]), plain["name"]
    if not of > 0:
        return f" ({name} by {separation.formatted(of)} at {light:.3f})"
    times = f"{best[CFA_SENSITIVITY] / light:.2f} times its light ({light:.3f})"
    if separation.unit == LOG10:  # a ratio of logarithms says nothing
        more = separation.formatted(best[separation.name] - of)
        return f": {more} beyond {name} ({separation.formatted(of)}), and {times}"
    what = "that" if separation.metric in _BY_NOISE else "the separation"
    return f": {best[separation.name] / of:.2f} times {what} of {name} ({separation.formatted(of)}) and {times}"


def largest_separation_elsewhere(output: Output) -> list[str]:
    """Return the design with the largest separation, if it is not the best, and the constraints that it violates."""
    leaders, separation = leaders_of(output), output.trade_off[0]
    best, most, where = leaders.chosen, leaders.separates, _in(output, leaders.scenario)
    verb, more = "separates most", "separates more"
    if separation.unit == LOG10 or separation.metric in _BY_NOISE:
        verb, more = "has the most", "has more"
    if most is None:
        return []
    if best is not None and not most[separation.name] > best[separation.name]:
        leads = most["design_id"] == best["design_id"] and best["kind"] in (SWEPT, SEARCHED)
        return [f"No CFA, named or swept design {more}{where}."] if leads else []
    figures = f"{separation.formatted(most[separation.name])} at {most[CFA_SENSITIVITY]:.3f} {of_reference(output)}"
    missed = (
        "" if most["kind"] == REFERENCE else format_missed_constraints(output, most)
    )  # nothing is asked of a plain CFA
    ending = f", but {missed}" if missed else ""
    return [f"{capital(full_name(most))} {verb} of all{where}: {figures}{_format_limit(output, most)}{ending}."]


_RESAMPLES = 10_000


def unseen_lines(output: Output) -> Iterator[str]:
    """Yield the loss of the search on lights that are left out of it."""
    if output.left_out is None:
        return
    several = output.left_out["objective"].nunique() > 1
    for objective, rows in output.left_out[output.left_out["fall"].notna()].groupby("objective", sort=False):
        quantity = output.columns[str(objective)]
        of = f" of the {quantity.words}" if several else ""
        worst = rows.nlargest(1, "fall").iloc[0]
        fall = quantity.formatted(worst["fall"])
        yield f"Left out of the search, {worst['signal']} costs its optimum{of} most: {fall}."
        falls = rows["fall"].to_numpy()
        if falls.size > 1:
            mean, low, high = generalization_gap(falls, output.study.seed)
            ends = f"95 % interval {quantity.formatted(low)} to {quantity.formatted(high)}"
            yield f"A light that the search{of} has not seen costs {quantity.formatted(mean)} on average ({ends})."


def generalization_gap(falls: Float[Array, " lights"], seed: int) -> tuple[float, float, float]:
    """Return the mean fall of an optimum on a light that was left out, with its 95 % interval by a bootstrap, DN.

    The interval is of lights like these, drawn at random (Efron and Tibshirani, An Introduction to the Bootstrap,
    1993, chapter 13).

    `falls`: falls, DN.
    """
    rng = np.random.default_rng([seed, 2])
    means = falls[rng.integers(falls.size, size=(_RESAMPLES, falls.size))].mean(axis=1)
    low, high = np.quantile(means, (0.025, 0.975))
    return float(falls.mean()), float(low), float(high)


def headline_numbers(output: Output) -> list[tuple[str, str, str]]:
    """Return separation, light and distance to the upper bound of the best design, with a comparison.

    Without a bound, its separation per exposure. Without a best design there are none.
    """
    leaders = leaders_of(output)
    best, plain, separation = leaders.chosen, leaders.plain, output.trade_off[0]
    if best is None:
        return []
    if (over := worst_of_series(output, best)) is not None:
        return over.numbers

    def beside(column: str, formatted: Callable[[float], str]) -> str:
        """Return a value as a multiple of that of a plain CFA."""
        if plain is None or not float(plain[column]) > 0:
            return ""
        if column == separation.name and separation.unit == LOG10:  # a ratio of logarithms says nothing
            return f"{plain['name']} {formatted(float(plain[column]))}"
        return f"{best[column] / plain[column]:.2f} times {plain['name']} ({formatted(float(plain[column]))})"

    value, measure = float(best[separation.name]), per_exposure(separation.name)
    numbers = [
        (separation.formatted(value), separation.words, beside(separation.name, separation.formatted)),
        (f"{best[CFA_SENSITIVITY]:.3f}", of_reference(output), beside(CFA_SENSITIVITY, "{:.3f}".format)),
    ]
    bound, search = upper_bound_beside(output, best), output.provenance.search
    if bound is not None and search is not None:
        shown = f"{separation.format_bound(bound)}: proven under {_constraints_of_bound(output)}, before quantization"
        alike = " that moves like it" if is_angle_dependent(output, best) else ""
        name = f"below the upper bound for any filter{alike} in {search.channel} of {search.cfa}"
        numbers.append((separation.formatted(bound - value), name, shown))
    elif best[measure] == best[measure] and separation.unit != LOG10 and separation.metric not in (D_PRIME, CNR):
        rate = f"{_rate(float(best[measure]))} {separation.unit}"
        numbers.append((rate, "per ms of exposure", beside(measure, _rate)))
    return numbers


def _rate(rate: float) -> str:
    """Format a separation per millisecond of exposure."""
    return f"{rate:.{0 if rate >= 100 else 1}f}"
