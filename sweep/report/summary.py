"""Summary of a run in about ten lines."""

from __future__ import annotations

from ..metrics.columns.sensitivity import CFA_SENSITIVITY
from ..results.facts import SearchFacts
from ..results.output import Output
from ..results.tables import REFERENCE
from .answer import answer_parts
from .leaders import capital, of_reference
from .price import price_line
from .scorecard import score_lines, scorecard
from .stated import stated_lines
from .tables import comparison_lines, comparison_with_published
from .terms import assumptions_line
from .values import drawn_rows

_MOST_PARAMETERS = 10


def _named_line(output: Output) -> list[str]:
    """Return CFAs and named designs where there is one scenario; of several the report has the figures."""
    if len(output.scenarios) > 1:
        return []
    shown = output.trade_off[0]
    rows = output.named[output.named[shown.name].notna()].to_dict("records")
    designs = [f"{row['name']} {shown.formatted(row[shown.name])} at {row[CFA_SENSITIVITY]:.3f}" for row in rows]
    of = f"{capital(shown.words)} of the named CFAs and designs, and their share {of_reference(output)}"
    return [f"{of}: {', '.join(designs)}."] if designs else []


def summary_lines(output: Output, took_s: float | None = None) -> list[str]:
    """Return the summary of a run; its last line is the folder."""
    facts = output.provenance
    answer, further = answer_parts(output)
    lines = [*answer, *stated_lines(output), *further, *_named_line(output)]
    if not output.best.empty:
        best = output.best.iloc[0]
        names = [name for name in output.parameters if best[name] == best[name]]
        values = ", ".join(f"{name} {best[name]:.2f}" for name in names[:_MOST_PARAMETERS])
        more = f" and {len(names) - _MOST_PARAMETERS} more" if len(names) > _MOST_PARAMETERS else ""
        lines.append(f"Parameters: {values}{more}.")
    for name, geometry in output.study.geometry.items():
        pixels = round(geometry.object_resolution_px, 1)
        lines.append(f"{name}: {geometry.distance_m:g} m, {geometry.fov_deg:g} deg: {pixels:g} px across the light.")
    lines += [line for line in [price_line(output)] if line] or score_lines(scorecard(output))
    lines += comparison_lines(comparison_with_published(output))
    lines += [counts_line(output), _plan_line(output)]
    if facts.search:
        how = "as the search computes it" if output.study.pixel.captures else "before clipping and quantization"
        reached = f"{output.goal.amount(facts.search.best_smooth_objective)} {how}"
        starts, evaluations = _count(facts.search.starts, "start"), _count(facts.search.evaluations, "evaluation")
        if facts.search.combinations:
            lines.append(f"Tried: {', '.join(facts.search.combinations)} of colorants.")
        algorithms = " and ".join(filter(None, (facts.search.algorithm, facts.search.refinement)))
        lines.append(f"Search: {algorithms}, {starts}, {evaluations}: {reached}.")
        lines.append(_limit_line(output, facts.search))
    lines += [f"Note: {warning}." for warning in facts.warnings]
    ratio = output.study.lights.photon_ratio
    if ratio is not None:
        lines.append(
            f"A light has {ratio:.4g} of the photons of the white patch (photon_ratio in study.resolved.yaml)."
        )
    if note := assumptions_line(output):
        lines.append(note)
    computed = f"{facts.duration_s:.1f} s by {_count(facts.workers, 'worker')}"
    took = f"Computed in {computed}" if took_s is None else f"Took {took_s:.1f} s; computed in {computed}"
    return [*lines, f"{took}. Files: results.parquet, report.html, provenance.json in the folder", str(output.folder)]


def _plan_line(output: Output) -> str:
    """Return the computed effects over all scenarios, the bound on the others, and the check of the run."""
    plans, check = output.provenance.plans, output.provenance.check
    computed = dict.fromkeys(effect for plan in plans.values() for effect in plan.computed)
    bound_dn = max(plan.error_bound_dn for plan in plans.values())
    others = f"the other effects change a CSD by at most {bound_dn:.2g} DN"
    line = f"Simulated: {', '.join(computed)}; {others if bound_dn else 'no other effect changes a CSD'}."
    return line if check is None else f"{line} {check.sentence}"


def counts_line(output: Output) -> str:
    """Return the number of designs, and of those that the report draws."""
    counts = output.counts
    text = _count(output.provenance.filters, "filter")
    plain = output.kind(REFERENCE)["filter_id"].nunique()
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
    """Return the upper bound with its filters and response."""
    if search.no_limit is not None or search.limit_proven is None:
        return f"Upper bound: none computed ({search.no_limit})."
    proven = output.goal.format_bound(search.limit_proven)
    gap = "nothing is left to gain"
    if search.gap is not None:
        gap = f"the search's answer is {100 * search.gap:.1f} % below it"
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
    moved = "" if technology is None else f", as {technology.description}"
    if output.goal.extreme and output.study.production.tolerance and "edge shifts" not in search.limit_left_out:
        moved += ", whose whole shape production moves"
    where = f"{search.channel} of {search.cfa}{f' in {search.scenario}' if len(output.scenarios) > 1 else ''}"
    return (
        f"Upper bound of {output.goal.words} for any filter in {where}: {proof}; {gap}. This is for filters between "
        f"the least transmission and the curve that they replace{moved}, under the same constraints{without}, before "
        "clipping and quantization."
        + (f" At {levels} levels of the front it may not be the least one." if levels else "")
    )
