"""Separation against sensitivity: of the modified channel in one CFA, and of the whole CFA in all of them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..base.types import Array, Float
from ..metrics.columns.sensitivity import CFA_SENSITIVITY
from ..results.output import Output
from ..results.shown import even
from ..results.tables import NAMED, REFERENCE, SEARCHED, SWEPT
from .figures import COLORS, canvas, legend_beside
from .leaders import bounds_figure, label
from .terms import is_angle_dependent
from .values import modifications

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_LEAST_RANGE = 1e-3
"""Designs whose sensitivities differ by less do not trade it for anything."""
_DRAWN_POINTS = 10_000
_TRACED_NAME = "found by the search"
_LABEL_BOX = {"facecolor": "white", "alpha": 0.75, "edgecolor": "none", "pad": 1.0}
_MARGIN, _LABEL_ROOM = 0.05, 0.2
"""Shares of the light's range beside the points, and for names on their right."""
_HEADROOM = 0.15
"""Share of the axis above a point that names need."""
_LABELS = {
    "infeasible": "does not meet the constraints",
    "feasible": "feasible",
    "front": "Pareto front",
    "outside": "swept front, constraints on the axes not met",
    "plain": "plain CFAs",
    "named": "named designs",
    "best": "best of the search",
}
_STYLES: dict[str, dict[str, Any]] = {
    "infeasible": {"color": COLORS["infeasible"], "marker": "x", "s": 9, "alpha": 0.45, "linewidths": 0.6, "zorder": 1},
    "feasible": {"color": COLORS["feasible"], "marker": "o", "s": 6, "alpha": 0.5, "linewidths": 0, "zorder": 2},
    "outside": {"marker": "o", "s": 12, "facecolors": "none", "edgecolors": COLORS["front"], "zorder": 2},
    "front": {"color": COLORS["front"], "marker": "o", "s": 14, "zorder": 3},
    "plain": {"marker": "s", "s": 44, "color": COLORS["reference"], "zorder": 5},
    "named": {"color": COLORS["named"], "marker": "D", "s": 42, "zorder": 5},
    # The star lies below the others, so that it hides none.
    "best": {"color": COLORS["best"], "marker": "*", "s": 260, "edgecolors": "black", "linewidths": 0.8, "zorder": 2.5},
}


@dataclass(frozen=True)
class Points:
    """Named group of designs.

    `labels`: labels of single points (empty: none).
    """

    x: Float[Array, " points"]
    y: Float[Array, " points"]
    labels: tuple[str, ...] = ()


@dataclass(frozen=True)
class TradeOff:
    """Separation against a sensitivity.

    `levels`: separation of CFAs without a modified channel; `fits`: both axes are those of the overview: from 0, with
    room for names.
    """

    title: str
    x_label: str
    y_label: str
    groups: Mapping[str, Points]
    traced: Points | None
    limit: Points | None
    limit_name: str
    levels: Mapping[str, float] = field(default_factory=dict)
    bound: float | None = None
    bound_text: str = ""
    counts: Mapping[str, int] = field(default_factory=dict)
    fits: bool = False


def pareto_figure(output: Output, scenario: str, cfa: str) -> TradeOff:
    """Return separation against the sensitivity of the modified channel of one CFA."""
    table = output.table[(output.table["scenario"] == scenario) & (output.table["status"] == "ok")]
    designs = table[table["cfa"] == cfa]
    swept, named, best = (designs[designs["kind"] == kind] for kind in (SWEPT, NAMED, SEARCHED))
    references = table[table["kind"] == REFERENCE]
    separation, sensitivity = output.trade_off
    front = swept["pareto"] & swept["feasible"]
    groups = {
        "infeasible": _points(output, swept[~swept["feasible"]], sensitivity.name),
        "feasible": _points(output, swept[swept["feasible"] & ~front], sensitivity.name),
        "front": _points(output, swept[front], sensitivity.name),
        "named": _points(output, named, sensitivity.name, list(named["name"])),
        "best": _points(output, best, sensitivity.name, [separation.formatted(v) for v in best[separation.name]]),
    }
    bound = output.constraints.get(sensitivity.name)
    least = None if bound is None else bound.min
    traced, limit = _trade_offs(output, scenario, cfa)
    nominal = output.columns[sensitivity.of] if sensitivity.extreme else sensitivity
    return TradeOff(
        title=f"{output.study.study}, {cfa}: what separation costs in sensitivity",
        x_label=sensitivity.words.removesuffix(nominal.words) + nominal.meaning,
        y_label=separation.axis,
        groups=groups,
        traced=traced,
        limit=limit,
        limit_name=_limit_name(output),
        levels=dict(zip(references["cfa"], references[separation.name], strict=True)),
        bound=least,
        bound_text="" if least is None else f"{sensitivity.words} at least {least:g}",
        counts={
            "infeasible": output.counts.feasible(scenario, cfa, met=False),
            "feasible": output.counts.feasible(scenario, cfa),
            "front": output.counts.front(scenario, cfa),
        },
    )


