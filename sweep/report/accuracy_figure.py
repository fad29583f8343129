"""Error against time of accuracy presets, one panel per scene."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .figures import CURVE_CYCLE, panel_grid

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

_LEAST_DN = 1e-6
_COLUMNS = 4


def draw_accuracy(table: pd.DataFrame, name: str) -> Figure:
    """Draw the error of presets, DN, against the time of the measured designs; errors below 1e-6 DN lie there."""
    scenes = list(table.groupby("scenario", sort=False))
    columns, designs = min(_COLUMNS, len(scenes)), int(table["designs"].iloc[0])
    width_in, height_in = 3.4 * columns + 0.4, 3.1 * -(-len(scenes) // columns) + 0.6
    figure, panels = panel_grid(len(scenes), columns, width_in, height_in)
    for at, (axes, (scenario, presets)) in enumerate(zip(panels, scenes, strict=True)):
        error_dn = presets["error_dn"].clip(lower=_LEAST_DN)
        axes.plot(presets["total_s"], error_dn, "o-", color=CURVE_CYCLE[0], linewidth=0.8, markersize=5)
        places: dict[tuple[float, float], list[str]] = {}
        for preset, seconds, dn in zip(presets["preset"], presets["total_s"], error_dn, strict=True):
            places.setdefault((seconds, dn), []).append(preset)
        for number, (place, names) in enumerate(places.items()):
            axes.annotate(
                ", ".join(names),
                place,
                xytext=(0, 7 + 10 * (number % 2)),
                textcoords="offset points",
                fontsize=8,
                ha="center",
            )
        axes.set(xscale="log", yscale="log", title=str(scenario))
        axes.set_ylim(_LEAST_DN / 3, max(10.0, 30 * table["error_dn"].max()))
        axes.set_xlim(table["total_s"].min() / 3, table["total_s"].max() * 3)  # the same in all panels
        if at >= len(scenes) - columns:
            axes.set_xlabel("one design / s" if designs == 1 else f"{designs:,} designs / s", fontsize=8)
        if at % columns == 0:
            axes.set_ylabel("error of a CSD / DN", fontsize=8)
        axes.tick_params(labelsize=7)
    figure.suptitle(
        f"{name}: what accuracy costs in time (errors below {_LEAST_DN:g} DN lie at the bottom)", fontsize=11
    )
    return figure
