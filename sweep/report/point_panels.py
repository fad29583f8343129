"""Panels with a mark for each design: separation against light, and clouds of many sensors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..base.types import Array, Float
from .look import DIM, GAIN, INK, font, label_ends, styles_of, words_at
from .panels import LEFT, right_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Pairs = tuple[Float[Array, " _points"], Float[Array, " _points"]]
_NARROW = 2.0
"""A front on whose axis all points would take this times its room is drawn alone, with others at its edge."""


@dataclass(frozen=True)
class Point:
    """A CFA or design."""

    name: str
    x: float
    y: float
    text: str


@dataclass(frozen=True)
class Scatter:
    """Points by name, a cloud of others, optima and an upper bound, and a level of reference."""

    title: str
    x_label: str
    points: tuple[Point, ...]
    bold: str = ""
    cloud: Pairs | None = None
    traced: Pairs | None = None
    bound: Pairs | None = None
    level: float | None = None

    def room(self, *, wide: bool) -> tuple[float, float]:
        """Numbers on the left, names on the right."""
        low, high = self._ends()
        texts = [f"{point.text}{'' if low <= point.x <= high else ' ' * 7}" for point in self.points]
        return LEFT, right_of(texts, wide=wide)

    def _ends(self) -> tuple[float, float]:
        """Return the ends of the axis: all points, or those around the front where it is narrow beside them."""
        front = [part[0] for part in (self.cloud, self.traced, self.bound) if part is not None and len(part[0])]
        own = [point.x for point in self.points if point.name == self.bold]
        if not front or not own:
            return -np.inf, np.inf
        near = np.concatenate([*front, own])
        low, high = float(near.min()), float(near.max())
        every = [*near, *(point.x for point in self.points)]
        room = max(0.25 * (high - low), 1.0)
        wide = max(every) - min(every) > _NARROW * (high - low + 2 * room)
        return (low - room, high + room) if wide else (-np.inf, np.inf)

    def tall(self, *, wide: bool) -> float:
        """Lower on a narrow screen."""
        return 320 if wide else 260

    def draw(self, axes: Axes) -> None:
        """Draw points, lines and names."""
        styles = styles_of(point.name for point in self.points)
        if self.cloud is not None:
            axes.plot(*self.cloud, "o", color="#7aa7e0", markersize=3, alpha=0.6, markeredgewidth=0)
        if self.bound is not None:
            axes.plot(*self.bound, color=DIM, linestyle=(0, (5, 3)), linewidth=1.4, drawstyle="steps-post")
            at = int(np.argmax(self.bound[1]))
            words_at(
                axes,
                " upper bound",
                float(self.bound[0][at]),
                float(self.bound[1][at]),
                color=DIM,
                ha="left",
                va="bottom",
            )
        if self.traced is not None:
            axes.plot(*self.traced, color=styles[self.bold].color if self.bold else GAIN, linewidth=2.4)
        if self.level is not None:
            axes.axhline(self.level, color=INK, linestyle=(0, (1, 2)), linewidth=1.2)
        low_x, high_x = self._ends()
        texts = {point.name: point.text for point in self.points}
        for point in self.points:
            style, bold = styles[point.name], point.name == self.bold
            x = np.clip(point.x, low_x, high_x)
            axes.plot(x, point.y, style.marker, color=style.color, zorder=5, clip_on=False,
                      markersize=13 if bold else 8, markeredgecolor="white", markeredgewidth=0.8)  # fmt: skip
            if not low_x <= point.x <= high_x:
                texts[point.name] += f" ({'◂' if point.x < low_x else '▸'} {point.x:.0f} %)"
        if np.isfinite([low_x, high_x]).all():
            axes.set_xlim(low_x, high_x)
        axes.margins(0.08 if np.isinf(low_x) else 0.0, 0.08)
        low, high = axes.get_ylim()
        axes.set_ylim(min(0.0, low) if low < 0.5 * high else low, high + 0.05 * (high - low))
        ends = {texts[point.name]: (point.y, styles[point.name], point.name == self.bold) for point in self.points}
        label_ends(axes, ends, axes.get_ylim())
        axes.set_xlabel(self.x_label, fontsize=font(axes.figure), color=INK)  # type: ignore[arg-type]


@dataclass(frozen=True)
class Dots:
    """A cloud of dots for each name, whose name stands beside it, and words at some of the dots."""

    title: str
    x_label: str
    groups: Mapping[str, Pairs]
    marks: tuple[tuple[str, float, float], ...] = ()

    def room(self, *, wide: bool) -> tuple[float, float]:
        """Numbers on the left, names on the right."""
        return LEFT, right_of(self.groups, wide=wide)

    def tall(self, *, wide: bool) -> float:
        """Lower on a narrow screen."""
        return 360 if wide else 270

    def draw(self, axes: Axes) -> None:
        """Draw dots, their names at the height of their middle, and words."""
        styles, ends = styles_of(self.groups), {}
        for name, (x, y) in self.groups.items():
            style = styles[name]
            axes.plot(x, y, style.marker, color=style.color, markersize=7, alpha=0.75, markeredgecolor="white")
            ends[name] = (float(np.median(y)), style, False)
        axes.margins(0.06)
        axes.set_xlim(left=0.0)
        axes.set_ylim(bottom=0.0)
        for text, *place_of in self.marks:
            words_at(axes, f" {text}", *place_of, color=DIM, fontsize=font(axes.figure) - 2)  # type: ignore[arg-type]
        label_ends(axes, ends, axes.get_ylim())
        axes.set_xlabel(self.x_label, fontsize=font(axes.figure), color=INK)  # type: ignore[arg-type]