def overview_figure(output: Output, scenario: str) -> TradeOff:
    """Return separation against the light of the whole CFA, for all CFAs of a scenario.

    Designs of the swept front meet every constraint except, in the group `outside`, those on the two axes.
    """
    separation = output.trade_off[0]
    table = output.table[(output.table["scenario"] == scenario) & (output.table["status"] == "ok")]
    table = table[table[separation.name].notna()]
    swept = table[(table["kind"] == SWEPT) & table["pareto"]]
    groups = {}
    for name, kind in {"plain": REFERENCE, "named": NAMED, "best": SEARCHED}.items():
        rows = table[table["kind"] == kind]
        texts = [f"{label(row)} {separation.formatted(row[separation.name])}" for row in rows.to_dict("records")]
        groups[name] = _points(output, rows, CFA_SENSITIVITY, texts)
    groups["front"] = _points(output, swept[swept["feasible"]], CFA_SENSITIVITY)
    groups["outside"] = _points(output, swept[~swept["feasible"]], CFA_SENSITIVITY)
    return replace(around_designs(output, scenario), groups=groups)


def around_designs(output: Output, scenario: str) -> TradeOff:
    """Return `overview_figure` without the designs."""
    separation, sensor = output.trade_off[0], output.provenance.sensor
    traced, limit = _trade_offs(output, scenario)
    reference = "clear sensor" if sensor.has_clear else f"{sensor.reference} pixels alone"
    return TradeOff(
        title=f"{output.study.study}: {separation.words} against light",
        x_label=f"{output.columns[CFA_SENSITIVITY].words}: light of the whole CFA ({reference} = 1)",
        y_label=separation.axis,
        groups={},
        traced=traced,
        limit=limit,
        limit_name=_limit_name(output),
        fits=True,
    )


def _limit_name(output: Output) -> str:
    """Return the filters of the upper bound, for a legend; empty without a search."""
    search, found = output.provenance.search, output.kind(SEARCHED)
    if search is None:
        return ""
    such = "such layers in " if len(found) and is_angle_dependent(output, found.iloc[0].to_dict()) else ""
    return f"upper bound for {such}{search.channel} of {search.cfa}, unquantized"


def _points(output: Output, rows: pd.DataFrame, x: str, labels: Sequence[str] = ()) -> Points:
    y = rows[output.trade_off[0].name].to_numpy(dtype=float)
    return Points(rows[x].to_numpy(dtype=float), y, tuple(map(str, labels)))


def _trade_offs(output: Output, scenario: str, cfa: str | None = None) -> tuple[Points | None, Points | None]:
    """Return optima and upper bound of a search over the light of the whole CFA or of the modified channel."""
    search, front = output.provenance.search, output.front
    if front is None or search is None or search.scenario != scenario or cfa not in (None, search.cfa):
        return None, None
    x = CFA_SENSITIVITY if cfa is None else "sensitivity"
    lines = []
    for axis, name in ((x, "objective"), (f"{x}_min", "limit")):
        rows = front.dropna(subset=[axis, name])
        shown = len(rows) and (cfa is None or name == "objective" or bounds_figure(output, scenario, cfa))
        lines.append(Points(rows[axis].to_numpy(), rows[name].to_numpy()) if shown else None)
    return lines[0], lines[1]


