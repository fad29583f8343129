"""A run in about ten lines for a person."""

from __future__ import annotations

from ..metrics.columns.sensitivity import CFA_SENSITIVITY
from ..results.facts import SearchFacts
from ..results.output import Output
from ..results.tables import PLAIN
from ..study.axes import series_of
from .answer import answer_sentences
from .assumed import assumed_line
from .names import of_reference
from .published import comparison_lines, comparison_with_published
from .scorecard import score_lines, scorecard
from .tables import geometry_table
from .values import drawn_rows

_MOST_PARAMETERS = 10
_MOST_SCENARIOS = 8


def _scene_lines(output: Output) -> list[str]:
    """CFAs and named designs in each scenario; of those that differ in one number the two ends, of many others few."""
    shown = output.trade_off[0]
    title = f"{shown.words[:1].upper()}{shown.words[1:]} of the named CFAs and designs"
    title += f", and their share {of_reference(output)}:" if len(output.scenarios) == 1 else ":"
    rows, scenarios = output.named, output.scenarios
    inner = {name for own in series_of(scenarios).values() for name in list(own)[1:-1]}
    shown_ones = [name for name in scenarios if name not in inner]
    if len(shown_ones) > _MOST_SCENARIOS:
        shown_ones = [*shown_ones[:4], *shown_ones[-2:]]
    lines = []
    for name in shown_ones:
        each = ", ".join(
            f"{row['name']} {shown.told(row[shown.name])}"
            + (f" at {row[CFA_SENSITIVITY]:.3f}" if len(scenarios) == 1 else "")
            for row in rows[(rows["scenario"] == name) & rows[shown.name].notna()].to_dict("records")
        )
        if each:
            lines.append(f"{title} {each}." if len(scenarios) == 1 else f"{name}: {each}.")
    if left := len(scenarios) - len(shown_ones):
        lines.append(f"({left} more scenario{'s' if left > 1 else ''} in the report.)")
    return lines if len(scenarios) == 1 else [title, *lines]


def summary_lines(output: Output, took_s: float | None = None) -> list[str]:
    """What a run found and where its files are; `took_s`: what the whole command took, s."""
    lines = [*answer_sentences(output)]
    lines += _scene_lines(output)
    if not output.best.empty:
        best = output.best.iloc[0]
        own = [name for name in output.parameters if best[name] == best[name]]
        found = ", ".join(f"{name} {best[name]:.2f}" for name in own[:_MOST_PARAMETERS])
        more = f" and {len(own) - _MOST_PARAMETERS} more" if len(own) > _MOST_PARAMETERS else ""
        lines.append(f"Parameters: {found}{more}.")
    for row in geometry_table(output).to_dict("records"):
        lines.append(
            f"{row['scenario']}: {row['distance_m']:g} m, {row['fov_deg']:g} deg: "
            f"{row['object_resolution_px']:g} px across the light."
        )
    lines += score_lines(scorecard(output))
    lines += comparison_lines(comparison_with_published(output))
    lines.append(counts_line(output))
    lines.append(_plan_line(output))
    search = output.provenance.search
    if search:
        found = f"{output.goal.amount(search.best_smooth_objective)} before clipping and quantization"
        how = f"{search.algorithm}, {_count(search.starts, 'start')}, {_count(search.evaluations, 'evaluation')}"
        lines.append(f"Search: {how}: {found}.")
        lines.append(_limit_line(output, search))
    areas = output.provenance.hypervolume
    if areas:
        both = ", ".join(f"{name} {area:.3f}" for name, area in areas.items() if area > 0)
        least = output.provenance.hypervolume_least_sensitivity
        lines.append(f"Hypervolume (DN x sensitivity, above 0 and a sensitivity of {least:g}): {both}.")
    lines += [f"Note: {warning}." for warning in output.provenance.warnings]
    ratio = output.study.lights.photon_ratio
    if ratio is not None:
        lines.append(
            f"A light has {ratio:.4g} of the photons of the white patch (photon_ratio in study.resolved.yaml)."
        )
    note = assumed_line(output)
    if note:
        lines.append(note)
    workers = output.provenance.workers
    computed = f"{output.provenance.duration_s:.1f} s by {workers} worker{'s' if workers > 1 else ''}"
    lines.append(f"Computed in {computed}." if took_s is None else f"Took {took_s:.1f} s; computed in {computed}.")
    lines.append(f"Files: {output.folder}/: results.parquet, report.html, provenance.json.")
    return lines


