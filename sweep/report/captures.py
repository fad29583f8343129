"""Figure of an HDR pixel: which capture reads each channel, over scenarios that differ in one number."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from ..base.types import Array, Float
from ..results.output import Output
from ..study.axes import series_of
from .figures import TYPE_COLORS, Drawing, canvas, legend_beside
from .series import SeriesFigure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_SHADES = ("#08519c", "#3182bd", "#9ecae1", "#deebf7")
_SATURATED = "#d62728"
_TYPES = 2


@dataclass(frozen=True)
class CapturesFigure:
    """Bars of captures."""

    series: SeriesFigure
    ends: Mapping[tuple[str, str, str], Float[Array, " captures"]]


def capture_drawings(output: Output) -> Iterator[tuple[str, str, Drawing]]:
    """Yield name, title and drawing for each series of a study of an HDR pixel."""
    if output.handovers is None:
        return
    pair = output.trade_off[0].pair
    for number, ((base, key), scenarios) in enumerate(series_of(output.scenarios).items(), 1):
        known = output.handovers[(output.handovers["series"] == base) & (output.handovers["key"] == key)]
        kinds = [kind for kind in known["signal_type"].unique() if pair is None or kind in pair][:_TYPES]
        known = known[known["signal_type"].isin(kinds)].sort_values("capture", kind="stable")
        ends = {
            (str(name), str(channel), str(kind)): part["at"].to_numpy(dtype=float)
            for (name, channel, kind), part in known.groupby(["name", "channel", "signal_type"], sort=False)
        }
        if ends:
            title = f"{output.study.study}, {base}: capture that reads the median signal"
            series = SeriesFigure(title, key, "", np.array([*scenarios.values()]), {}, "")
            yield f"captures-{number}", title, partial(draw_captures, CapturesFigure(series, ends))


def draw_captures(figure: CapturesFigure) -> Figure:
    """Draw a bar for each design, channel and signal type; its shade is the capture."""
    series, low, high = figure.series, float(figure.series.x[0]), float(figure.series.x[-1])
    names = list(dict.fromkeys(name for name, _, _ in figure.ends))
    rows = [key for name in names for key in figure.ends if key[0] == name]
    drawn, axes = canvas(8.0, 1.5 + 0.17 * len(rows) + 0.12 * len(names))
    y, ticks, labels = 0.0, list[float](), list[str]()
    n_captures = max(map(len, figure.ends.values()))
    for at, (name, channel, kind) in enumerate(rows):
        first_of_design = at == 0 or rows[at - 1][0] != name
        y += 1.7 if first_of_design else 1.0
        edges = np.clip([low, *figure.ends[name, channel, kind], high], low, high)
        for number, (start, stop) in enumerate(pairwise(edges)):
            shade = _SATURATED if number == n_captures else _SHADES[number]
            axes.barh(y, stop - start, left=start, height=0.9, color=shade, edgecolor="none")
        axes.plot([low], [y], marker="s", color=TYPE_COLORS.get(kind, "#000000"), markersize=4, clip_on=False)
        if rows[at - 1][:2] != (name, channel) or at == 0:
            ticks.append(y + 0.5 if at + 1 < len(rows) and rows[at + 1][:2] == (name, channel) else y)
            labels.append(f"{name}  {channel}" if first_of_design else channel)
    for number in range(n_captures):
        axes.barh(0, 0, color=_SHADES[number], label=f"capture {number + 1}")
    axes.barh(0, 0, color=_SATURATED, label="saturated")
    for kind in dict.fromkeys(kind for _, _, kind in rows):
        axes.plot([], [], "s", color=TYPE_COLORS.get(kind, "#000000"), markersize=4, label=kind)
    if series.log_x:
        axes.set_xscale("log")
        axes.xaxis.set_major_formatter("{x:g}")
    axes.set_yticks(ticks, labels)
    axes.set(xlim=(low, high), ylim=(y + 1, 0.4), xlabel=series.x_label, title=series.title)
    legend_beside(axes)
    return drawn
