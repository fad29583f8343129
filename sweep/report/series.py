"""Quantities over scenarios that differ in one number: distance, exposure or visibility."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from ..base.types import Array, Float, IndexArray, Int, Num
from ..metrics.quantity import DN
from ..results.output import Output
from ..study.axes import series_of
from .figures import CURVE_CYCLE, DASHES, canvas, legend_beside
from .leaders import capital

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

_WIDE = 15.0
_LEAST_LEAD = 1.0
"""DN; who separates less is not said to lead."""
_LEAST_DRAWN = 0.3
_VANISHES = f"The dashed line is {_LEAST_LEAD:g} {DN}; {_LEAST_DRAWN:g} {DN} or less is drawn at {_LEAST_DRAWN:g} {DN}."
_LABELS = {
    "distance_m": "distance / m",
    "exposure_s": "exposure / s",
    "visibility_m": "visibility / m",
    "frequency_hz": "frequency of the pulses / Hz",
    "duty": "duty of the pulses",
    "intensity_cd": "luminous intensity / cd",
    "read_noise_e": "read noise / e",
    "dark_e_per_s": "dark current / (e/s)",
    "cra_deg": "chief ray angle / degrees",
    "cra_max_deg": "chief ray angle in the corner / degrees",
    "level": "exposure of the brightest channel on white / full scale",
}


@dataclass(frozen=True)
class Line:
    """Line of a design.

    `passes`: numbers at which it passes the level of the figure, and its value there.
    """

    y: Num[Array, " levels"]
    upper: Num[Array, " levels"] | None
    passes: tuple[tuple[float, float], ...] = ()

    def over(self, x: Float[Array, " levels"]) -> tuple[Float[Array, " _values"], Float[Array, " _values"]]:
        """Return numbers and values as drawn, with the crossing among them.

        `x`: numbers, ascending.
        """
        numbers = np.concatenate([x, [number for number, _ in self.passes]])
        values = np.concatenate([self.y, [value for _, value in self.passes]])
        order = np.argsort(numbers, kind="stable")
        return numbers[order], values[order]


@dataclass(frozen=True)
class SeriesFigure:
    """One line per design over the number `key` of the scenarios of `base`, with a marked level.

    `marks`: numbers to mark on each design's line.
    """

    title: str
    key: str
    y_label: str
    x: Float[Array, " numbers"]
    lines: Mapping[str, Line]
    band: str
    log_y: bool = False
    from_zero: bool = True
    level: float | None = None
    among: str = ""
    note: str = ""
    base: str = ""
    marks: Mapping[str, Float[Array, " levels"]] = field(default_factory=dict)

    @property
    def x_label(self) -> str:
        """Number of the scenarios with its unit."""
        return _LABELS.get(self.key, self.key)

    @property
    def log_x(self) -> bool:
        """True if the numbers span more than a decade."""
        return bool(self.x.min() > 0 and self.x.max() / self.x.min() > _WIDE)

    def at(self, place: int) -> str:
        """Return a number of the scenarios with its unit."""
        return f"{self.x[place]:g} {quantity_of(self.key)[1]}".rstrip()

    @property
    def values(self) -> dict[str, Num[Array, " _levels"]]:
        """Values of each design, with unknown ones as the least."""
        return {design: np.nan_to_num(line.y, nan=-np.inf) for design, line in self.lines.items()}


def quantity_of(key: str) -> tuple[str, str]:
    """Return name and unit of the number that scenarios differ in.

    The unit may be empty.
    """
    name, _, unit = _LABELS.get(key, key).partition(" / ")
    return name, unit.strip("()")


def scene_in_words(scenario: str) -> str:
    """Return a scenario's name; numbers of many digits, as of geometric steps, in three: `lamp at 139 Hz`."""

    def in_words(found: re.Match[str]) -> str:
        unit = quantity_of(found[1])[1]
        return f" at {float(found[2]):.3g} {unit}" if unit else f" {found[1]}={float(found[2]):.3g}"

    return re.sub(r" (\w+)=(\d+\.\d{4,})(?![\de])", in_words, scenario)