def _plan_line(output: Output) -> str:
    """Effects that were computed, over all scenarios, a bound on what the others change, and the check of the run."""
    plans = output.provenance.plans
    computed = dict.fromkeys(effect for plan in plans.values() for effect in plan.computed)
    bound_dn = max(plan.error_bound_dn for plan in plans.values())
    most = (
        f"the other effects change a CSD by at most {bound_dn:.2g} DN" if bound_dn else "no other effect changes a CSD"
    )
    line = f"Simulated: {', '.join(computed)}; {most}."
    check = output.provenance.check
    return line if check is None else f"{line} {check.sentence}"


def counts_line(output: Output) -> str:
    """How many designs there are, and what the report leaves out."""
    counts = output.counts
    text = _count(output.provenance.filters, "filter")
    plain = len({*output.kind(PLAIN)["filter_id"]})
    text += f" ({plain} of them plain CFAs)" if plain else ""
    if len(output.scenarios) > 1:
        text += f" in {len(output.scenarios)} scenarios ({_count(counts.rows, 'row')})"
    if counts.feasible(met=False):
        text += f", {counts.feasible():,} feasible (every constraint is met)"
    if counts.front():
        text += f", {counts.front():,} on the Pareto front of separation and sensitivity"
    if counts.failed:
        text += f", {counts.failed:,} failed"
    drawn = len(drawn_rows(output))
    if drawn < counts.rows - counts.failed:
        text += f"; the report draws {drawn:,} as points: the front, the best and an even sample"
    return f"{text}."


def _count(number: int, what: str) -> str:
    return f"{number:,} {what}{'' if number == 1 else 's'}"


def _limit_line(output: Output, search: SearchFacts) -> str:
    """The bracket of the limit: what is proven, for which filters and which response."""
    if search.no_limit is not None or search.limit_proven is None:
        return f"Upper bound: none computed ({search.no_limit})."
    proven = output.goal.told_bound(search.limit_proven)
    gap = (
        "nothing is left to gain" if search.gap is None else f"the search's answer is {100 * search.gap:.1f} % below it"
    )
    without = f" but {', '.join(search.limit_left_out)}" if search.limit_left_out else ""
    proof = f"{proven} (proven)"
    if search.limit_attained is not None:
        left = f"{search.limit_proven - search.limit_attained:.2g} {output.goal.unit}".rstrip()
        proof += f", and one filter comes within {left} of it"
    if search.limit_open_parts:
        programs, parts = search.limit_programs, search.limit_open_parts
        proof += f", but it may not be the least one: {parts} parts are open after {programs} linear programs"
    levels = search.front_limits_open
    technology = (output.study.sweeps | output.study.boxes)[search.space].technology
    moved = "" if technology is None else f", as {technology.told}"
    if output.goal.extreme and output.study.production.tolerance and "edge shifts" not in search.limit_left_out:
        moved += ", whose whole shape production moves"
    where = f"{search.channel} of {search.cfa}{f' in {search.scenario}' if len(output.scenarios) > 1 else ''}"
    return (
        f"Upper bound of {output.goal.words} for any filter in {where}: {proof}; {gap}. This is for filters between "
        f"the least transmission and the curve that they replace{moved}, under the same constraints{without}, before "
        "clipping and quantization."
        + (f" At {levels} levels of the front it may not be the least one." if levels else "")
    )
