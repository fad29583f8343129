"""Maps of the separation over the sensor, designs side by side, where a scene has a field."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from ..base.types import FloatArray
from ..results.output import Output
from ..results.tables import FOUND, PLAIN, SENSOR_MAP
from .figures import Drawing, empty_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_MOST, _ACROSS = 9, 3
"""Maps of one figure, and of one row of it."""
_WIDE, _HIGH = 16, 9
_PIXELS = (108, 192)
_WIDTH_IN = 9.0
_EVEN_DN = 0.5
BEST_FOUND = "best of the search"


@dataclass(frozen=True)
class SensorMap:
    """A separation over image height: `dn` at the `heights`, ndarray[n] each."""

    name: str
    heights: FloatArray
    dn: FloatArray

    @property
    def worst(self) -> str:
        """The smallest one that was computed, and where."""
        at = int(self.dn.argmin())
        height = float(self.heights[at])
        where = "everywhere" if np.ptp(self.dn) < _EVEN_DN else _where(height)
        return f"{self.dn[at]:.0f} DN {where}"


@dataclass(frozen=True)
class SensorFigure:
    """Maps of one scene. `level`: name and DN of the plain CFA that keeps most everywhere; None without one."""

    scenario: str
    words: str
    maps: Sequence[SensorMap]
    level: tuple[str, float] | None
    corner_deg: float
    left_out: int

    @property
    def lined(self) -> bool:
        """Whether some map passes the level, so that a line is drawn there."""
        return any(self.passes(each) for each in self.maps)

    def passes(self, each: SensorMap) -> bool:
        """Whether a map has values on both sides of the level."""
        return self.level is not None and bool(each.dn.min() < self.level[1] < each.dn.max())


def _where(height: float) -> str:
    if height == 0:
        return "in the middle"
    return "in the corner" if height == 1 else f"at {height:.0%} of the corner's height"


def sensor_figures(output: Output) -> Iterator[SensorFigure]:
    """A figure's data for each scene with a field: named designs and the search's answer, the last nine."""
    separation = output.trade_off[0]
    name = separation.of or separation.name
    if output.places is None or separation.pair is None or name not in output.places:
        return
    for scenario in dict.fromkeys(output.few["scenario"]):
        few = output.few[output.few["scenario"] == scenario]
        own = output.places[output.places["design_id"].isin(few["design_id"])]
        if own.empty:
            continue
        plain: list[SensorMap] = []
        others: list[SensorMap] = []
        for row in few.to_dict("records"):
            rows = own[own["design_id"] == row["design_id"]]
            called = BEST_FOUND if row["kind"] == FOUND else str(row["name"])
            made = SensorMap(called, rows["height"].to_numpy(), rows[name].to_numpy())
            if made.dn.size and np.isfinite(made.dn).all():
                (plain if row["kind"] == PLAIN else others).append(made)
        best = max(plain, key=lambda each: float(each.dn.min()), default=None)
        level = None if best is None else (best.name, float(best.dn.min()))
        shown = others or plain
        if shown:
            corner, left_out = float(own["cra_deg"].iloc[-1]), max(0, len(shown) - _MOST)
            yield SensorFigure(scenario, output.columns[name].words, shown[-_MOST:], level, corner, left_out)


def told_map(figure: SensorFigure) -> str:
    """What a map shows, and how it was computed."""
    points = figure.maps[0].heights.size
    line = ""
    if figure.level is not None:
        called, dn = figure.level
        line = f" {called} keeps {dn:.0f} DN everywhere" + ("; a white line is there." if figure.lined else ".")
    smallest = " A title names the smallest of these values."
    if figure.left_out:
        smallest += f" {figure.left_out} more designs are in {SENSOR_MAP}."
    return (
        f"The {figure.words} over the sensor, in {figure.scenario}, before clipping and rounding; the chief ray "
        f"falls in at {figure.corner_deg:g} degrees in the corner. Computed at {points} image heights, linear in "
        f"between, drawn on a sensor of {_WIDE}:{_HIGH}.{smallest}{line}"
    )


def draw_map(figure: SensorFigure) -> Figure:
    """Draw the maps with one scale of colors."""
    columns = min(_ACROSS, len(figure.maps)) if len(figure.maps) != 4 else 2
    rows = -(-len(figure.maps) // columns)
    drawn = empty_figure(_WIDTH_IN, 0.6 + rows * (0.3 + 0.87 * _WIDTH_IN / columns * _HIGH / _WIDE))
    y, x = (np.linspace(-half, half, n) for half, n in zip((_HIGH, _WIDE), _PIXELS, strict=True))
    radius = np.hypot(x[None], y[:, None]) / np.hypot(_WIDE, _HIGH)
    top = max(float(each.dn.max()) for each in figure.maps)
    panels = []
    for number, each in enumerate(figure.maps):
        axes = drawn.add_subplot(rows, columns, number + 1)
        values = np.interp(radius, each.heights, each.dn)
        extent = (-_WIDE, _WIDE, -_HIGH, _HIGH)
        image = axes.imshow(values, cmap="cividis", vmin=0.0, vmax=top, extent=extent, interpolation="nearest")
        if figure.level is not None and figure.passes(each):
            axes.contour(x, y, values, levels=[figure.level[1]], colors="white", linewidths=1.4)
        axes.set_title(f"{each.name}: {each.worst}", fontsize=9)
        axes.set_xticks([])
        axes.set_yticks([])
        panels.append(axes)
    drawn.colorbar(image, ax=panels, shrink=0.85, label=f"{figure.words} / DN")
    drawn.suptitle(f"{figure.words} from the middle of the sensor to its corner, scene {figure.scenario}", fontsize=10)
    return drawn


def map_drawings(output: Output) -> Iterator[tuple[str, str, Drawing]]:
    """(file name, caption, drawing) of every map."""
    for number, figure in enumerate(sensor_figures(output), 1):
        yield f"places-{number}", told_map(figure), partial(draw_map, figure)
