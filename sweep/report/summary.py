"""A run in about ten lines for a person."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from .comparison import comparison_lines, comparison_with_published
from .content import amount, geometry_table, readable
from .outputs import Output

_MOST_PARAMETERS = 10


def answer_sentences(output: Output) -> list[str]:
    """The question's answer: the best feasible design beside the CFAs that a study compares with."""
    name = readable(output.objective)
    shown = output.trade_off[0]
    limits = " and ".join(f"{readable(q)} {bound}" for q, bound in output.constraints.items())
    under = f" with {limits}" if limits else ""
    beside = ", ".join(
        f"{row['name']} {amount(shown, row[shown])}" for row in output.kind("reference").to_dict("records")
    )
    if not len(output.kind("sweep", "search")):
        return [f"{name} of the named CFAs: {beside}."]
    if output.best.empty:
        return [f"No design is feasible{under}.", f"Plain CFAs: {beside}."]
    best = output.best.iloc[0]
    return [
        f"The best {name}{under} is {amount(output.objective, best[output.objective], 1)} "
        f"(sensitivity {best['sensitivity']:.4f}, "
        f"{best['cfa']}, found by the {best['kind']}).",
        f"Plain CFAs: {beside}.",
    ]


def summary_lines(output: Output) -> list[str]:
    """What a run found and where its files are."""
    lines = answer_sentences(output)
    if not output.best.empty:
        best = output.best.iloc[0]
        own = [name for name in output.parameters if best[name] == best[name]]
        found = ", ".join(f"{name} {best[name]:.2f}" for name in own[:_MOST_PARAMETERS])
        more = f" and {len(own) - _MOST_PARAMETERS} more" if len(own) > _MOST_PARAMETERS else ""
        lines.append(f"Parameters: {found}{more}.")
    named = output.kind("design")
    if len(named):
        each = ", ".join(
            f"{row['name']} {amount(output.trade_off[0], row[output.trade_off[0]])} at {row['sensitivity']:.3f}"
            for row in named.to_dict("records")
        )
        lines.append(f"Named designs: {each}.")
    for row in geometry_table(output).to_dict("records"):
        lines.append(
            f"{row['scenario']}: {row['distance_m']:g} m, {row['fov_deg']:g} deg: "
            f"{row['object_resolution_px']:g} px across the light."
        )
    lines += comparison_lines(comparison_with_published(output))
    lines.append(_counts(output))
    search = output.provenance.get("search")
    if search:
        found = f"{amount(output.objective, search['best_smooth_objective'], 2)} before quantization"
        lines.append(
            f"Search: {search['algorithm']}, {search['starts']} starts, {search['evaluations']} evaluations: {found}."
        )
        lines.append(_limit_line(output, search))
    areas = output.provenance.get("hypervolume")
    if areas:
        both = ", ".join(f"{name} {area:.3f}" for name, area in areas.items() if area > 0)
        lines.append(f"Hypervolume (DN x sensitivity): {both}.")
    lines += [f"Note: {warning}." for warning in output.provenance["warnings"]]
    if output.provenance["sensor"]["surrogate"] or output.provenance["lights"]["surrogate"]:
        lines.append("Note: built-in curves are surrogates, modeled from stated parameters, not measured.")
    lines.append(f"Took {output.provenance['duration_s']:.1f} s with {output.provenance['workers']} workers.")
    lines.append(f"Files: {output.folder}/: results.parquet, report.html, pareto.png, provenance.json.")
    return lines


def _counts(output: Output) -> str:
    table = output.table
    failed = int((table["status"] != "ok").sum())
    feasible, front = int(table["feasible"].sum()), int(table["pareto"].sum())
    text = f"{len(table):,} designs, {feasible:,} feasible, {front:,} on the Pareto front"
    return f"{text}, {failed:,} failed." if failed else f"{text}."


def _limit_line(output: Output, search: Mapping[str, Any]) -> str:
    if search["no_limit"] is not None:
        return f"Limit: none computed ({search['no_limit']})."
    without = f" but {', '.join(search['limit_left_out'])}" if search["limit_left_out"] else ""
    ends = [amount(output.objective, search[f"limit_{end}"], 3) for end in ("attained", "proven")]
    return (
        f"Limit of any filter under the same constraints{without}: between {ends[0]} and {ends[1]}; "
        f"the search's answer is {search['gap']:.1%} below."
    )
