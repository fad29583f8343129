"""Error against time of accuracy settings, one panel per scene."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from .figures import CURVE_CYCLE, decorate, legend_beside, panel_grid

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PRESET = "preset"
_LEAST_DN = 1e-6
_COLUMNS = 4
_STAR: dict[str, Any] = {
    "color": "black",
    "marker": "*",
    "linestyle": "",
    "markersize": 11,
    "markerfacecolor": "none",
    "markeredgewidth": 1.1,
}
_COLORS = (*CURVE_CYCLE, "#8c6d31")
_MARKERS = "osv^D<P>"
_TOGETHER = (0.8, 0.7)
"""Decades of time and of error within which presets share a label."""


def draw_accuracy(table: pd.DataFrame, name: str) -> Figure:
    """Draw the error of presets and single settings against the time of the study's designs.

    Presets are stars with their names; the values of a single setting are joined by a line.

    Parameters
    ----------
    table : pandas.DataFrame
        Columns scenario, setting, value, designs, error_dn (DN), total_s (s); errors below 1e-6 DN are
        drawn there.
    name : str
        Name of the study.

    Returns
    -------
    matplotlib.figure.Figure
        Figure.
    """
    counts = sorted(table["designs"].unique())
    designs = counts[min(1, len(counts) - 1)]
    drawn = table[table["designs"] == designs]
    scenes = list(drawn.groupby("scenario", sort=False))
    columns = min(_COLUMNS, len(scenes))
    figure, panels = panel_grid(len(scenes), columns, (3.4, 3.1), (1.4, 0.6))
    settings = [setting for setting in drawn["setting"].unique() if setting != PRESET]
    for at, (axes, (scenario, rows)) in enumerate(zip(panels, scenes, strict=True)):
        decorate(axes)
        for number, setting in enumerate(settings):
            values = rows[rows["setting"] == setting]
            axes.plot(values["total_s"], values["error_dn"].clip(lower=_LEAST_DN), alpha=0.85, **_style(number))
        _mark_presets(axes, rows[rows["setting"] == PRESET])
        axes.set(xscale="log", yscale="log")
        axes.set_ylim(_LEAST_DN / 3, max(10.0, 30 * drawn["error_dn"].max()))
        axes.set_xlim(drawn["total_s"].min() / 2, drawn["total_s"].max() * 2)  # the same in all panels
        axes.set_title(str(scenario), fontsize=9)
        if at >= len(scenes) - columns:
            axes.set_xlabel("one design / s" if designs == 1 else f"{designs:,} designs / s", fontsize=8)
        if at % columns == 0:
            axes.set_ylabel("error of a CSD / DN", fontsize=8)
        axes.tick_params(labelsize=7)
    corner = panels[columns - 1]
    corner.plot([], [], label="preset", **_STAR)
    for number, setting in enumerate(settings):
        corner.plot([], [], label=setting, **_style(number))
    legend_beside(corner)
    figure.suptitle(
        f"{name}: what accuracy costs in time (errors below {_LEAST_DN:g} DN lie at the bottom)", fontsize=11
    )
    return figure


def _style(number: int) -> dict[str, Any]:
    """Return line and marker of a single setting."""
    color, marker = _COLORS[number % len(_COLORS)], _MARKERS[number % len(_MARKERS)]
    return {"color": color, "marker": marker, "linestyle": "-", "linewidth": 0.8, "markersize": 4.5}


def _mark_presets(axes: Axes, presets: pd.DataFrame) -> None:
    """Draw presets as stars with their names; those that coincide share a label."""
    labels: list[tuple[float, float, list[str]]] = []
    for row in presets.to_dict("records"):
        seconds, error_dn = row["total_s"], max(row["error_dn"], _LEAST_DN)
        axes.plot(seconds, error_dn, zorder=5, **_STAR)
        for other_s, other_dn, names in labels:
            apart = abs(math.log10(seconds / other_s)), abs(math.log10(error_dn / other_dn))
            if apart[0] < _TOGETHER[0] and apart[1] < _TOGETHER[1]:
                names.append(row["value"])
                break
        else:
            labels.append((seconds, error_dn, [row["value"]]))
    for seconds, error_dn, names in labels:
        axes.annotate(
            "\n".join(names),
            (seconds, error_dn),
            xytext=(0, 8),
            textcoords="offset points",
            fontsize=7.5,
            fontweight="bold",
            ha="center",
            va="bottom",
            linespacing=1.0,
            bbox={"facecolor": "white", "alpha": 0.7, "edgecolor": "none", "pad": 0.5},
        )
