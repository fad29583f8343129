"""A quantity over the scenarios that differ in one number: against distance, exposure or visibility."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..base.types import FloatArray
from ..metrics.quantity import DN
from .figures import CURVE_CYCLE, canvas

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_WIDE = 15.0
_LEAST_LEAD = 1.0
"""DN; who separates less is not said to lead."""
_LABELS = {
    "distance_m": "distance / m",
    "exposure_s": "exposure / s",
    "visibility_m": "visibility / m",
    "intensity_cd": "luminous intensity / cd",
    "read_noise_e": "read noise / e",
    "dark_e_per_s": "dark current / (e/s)",
    "cra_deg": "chief ray angle / degrees",
    "cra_max_deg": "chief ray angle in the corner / degrees",
    "level": "exposure of the brightest channel on white / full scale",
}


@dataclass(frozen=True)
class Line:
    """A design: values over the numbers, ndarray[n], and, where it has one, the upper end of its band.

    `passes`: where it passes the level of the figure, between two of the numbers, and its value there.
    """

    y: FloatArray
    upper: FloatArray | None
    passes: tuple[float, float] | None = None

    def over(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """What is drawn: its values over the numbers `x` (ascending), and where it passes the level among them."""
        if self.passes is None:
            return x, self.y
        at = np.searchsorted(x, self.passes[0])
        return np.insert(x, at, self.passes[0]), np.insert(self.y, at, self.passes[1])


@dataclass(frozen=True)
class SeriesFigure:
    """A line per design over `x` (ndarray[n]), the number `key` of the scenarios; `level` is marked.

    `among`: which scenarios they are, where there are others over the same number. `note`: what the values are.
    """

    title: str
    key: str
    y_label: str
    x: FloatArray
    lines: Mapping[str, Line]
    band: str
    log_y: bool = False
    from_zero: bool = True
    level: float | None = None
    among: str = ""
    note: str = ""

    @property
    def x_label(self) -> str:
        """What the scenarios' number is, with its unit."""
        return _LABELS.get(self.key, self.key)

    @property
    def quantity(self) -> tuple[str, str]:
        """Name and unit of the scenarios' number; the unit may be empty."""
        return quantity_of(self.key)

    @property
    def log_x(self) -> bool:
        """Whether the numbers span more than a decade."""
        return bool(self.x.min() > 0 and self.x.max() / self.x.min() > _WIDE)


def quantity_of(key: str) -> tuple[str, str]:
    """Name and unit of the number that scenarios differ in by its key; the unit may be empty."""
    name, _, unit = _LABELS.get(key, key).partition(" / ")
    return name, unit.strip("()")


def lead_sentence(series: SeriesFigure) -> str:
    """Which design leads from where to where, with its value and its rival's where that ends."""
    name, unit = series.quantity
    what, _, dn = series.y_label.partition(" / ")
    values = {design: np.nan_to_num(line.y, nan=-np.inf) for design, line in series.lines.items()}
    leads = leads_of(series)

    def at(place: int) -> str:
        return f"{series.x[place]:g} {unit}".rstrip()

    parts = []
    for number, (leader, start, stop) in enumerate(leads):
        first, last = start == 0, stop == len(series.x) - 1
        span = f"at {at(start)}" if start == stop else f"from {at(start)}{' on' if last else f' to {at(stop)}'}"
        span = ("everywhere" if last else f"up to {at(stop)}") if first and start != stop else span
        if leader is None:
            parts.append(f"nobody has {_LEAST_LEAD:g} {dn} {span}")
            continue
        following = None if last else leads[number + 1][0]
        rival = following or _second(values, leader, stop)
        parts.append(
            f"{leader} leads {span} ({_told(values[leader][stop], dn)}{'' if start == stop else f' at {at(stop)}'}"
        )
        parts[-1] += f", {rival} {_told(values[rival][stop], dn)})" if rival else ")"
    return f"{what[:1].upper()}{what[1:]} over {name}{f', {series.among}' if series.among else ''}: {'; '.join(parts)}."


def _told(value: float, unit: str) -> str:
    return f"{value:.{0 if abs(value) >= 10 else 1}f} {unit}".rstrip()


def _second(values: Mapping[str, FloatArray], leader: str | None, place: int) -> str | None:
    others = {design: own[place] for design, own in values.items() if design != leader}
    return max(others, key=lambda design: others[design]) if others and leader is not None else None


def leads_of(series: SeriesFigure) -> list[tuple[str | None, int, int]]:
    """(leader, its first place, its last place) in order; None where nobody has a DN.

    Who led at the last place leads as long as nobody has more.
    """
    values = {design: np.nan_to_num(line.y, nan=-np.inf) for design, line in series.lines.items()}
    least = _LEAST_LEAD if series.y_label.endswith(f" / {DN}") else 0.0
    found: list[tuple[str | None, int, int]] = []
    for place in range(len(next(iter(values.values())))):
        most = max(own[place] for own in values.values())
        before = found[-1][0] if found else None
        if not most >= least or most == -np.inf:
            leader = None
        elif before is not None and values[before][place] == most:
            leader = before
        else:
            leader = next(design for design, own in values.items() if own[place] == most)
        if found and found[-1][0] == leader:
            found[-1] = (leader, found[-1][1], place)
        else:
            found.append((leader, place, place))
    return found


def draw_series(series: SeriesFigure) -> Figure:
    """Draw a line with its band per design; numbers over more than a decade are drawn on a logarithmic axis."""
    figure, axes = canvas(8.0, 4.8)
    for (name, line), color in zip(series.lines.items(), CURVE_CYCLE * 4, strict=False):
        axes.plot(*line.over(series.x), "-", color=color, linewidth=1.5)
        axes.plot(series.x, line.y, "o", color=color, markersize=3.5)
        axes.plot([], [], "o-", color=color, label=name, linewidth=1.5, markersize=3.5)
        if line.passes is not None:
            axes.plot(*line.passes, "o", markerfacecolor="none", markeredgecolor=color, markersize=9)
        if line.upper is not None:
            axes.fill_between(series.x, line.y, line.upper, color=color, alpha=0.2, linewidth=0)
    if series.log_x:
        axes.set_xscale("log")
    axes.set_xlabel(series.x_label)
    axes.set_ylabel(series.y_label)
    if series.log_y:
        axes.set_yscale("log")
    elif series.from_zero:
        axes.set_ylim(bottom=0)
    if series.level is not None:
        axes.axhline(series.level, color="#666666", linestyle="--", linewidth=1.0)
    axes.set_title(series.title)
    legend = f"band: {series.band}" if series.band else None
    axes.legend(title=legend, fontsize=8, title_fontsize=8, loc="upper left", bbox_to_anchor=(1.01, 1.0), frameon=False)
    return figure
