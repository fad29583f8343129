"""All CFAs of a study in one plot: separation against the light of the whole CFA."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from ..metrics.columns.sensitivity import CFA_SENSITIVITY
from ..results.output import Output
from ..results.tables import FOUND, NAMED, PLAIN, SWEPT
from .figures import COLORS, TRACED_NAME, Points, canvas
from .names import label
from .upper_bound import limit_name

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

_STYLES: dict[str, dict[str, Any]] = {
    "plain": {"marker": "s", "s": 44, "zorder": 5},
    "named": {"marker": "D", "s": 42, "zorder": 5},
    "front": {"marker": "o", "s": 14, "zorder": 3},
    "outside": {"marker": "o", "s": 12, "facecolors": "none", "zorder": 2},
    "best": {"marker": "*", "s": 220, "edgecolors": "black", "linewidths": 0.8, "zorder": 6},
}
_NAMES = {
    "plain": "plain CFAs",
    "named": "named designs",
    "front": "swept front",
    "outside": "swept front, constraints on the axes not met",
    "best": "best of the search",
}


@dataclass(frozen=True)
class OverviewFigure:
    """Separation over the light of the whole CFA (1: a clear sensor, or brightest pixels alone), in one scenario.

    `groups`: plain CFAs, named designs, the search's best and the swept front, whose designs meet every constraint
    but, in `outside`, those on its two axes. `traced`: what the search found at each level of sensitivity; `limit`:
    what no filter exceeds there, named `limit_name`. The last two are of the CFA that was searched.
    """

    title: str
    x_label: str
    y_label: str
    groups: dict[str, Points]
    traced: Points | None
    limit: Points | None
    limit_name: str


def overview_figure(output: Output, scenario: str) -> OverviewFigure:
    """All CFAs of a scenario."""
    table = output.table[(output.table["scenario"] == scenario) & (output.table["status"] == "ok")]
    swept = table[(table["kind"] == SWEPT) & table["pareto"]]
    kinds = {"plain": PLAIN, "named": NAMED, "best": FOUND}
    groups = {name: _points(output, table[table["kind"] == kind], named=True) for name, kind in kinds.items()}
    for name, rows in (("front", swept[swept["feasible"]]), ("outside", swept[~swept["feasible"]])):
        groups[name] = _points(output, rows)
    return replace(around_designs(output, scenario), groups=groups)


def around_designs(output: Output, scenario: str) -> OverviewFigure:
    """The same without the designs: what stands around them."""
    separation = output.trade_off[0]
    traced, limit = _trade_off(output, scenario)
    sensor = output.provenance.sensor
    reference = "clear sensor" if sensor.has_clear else f"{sensor.reference} pixels alone"
    return OverviewFigure(
        title=f"{output.study.study}: {separation.words} against light",
        x_label=f"{output.columns[CFA_SENSITIVITY].words}: light of the whole CFA ({reference} = 1)",
        y_label=separation.axis,
        groups={},
        traced=traced,
        limit=limit,
        limit_name=limit_name(output),
    )


def _points(output: Output, rows: pd.DataFrame, *, named: bool = False) -> Points:
    separation = output.trade_off[0]
    rows = rows[rows[separation.name].notna()]
    y = rows[separation.name].to_numpy(dtype=float)
    texts = (
        [f"{label(row)} {separation.told(row[separation.name])}" for row in rows.to_dict("records")] if named else []
    )
    return Points(rows[CFA_SENSITIVITY].to_numpy(dtype=float), y, tuple(texts))


def _trade_off(output: Output, scenario: str) -> tuple[Points | None, Points | None]:
    """What the search traced, and the limit at each level, over the light of the CFA."""
    search, front = output.provenance.search, output.front
    if front is None or search is None or search.scenario != scenario:
        return None, None
    found = []
    for x, y in (("cfa_sensitivity", "objective"), ("cfa_sensitivity_min", "limit")):
        rows = front.dropna(subset=[x, y])
        found.append(Points(rows[x].to_numpy(), rows[y].to_numpy()) if len(rows) else None)
    return found[0], found[1]


def draw_overview(figure: OverviewFigure) -> Figure:
    """Draw all CFAs; each group has its marker, plain CFAs, named designs and the best one their name and figure."""
    drawn, axes = canvas(8.6, 5.0)
    for group, points in figure.groups.items():
        if points.x.size:
            color = {"edgecolors": COLORS["front"]} if group == "outside" else {"color": COLORS[_color(group)]}
            axes.scatter(points.x, points.y, label=_NAMES[group], **{**_STYLES[group], **color})
    if figure.traced is not None:
        axes.plot(
            figure.traced.x, figure.traced.y, "+", color=COLORS["best"], markersize=7, label=TRACED_NAME, zorder=4
        )
    if figure.limit is not None:
        style: dict[str, Any] = {"color": COLORS["limit"], "linestyle": "--", "linewidth": 1.5, "zorder": 4}
        axes.plot(figure.limit.x, figure.limit.y, label=figure.limit_name, drawstyle="steps-post", **style)
    low, high = axes.get_xlim()
    axes.set_xlim(min(low, 0.25), max(high, 1.0))
    axes.set_ylim(bottom=0)
    for group in ("plain", "named", "best"):
        _write(axes, figure.groups[group])
    axes.set_xlabel(figure.x_label)
    axes.set_ylabel(figure.y_label)
    axes.set_title(figure.title)
    axes.legend(fontsize=8, loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0, frameon=False)
    return drawn


def _color(group: str) -> str:
    return "reference" if group == "plain" else group


def _write(axes: Any, points: Points) -> None:
    """Names beside points; one that would lie on another goes above it."""
    placed: Sequence[tuple[float, float]] = []
    for x, y, text in sorted(zip(points.x, points.y, points.labels, strict=False)):
        near = sum(abs(x - u) < 0.12 and abs(y - v) < 0.05 * axes.get_ylim()[1] for u, v in placed)
        axes.annotate(text, (x, y), textcoords="offset points", xytext=(7, 4 + 11 * near), fontsize=9, zorder=7)
        placed = [*placed, (x, y)]
