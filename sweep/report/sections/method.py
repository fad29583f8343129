"""What was computed, left out, checked and searched."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from ...results.facts import SearchFacts
from ...results.output import Output
from ...results.tables import REFERENCE
from ..scenes import left_out_in_words
from ..section import Section
from ..words import digits, number, quantity

_MOST_NOTES = 4
_SEEN = 1e-5
"""A relative difference that is told."""


@dataclass(frozen=True)
class Method(Section):
    """The plan of a run, its check, its search and its notes, in sentences."""

    sentences: tuple[str, ...]
    notes: tuple[str, ...]

    heading = "Method"

    @classmethod
    def of(cls, output: Output) -> Iterator[Section]:
        """Yield it for every run."""
        facts = output.provenance
        column = output.trade_off[0]
        of = output.columns[column.of] if column.extreme else column
        computed = dict.fromkeys(effect for plan in facts.plans.values() for effect in plan.computed)
        several = f" in {len(output.scenarios)} scenes" if len(output.scenarios) > 1 else ""
        plain = output.kind(REFERENCE)["filter_id"].nunique()
        lines = [
            f"{quantity(of)[:1].upper()}{quantity(of)[1:]} ({of.name} in the files): {of.meaning}.",
            f"Computed: {facts.filters:,} filters, {plain} of them plain CFAs,{several} with {', '.join(computed) or 'no effect but the curves'}.",
            left_out_in_words(
                (effect for plan in facts.plans.values() for effect in plan.effects),
                max(plan.error_bound_dn for plan in facts.plans.values()),
                max(plan.tolerance_dn for plan in facts.plans.values()),
                facts.seconds_of_effects,
            ),
        ]
        if facts.check is not None:
            rows = "1 row" if facts.check.rows == 1 else f"{facts.check.rows:,} rows"
            differ = "differs" if facts.check.rows == 1 else "differ"
            others = f", and other figures by {number(100 * facts.check.largest_share)} %"
            lines.append(
                f"Checked: {rows} at reference settings ({facts.check.slower:.2g} times as long) {differ} by at most "
                f"{digits(facts.check.largest_dn)} DN; {number(facts.check.allowed_dn)} DN is allowed"
                f"{others if facts.check.largest_share > _SEEN else ''}."
            )
        if output.audited is not None:
            lines.append(
                f"Audited: all scenes with the reference settings differ by at most {digits(float(output.audited['realized_dn'].max()))} DN."
            )
        search = facts.search
        if search is not None:
            algorithms = " and ".join(filter(None, (search.algorithm, search.refinement)))
            lines.append(
                f"Searched: {algorithms}, {search.starts:,} start{'s' * (search.starts != 1)}, {search.evaluations:,} evaluations; seed {output.study.seed}."
            )
            lines.append(limit_line(output, search))
        moved = [
            m
            for m in (*output.study.designs.values(), *output.study.sweeps.values(), *output.study.boxes.values())
            if m.technology is None
        ]
        if moved:
            lines.append("Filters without a stated technology are evaluated at normal incidence.")
        more = len(facts.warnings) - _MOST_NOTES
        notes = [*facts.warnings[:_MOST_NOTES], *([f"{more} more notes stand in provenance.json"] if more > 0 else [])]
        yield cls(tuple(lines), tuple(f"Note: {note}." for note in notes))

    @property
    def limits(self) -> list[str]:
        """All sentences."""
        return [*self.sentences, *self.notes]


def limit_line(output: Output, search: SearchFacts) -> str:
    """Return the upper bound with its filters and response."""
    if search.no_upper_bound is not None or search.upper_bound_proven is None:
        return f"Upper bound: none computed ({search.no_upper_bound})."
    proven = output.goal.format_bound(search.upper_bound_proven)
    gap = "nothing is left to gain"
    if search.gap is not None:
        gap = f"the search's answer is {100 * search.gap:.1f} % below it"
    without = f" but {', '.join(search.upper_bound_left_out)}" if search.upper_bound_left_out else ""
    proof = f"{proven} (proven)"
    if search.upper_bound_attained is not None:
        left = f"{search.upper_bound_proven - search.upper_bound_attained:.2g} {output.goal.unit}".rstrip()
        proof += f", and one filter comes within {left} of it"
    if search.upper_bound_open_parts:
        programs, parts = search.upper_bound_programs, search.upper_bound_open_parts
        proof += f", but it may not be the least one: {parts} parts are open after {programs} linear programs"
    levels = search.front_upper_bounds_open
    technology = (output.study.sweeps | output.study.boxes)[search.space].technology
    moved = "" if technology is None else f", as {technology.description}"
    if output.goal.extreme and output.study.production.tolerance and "edge shifts" not in search.upper_bound_left_out:
        moved += ", whose whole shape production moves"
    box = " (or what the box reaches, where that is more)" if search.upper_bound_of_box else ""
    where = f"{search.channel} of {search.cfa}{f' in {search.scenario}' if len(output.scenarios) > 1 else ''}"
    return (
        f"Upper bound of {output.goal.words} for any filter in {where}: {proof}; {gap}. This is for filters between "
        f"the least transmission and the curve that they replace{box}{moved}, under the same constraints{without}, before "
        "clipping and quantization."
        + (f" At {levels} levels of the front it may not be the least one." if levels else "")
    )
