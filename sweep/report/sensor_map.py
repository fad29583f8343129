"""Maps of the separation over the sensor, designs side by side, for a scene with a field."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from ..base.types import Array, Float
from ..results.output import Output
from ..results.tables import REFERENCE, SEARCHED, SENSOR_MAP
from .figures import Drawing, panel_grid

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
    """Separation over image height.

    `heights`, `dn`: relative image heights, and CSD, DN.
    """

    name: str
    heights: Float[Array, " heights"]
    dn: Float[Array, " heights"]

    @property
    def worst(self) -> str:
        """Smallest computed CSD, and its position."""
        at = int(self.dn.argmin())
        height = float(self.heights[at])
        where = {0.0: "in the middle", 1.0: "in the corner"}.get(height, f"at {height:.0%} of the corner's height")
        return f"{self.dn[at]:.0f} DN {'everywhere' if np.ptp(self.dn) < _EVEN_DN else where}"


@dataclass(frozen=True)
class SensorFigure:
    """Maps of one scene; `level` is name and DN of the plain CFA with the largest worst CSD, if any."""

    scenario: str
    words: str
    maps: Sequence[SensorMap]
    level: tuple[str, float] | None
    corner_deg: float
    left_out: int


def sensor_figures(output: Output) -> Iterator[SensorFigure]:
    """Yield the data of one figure per scene with a field: named designs and the answer, the last nine."""
    separation = output.trade_off[0]
    name = separation.of or separation.name
    if output.places is None or separation.pair is None or name not in output.places:
        return
    for scenario, scenario_rows in output.named_rows.groupby("scenario", sort=False, observed=True):
        places = output.places[output.places["design_id"].isin(scenario_rows["design_id"])]
        plain: list[SensorMap] = []
        others: list[SensorMap] = []
        for row in scenario_rows.to_dict("records"):
            rows = places[places["design_id"] == row["design_id"]]
            called = BEST_FOUND if row["kind"] == SEARCHED else str(row["name"])
            sensor_map = SensorMap(called, rows["height"].to_numpy(), rows[name].to_numpy())
            if sensor_map.dn.size and np.isfinite(sensor_map.dn).all():
                (plain if row["kind"] == REFERENCE else others).append(sensor_map)
        level = max(
            ((cfa_map.name, float(cfa_map.dn.min())) for cfa_map in plain), key=lambda cfa_map: cfa_map[1], default=None
        )
        shown = others or plain
        if shown:
            corner, left_out = float(places["cra_deg"].iloc[-1]), max(0, len(shown) - _MOST)
            yield SensorFigure(str(scenario), output.columns[name].words, shown[-_MOST:], level, corner, left_out)


def map_caption(figure: SensorFigure) -> str:
    """Return the caption of a map."""
    text = (
        f"The {figure.words} over the sensor, in {figure.scenario}, before clipping and rounding; the chief ray "
        f"falls in at {figure.corner_deg:g} degrees in the corner. Computed at {figure.maps[0].heights.size} image "
        f"heights, linear in between, drawn on a sensor of {_WIDE}:{_HIGH}. A title names the smallest of these values."
    )
    if figure.left_out:
        text += f" {figure.left_out} more designs are in {SENSOR_MAP}."
    if figure.level is not None:
        text += f" {figure.level[0]} keeps {figure.level[1]:.0f} DN everywhere; where a map has that, a line is white."
    return text


def _draw(figure: SensorFigure) -> Figure:
    """Draw the maps with one color scale."""
    columns = min(_ACROSS, len(figure.maps)) if len(figure.maps) != 4 else 2
    panel_in = _WIDTH_IN / columns
    drawn, panels = panel_grid(len(figure.maps), columns, (panel_in, 0.3 + 0.87 * panel_in * _HIGH / _WIDE), (0, 0.6))
    y, x = (np.linspace(-half, half, n) for half, n in zip((_HIGH, _WIDE), _PIXELS, strict=True))
    radius = np.hypot(x[None], y[:, None]) / np.hypot(_WIDE, _HIGH)
    top = max(float(sensor_map.dn.max()) for sensor_map in figure.maps)
    for axes, sensor_map in zip(panels, figure.maps, strict=True):
        values = np.interp(radius, sensor_map.heights, sensor_map.dn)
        extent = (-_WIDE, _WIDE, -_HIGH, _HIGH)
        image = axes.imshow(values, cmap="cividis", vmin=0.0, vmax=top, extent=extent, interpolation="nearest")
        if figure.level is not None and sensor_map.dn.min() < figure.level[1] < sensor_map.dn.max():
            axes.contour(x, y, values, levels=[figure.level[1]], colors="white", linewidths=1.4)
        axes.set_title(f"{sensor_map.name}: {sensor_map.worst}", fontsize=9)
        axes.set(xticks=[], yticks=[])
    drawn.colorbar(image, ax=panels, shrink=0.85, label=f"{figure.words} / DN")
    drawn.suptitle(f"{figure.words} from the middle of the sensor to its corner, scene {figure.scenario}", fontsize=10)
    return drawn


def map_drawings(output: Output) -> Iterator[tuple[str, str, Drawing]]:
    """Yield the maps."""
    for number, figure in enumerate(sensor_figures(output), 1):
        yield f"places-{number}", map_caption(figure), partial(_draw, figure)
