"""Figures of signals and pixels: the color chart, and CFA tiles; which lights limit a design."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ..base.types import Array, Float
from ..camera.mosaic import Mosaic
from ..metrics.limiting import BETWEEN, limited_by_name
from ..results.output import Output
from ..spectra.color import display_colors
from .figures import CURVE_COLORS, empty_figure
from .values import modifications

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Nearest = tuple[tuple[str, str], tuple[str, str], str]
"""(type, name) of two lights, and their distance in words."""
_CLEAR = "#eeeeee"
_MOST_TILES, _WIDE = 24, 8


def signals_of(
    output: Output, design_id: object
) -> tuple[list[str], list[tuple[str, str]], Float[Array, "channels signals"]]:
    """Return channels, (type, name) of the signals, and their digital numbers with a design."""
    points = output.points[output.points["design_id"] == design_id]
    channels = list(dict.fromkeys(points["channel"]))
    first = points.iloc[:: max(1, len(channels))]
    dn = points["dn"].to_numpy(dtype=float).reshape(-1, max(1, len(channels))).T
    return channels, list(zip(first["signal_type"], first["signal"], strict=True)), dn


def nearest_lights(output: Output, row: Mapping[Any, Any]) -> Nearest | None:
    """Return (type, name) of the two lights that limit a row's separation, and their distance in words.

    None if they are unknown.
    """
    separation = output.trade_off[0]
    if separation.pair is None or separation.role != "separation":
        return None
    first_type, second_type = separation.pair
    text = row.get(limited_by_name(separation.pair))
    first_names, second_names = (
        [name for kind, name in output.curves.lights if kind == signal_type] for signal_type in separation.pair
    )
    named = {f"{a}{BETWEEN}{b}": (a, b) for a in first_names for b in second_names}
    if text not in named:
        return None
    a, b = named[str(text)]
    return (first_type, a), (second_type, b), separation.formatted(row[separation.of or separation.name])


def chart_patches(output: Output) -> dict[str, Float[Array, "_ 3"]]:
    """Return the color chart of the signals."""
    grid = output.study.wavelengths
    return {kind: display_colors(grid, photons) for kind, photons in output.curves.bundles.items()}


def draw_chart(patches: Mapping[str, Float[Array, "_ _"]]) -> Figure:
    """Draw the patches, one row per signal type, and gray steps."""
    from matplotlib.patches import Rectangle  # noqa: PLC0415  (slow to import)

    figure = empty_figure(8.0, 0.55 * (len(patches) + 1) + 0.8)
    axes = figure.add_subplot()
    rows = {**patches, "gray reference": np.repeat(np.linspace(1.0, 0.1, 6)[:, None], 3, axis=1)}
    for height, colors in enumerate(rows.values()):
        for place, color in enumerate(colors):
            axes.add_patch(Rectangle((place, -height), 0.9, 0.9, facecolor=tuple(color)))
    axes.set_yticks([0.45 - height for height in range(len(rows))], list(rows))
    most = max(map(len, rows.values()))
    axes.set(xlim=(-0.1, most), ylim=(-len(rows) + 0.9, 1.0), xticks=[], aspect="equal", frame_on=False)
    axes.set_title("Color checker chart: a patch per signal, as near as sRGB comes")
    return figure


def replaced_channels(output: Output) -> dict[str, dict[str, str]]:
    """Return the channels of each CFA that a filter of the study replaces, with their base."""
    replaced: dict[str, dict[str, str]] = {}
    for entry in modifications(output):
        if entry.base is not None:
            replaced.setdefault(entry.cfa, {}).update(dict.fromkeys(entry.channel, str(entry.base)))
    return replaced


def first_mosaics(output: Output) -> dict[str, Mosaic]:
    """Return the tiles of the first CFAs of a study."""
    return {name: output.mosaic(name) for name in list(output.study.cfas)[:_MOST_TILES]}


def draw_tiles(mosaics: Mapping[str, Mosaic], replaced: Mapping[str, Mapping[str, str]]) -> Figure:
    """Draw the tiles side by side; a replaced channel is hatched in its base's color."""
    from matplotlib.patches import Rectangle  # noqa: PLC0415  (slow to import)

    wide = min(_WIDE, len(mosaics))
    rows = -(-len(mosaics) // wide)
    figure = empty_figure(1.5 * wide, 1.8 * rows)
    panels = figure.subplots(rows, wide, squeeze=False).ravel()
    for axes in panels:
        axes.set_axis_off()
    for axes, (name, mosaic) in zip(panels, mosaics.items(), strict=False):
        bases = replaced.get(name, {})
        for (row, column), index in np.ndenumerate(mosaic.indices):
            channel = mosaic.channels[index]
            curve = bases.get(channel, channel)
            color = _CLEAR if curve in ("C", "W") else CURVE_COLORS.get(curve, _CLEAR)
            hatch = "//" if channel in bases else None
            axes.add_patch(
                Rectangle((column, -row), 1, 1, facecolor=color, edgecolor="white", linewidth=2, hatch=hatch)
            )
            if mosaic.indices.size <= 64:
                axes.text(column + 0.5, 0.5 - row, channel, ha="center", va="center", fontsize=11)
        axes.set(xlim=(0, mosaic.indices.shape[1]), ylim=(1 - len(mosaic.indices), 1), aspect="equal")
        axes.set_title(name, fontsize=11)
    return figure