def over_series(rows: pd.DataFrame, scenarios: Mapping[str, float], column: str) -> dict[str, np.ndarray]:
    """Return a column over a series' numbers for every design with all of them."""
    names = list(scenarios)
    rows = rows[rows["scenario"].isin(names)].dropna(subset=["name"]).astype({"name": str, "scenario": str})
    designs = {str(name): part.set_index("scenario")[column] for name, part in rows.groupby("name", sort=False)}
    return {name: y.reindex(names).to_numpy(dtype=float) for name, y in designs.items() if len(y) == len(names)}


def series_figures(output: Output) -> list[SeriesFigure]:
    """Return the separation of every named design over each set of scenarios that differ in one number.

    Where separations fall below 1 DN, the axis is logarithmic; the series with most such designs comes first.
    """
    rows, separation, columns = output.named_rows, output.trade_off[0], output.columns.values()
    best_phase = [c.name for c in columns if (c.extreme, c.of) == ("best place", separation.name) and c.name in rows]
    figures, series = [], series_of(output.scenarios)
    for (base, key), scenarios in series.items():
        worst = over_series(rows, scenarios, separation.name)
        upper = over_series(rows, scenarios, best_phase[0]) if best_phase else {}
        upper = {n: y for n, y in upper.items() if np.isfinite(y).all() and not np.array_equal(y, worst[n])}
        lines = {name: Line(y, upper.get(name)) for name, y in worst.items()}
        if lines:
            band = "over the sampling phases" if upper else ""
            title = f"{output.study.study}, {base}: {separation.words}"
            x = np.array(list(scenarios.values()))
            among = base if [other for _, other in series].count(key) > 1 else ""
            figure = SeriesFigure(title, key, separation.axis, x, lines, band, among=among, base=base)
            figures.append(_over_decades(figure) if _below(figure) else figure)
    return sorted(figures, key=lambda figure: -sum(map(len, _below(figure).values())))


def _over_decades(figure: SeriesFigure) -> SeriesFigure:
    """Return a figure of separations on a logarithmic axis, with 1 DN marked."""
    lines = {name: replace(line, y=np.maximum(line.y, _LEAST_DRAWN)) for name, line in figure.lines.items()}
    return replace(figure, lines=lines, log_y=True, level=_LEAST_LEAD, note=_VANISHES)


def lead_sentence(series: SeriesFigure) -> str:
    """Return the leading design of each range, with its value and its rival's at the end."""
    what, _, unit = series.y_label.partition(" / ")
    values, leads = series.values, leads_of(series)

    def formatted(design: str, place: int) -> str:
        value = values[design][place]
        return f"{value:.{0 if abs(value) >= 10 else 1}f} {unit}".rstrip()

    parts = []
    for number, (leader, start, stop) in enumerate(leads):
        first, last = start == 0, stop == len(series.x) - 1
        if start == stop:
            span = f"at {series.at(start)}"
        elif first:
            span = "everywhere" if last else f"up to {series.at(stop)}"
        else:
            span = f"from {series.at(start)}{' on' if last else f' to {series.at(stop)}'}"
        if leader is None:
            parts.append(f"no CFA reaches {_LEAST_LEAD:g} {unit} {span}")
            continue
        others = sorted((d for d in values if d != leader), key=lambda d: -values[d][stop])
        rival = (None if last else leads[number + 1][0]) or next(iter(others), None)
        where = "" if start == stop else f" at {series.at(stop)}"
        beside = f", {rival} {formatted(rival, stop)}" if rival else ""
        parts.append(f"{leader} leads {span} ({formatted(leader, stop)}{where}{beside})")
    among = f", {series.among}" if series.among else ""
    return f"{capital(what)} over {quantity_of(series.key)[0]}{among}: {'; '.join(parts)}."


def vanishing_line(series: SeriesFigure) -> list[str]:
    """Return between which numbers separations fall below 1 DN.

    Empty if no design does.
    """
    ranges = _below(series)
    if not ranges:
        return []
    parts = [
        f"{where} for {'every CFA' if len(designs) == len(series.lines) else ', '.join(designs)}"
        for where, designs in ranges.items()
    ]
    what, among = series.y_label.partition(" / ")[0], f", {series.among}," if series.among else ""
    never = [design for design in series.lines if not any(design in designs for designs in ranges.values())]
    parts += [f"at no {quantity_of(series.key)[0]} for {', '.join(never)}"] if never else []
    return [f"{capital(what)}{among} is below {_LEAST_LEAD:g} {DN} {'; '.join(parts)}."]


