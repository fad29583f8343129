"""Error against time of accuracy settings: a line for each scene."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .figures import CURVE_CYCLE, panel_grid

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

_LEAST_DN = 1e-6
_PRESETS = {"standard": "o", "reference": "D"}


def draw_accuracy(table: pd.DataFrame, name: str) -> Figure:
    """Draw the largest error, DN, against seconds per design; errors below 1e-6 DN lie there."""
    figure, (axes,) = panel_grid(1, 1, 8.0, 5.2)
    for number, (scenario, rows) in enumerate(table.groupby("scenario", sort=False)):
        color, error_dn = CURVE_CYCLE[number % len(CURVE_CYCLE)], rows["error_dn"].clip(lower=_LEAST_DN)
        seconds = rows["following_s"].fillna(rows["first_s"])
        steps = ~rows["setting"].str.startswith("reference")
        line = ".-" if number < len(CURVE_CYCLE) else ".--"
        axes.plot(seconds[steps], error_dn[steps], line, color=color, linewidth=0.8, label=str(scenario))
        for preset, marker in _PRESETS.items():
            at = rows["setting"] == preset
            axes.plot(seconds[at], error_dn[at], marker, color=color, markersize=7, markerfacecolor="none")
    for preset, marker in _PRESETS.items():
        axes.plot([], [], marker, color="black", markerfacecolor="none", label=preset)
    axes.set(xscale="log", yscale="log", xlabel="seconds per design", ylabel="largest error / DN")
    steps_nm = sorted(table["step_nm"].unique(), reverse=True)
    axes.legend(fontsize=8, ncols=2)
    figure.suptitle(
        f"{name}: what accuracy costs in time; dots: wavelengths every {', '.join(f'{s:g}' for s in steps_nm)} nm",
        fontsize=10,
    )
    return figure