def traded_cfas(output: Output) -> list[str]:
    """Return CFAs with designs, swept or searched, that trade sensitivity for separation."""
    rows, cfas = output.kind(SWEPT), []
    for cfa in dict.fromkeys(m.cfa for m in modifications(output)):
        swept = rows[(rows["cfa"] == cfa) & (rows["status"] == "ok")]["sensitivity"].to_numpy(dtype=float)
        traced = _trade_offs(output, output.scenarios[0], cfa)[0]
        x = swept if traced is None else np.concatenate([swept, traced.x])
        x = x[np.isfinite(x)]
        if x.size and np.ptp(x) > _LEAST_RANGE:
            cfas.append(cfa)
    return cfas


def draw_trade_off(figure: TradeOff) -> Figure:
    """Draw the trade-off; each group has its marker, and named designs their name."""
    drawn, axes = canvas(8.3, 5.0)
    for group, points in figure.groups.items():
        if points.x.size:
            text = f"{_LABELS[group]} ({figure.counts[group]:,})" if group in figure.counts else _LABELS[group]
            # Spread evenly and not in step with a grid.
            shown = even(points.x.size, _DRAWN_POINTS) if points.x.size > _DRAWN_POINTS else slice(None)
            axes.scatter(points.x[shown], points.y[shown], label=text, rasterized=True, **_STYLES[group])
    traced, limit = figure.traced, figure.limit
    if traced is not None:
        axes.plot(traced.x, traced.y, "+", color="black", markersize=7, label=_TRACED_NAME, zorder=4)
    if limit is not None:
        style: dict[str, Any] = {"color": COLORS["limit"], "linestyle": "--", "linewidth": 1.5, "zorder": 4}
        axes.plot(limit.x, limit.y, label=figure.limit_name, drawstyle="steps-post", **style)
    low, high = axes.get_xlim()
    if figure.fits:
        low, high = low - _MARGIN * (high - low), high + _LABEL_ROOM * (high - low)
        axes.set_ylim(bottom=0)
    axes.set_xlim(low, high)
    heights = sorted(figure.levels.items(), key=lambda item: item[1])
    for _, level in heights:
        axes.axhline(level, color=COLORS["reference"], linestyle=":", linewidth=1.1, zorder=0)
    for text, level in _level_labels(heights, axes.get_ylim()):
        axes.text(low + 0.01 * (high - low), level, text, fontsize=8, va="bottom", zorder=8, bbox=_LABEL_BOX)
    if figure.bound is not None:
        axes.axvline(figure.bound, color="black", linestyle="--", linewidth=1.0, label=figure.bound_text)
    _annotate(axes, figure.groups.values())
    axes.set(xlabel=figure.x_label, ylabel=figure.y_label, title=figure.title)
    legend_beside(axes)
    return drawn


def _level_labels(heights: Sequence[tuple[str, float]], limits: tuple[float, float]) -> list[tuple[str, float]]:
    """Return one label for levels that are too close for two."""
    merged: list[tuple[list[str], float]] = []
    for name, level in heights:
        if merged and level - merged[-1][1] < 0.03 * (limits[1] - limits[0]):
            merged[-1][0].append(f"{name} {level:.0f}")
        else:
            merged.append(([f"{name} {level:.0f}"], level))
    return [(", ".join(names), level) for names, level in merged]


def _annotate(axes: Axes, groups: Iterable[Points]) -> None:
    """Draw names beside points; names of close points stand above each other, below the point near the upper end."""
    labeled = sorted(item for points in groups for item in zip(points.x, points.y, points.labels, strict=False))
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    for number, (x, y, text) in enumerate(labeled):
        placed = [(u, v) for u, v, _ in labeled[:number]]
        near = sum(abs(x - u) < 0.15 * (right - left) and abs(y - v) < 0.05 * (top - bottom) for u, v in placed)
        up = y + _HEADROOM * (top - bottom) < top
        offset = (7, 4 + 11 * near if up else -4 - 11 * near)
        axes.annotate(text, (x, y), textcoords="offset points", xytext=offset, fontsize=9, zorder=7)