def _below(series: SeriesFigure) -> dict[str, list[str]]:
    """Return designs below 1 DN by the range of numbers, in words."""
    ranges: dict[str, list[str]] = {}
    name = quantity_of(series.key)[0]
    article = "an" if name[0] in "aeiou" else "a"
    for design, y in series.values.items() if series.y_label.endswith(f" / {DN}") else ():
        below = y < _LEAST_LEAD
        ends = np.flatnonzero(np.diff(below))
        if below.all():
            where = f"at every {name}"
        else:
            runs = np.split(np.arange(below.size), ends + 1)
            where = " and ".join(_run(series, run, article) for run in runs if below[run[0]])
        if below.any():
            ranges.setdefault(where, []).append(design)
    return ranges


def _run(series: SeriesFigure, run: Int[IndexArray, " run"], article: str) -> str:
    """Return a range of neighboring numbers in words."""
    first, last, (name, unit) = int(run[0]), int(run[-1]), quantity_of(series.key)
    if first == 0:
        return f"up to {article} {name} between {series.x[last]:g} and {series.x[last + 1]:g} {unit}".rstrip()
    if last == series.x.size - 1:
        return f"from {article} {name} between {series.x[first - 1]:g} and {series.x[first]:g} {unit} on".rstrip()
    return f"from {series.at(first)} to {series.at(last)}"


def leads_of(series: SeriesFigure) -> list[tuple[str | None, int, int]]:
    """Return the leader of each range in order; None where no CFA reaches 1 DN.

    A leader stays one as long as no other design has more.
    """
    values = series.values
    least = _LEAST_LEAD if series.y_label.endswith(f" / {DN}") else 0.0
    leads: list[tuple[str | None, int, int]] = []
    for at in range(len(series.x)):
        most = max(y[at] for y in values.values())
        before = leads[-1][0] if leads else None
        leader: str | None = None
        if most >= least:
            ties = [design for design, y in values.items() if y[at] == most]
            leader = before if before in ties else ties[0]
        if leads and before == leader:
            leads[-1] = (leader, leads[-1][1], at)
        else:
            leads.append((leader, at, at))
    return leads


def _between(
    at: Float[Array, " at"], x: Float[Array, " levels"], y: Float[Array, " levels"], series: SeriesFigure
) -> Float[Array, " at"]:
    """Return the height of a line, as drawn, at some numbers."""
    across, up = np.log if series.log_x else np.positive, np.log if series.log_y else np.positive
    height = np.interp(across(at), across(x), up(y))
    return np.asarray(np.exp(height) if series.log_y else height, dtype=float)


def draw_series(series: SeriesFigure) -> Figure:
    """Draw one line with its band per design; numbers over more than a decade are on a logarithmic axis."""
    figure, axes = canvas(8.0, 4.8)
    widths = iter(np.linspace(3.0, 1.5, len(series.lines)))  # of equal lines each is seen below the next
    for (name, line), color, dash in zip(series.lines.items(), CURVE_CYCLE * 4, DASHES * 7, strict=False):
        axes.plot(*line.over(series.x), linestyle=dash, color=color, linewidth=next(widths))
        axes.plot(series.x, line.y, "o", color=color, markersize=3.5)
        axes.plot([], [], "o", linestyle=dash, color=color, label=name, linewidth=1.5, markersize=3.5)
        for passed in line.passes:
            axes.plot(*passed, "o", markerfacecolor="none", markeredgecolor=color, markersize=9)
        if (marks := series.marks.get(name)) is not None:
            x, y = line.over(series.x)
            axes.plot(marks, _between(marks, x, y, series), "|", color=color, markersize=11, markeredgewidth=1.2)
        if line.upper is not None:
            axes.fill_between(series.x, line.y, line.upper, color=color, alpha=0.2, linewidth=0)
    if series.level is not None:
        axes.axhline(series.level, color="#666666", linestyle="--", linewidth=1.0)
    if series.log_x:
        axes.set_xscale("log")
        axes.xaxis.set_major_formatter("{x:g}")
    if series.log_y:
        axes.set_yscale("log")
        if series.y_label.endswith(f" / {DN}"):
            axes.yaxis.set_major_formatter("{x:g}")
    elif series.from_zero:
        axes.set_ylim(bottom=0)
    axes.set(xlabel=series.x_label, ylabel=series.y_label, title=series.title)
    legend_beside(axes, f"band: {series.band}" if series.band else None)
    return figure
