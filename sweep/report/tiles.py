"""The tiles of the CFAs of a study: which color each pixel has."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ..camera.mosaic import Mosaic
from ..results.output import Output
from .figures import CURVE_COLORS, empty_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_CLEAR = "#eeeeee"
_MOST_TILES, _WIDE = 24, 8


@dataclass(frozen=True)
class TilesFigure:
    """CFA -> its tile; `modified`: channels that a filter replaces, by CFA, which are hatched in their base's color."""

    mosaics: Mapping[str, Mosaic]
    modified: Mapping[str, Mapping[str, str]]


def tiles_figure(output: Output) -> TilesFigure:
    """The tiles of the first CFAs of a study."""
    names = list(output.study.cfas)[:_MOST_TILES]
    study = output.study
    modified: dict[str, dict[str, str]] = {}
    for entry in (*study.designs.values(), *study.sweeps.values(), *study.boxes.values()):
        if entry.base is not None:
            modified.setdefault(entry.cfa, {}).update(dict.fromkeys(entry.channel, entry.base))
    return TilesFigure({name: output.mosaic(name) for name in names}, modified)


def draw_tiles(tiles: TilesFigure) -> Figure:
    """Draw the tiles side by side, the channel's name in each pixel."""
    from matplotlib.patches import Rectangle  # noqa: PLC0415  (slow to import)

    wide = min(_WIDE, len(tiles.mosaics))
    rows = -(-len(tiles.mosaics) // wide)
    figure = empty_figure(1.5 * wide, 1.8 * rows)
    panels = figure.subplots(rows, wide, squeeze=False).ravel()
    for axes in panels:
        axes.set_axis_off()
    for axes, (name, mosaic) in zip(panels, tiles.mosaics.items(), strict=False):
        replaced = tiles.modified.get(name, {})
        for row, line in enumerate(mosaic.indices):
            for column, index in enumerate(line):
                channel = mosaic.channels[index]
                color = CURVE_COLORS.get(replaced.get(channel, channel), _CLEAR)
                hatch = "//" if channel in replaced else None
                color = _CLEAR if replaced.get(channel, channel) in ("C", "W") else color
                pixel = Rectangle((column, -row), 1, 1, facecolor=color, edgecolor="white", linewidth=2, hatch=hatch)
                axes.add_patch(pixel)
                if mosaic.indices.size <= 64:
                    axes.text(column + 0.5, 0.5 - row, channel, ha="center", va="center", fontsize=11)
        axes.set(xlim=(0, mosaic.indices.shape[1]), ylim=(1 - len(mosaic.indices), 1), aspect="equal")
        axes.set_title(name, fontsize=11)
    return figure
