"""Lamps that a norm allows and a camera can't tell apart: sentences, a table, and a map for each norm."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from ..curves.regulations import NORM_NAMES
from ..metrics.quantity import DN
from ..metrics.share import told_share
from ..results.output import Output
from ..results.tables import PLAIN
from .figures import Drawing, panel_grid
from .leaders import Row, leaders_of
from .names import full_name, label

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_MOST_MAPS, _COLUMNS = 9, 3
_OF_NEAREST = ("yellow_nm", "yellow_fwhm_nm", "red_nm", "red_fwhm_nm", "least_dn")
_MODELED = "single LEDs, modeled as hyperbolic secants"


@dataclass(frozen=True)
class LampMap:
    """Distances of the lamps of a norm with a design.

    `share`: of all pairs, with at least the wanted distance; `nearest`: the two LEDs that are nearest to each other.
    `least_dn`: the smallest distance over widths, a row per yellow and a column per red peak, nm; NaN where none is
    allowed.
    """

    row: Row
    norm: str
    pairs: int
    share: float
    nearest: Mapping[str, float]
    least_dn: pd.DataFrame

    @property
    def distance(self) -> str:
        """The distance of the nearest two."""
        value = self.nearest["least_dn"]
        return f"{value:.{0 if value >= 10 else 1}f} {DN}"

    def led(self, color: str) -> str:
        """One of the nearest two."""
        return f"{self.nearest[f'{color}_nm']:g} nm ({self.nearest[f'{color}_fwhm_nm']:g} nm wide)"


def lamp_maps(output: Output) -> dict[str, list[LampMap]]:
    """Norm -> maps of every design, in the scenario of the best design or in the first one; empty if not asked for."""
    if output.regions is None:
        return {}
    few = output.few[output.few["scenario"] == leaders_of(output).scenario]
    designs = {row["design_id"]: row for row in few.to_dict("records")}
    maps: dict[str, list[LampMap]] = {}
    for (norm, design), cells in output.regions.groupby(["norm", "design_id"], sort=False):
        if design in designs:
            name, pairs = NORM_NAMES[str(norm)], int(cells["pairs"].sum())
            at = int(cells["least_dn"].to_numpy().argmin())
            nearest = {column: float(cells[column].iloc[at]) for column in _OF_NEAREST}
            least = cells.pivot_table(index="yellow_nm", columns="red_nm", values="least_dn")
            share = float(cells["separated"].sum()) / pairs
            maps.setdefault(name, []).append(LampMap(designs[design], name, pairs, share, nearest, least))
    return maps


def lamp_lines(output: Output) -> Iterator[str]:
    """For each norm the share of the best design, else the largest one, beside that of the best plain CFA."""
    best, asked = leaders_of(output).chosen, output.study.regions
    maps = lamp_maps(output)
    if not maps or asked is None:
        return
    for norm, designs in maps.items():
        chosen = [one for one in designs if best is not None and one.row["design_id"] == best["design_id"]]
        shown = chosen[0] if chosen else max(designs, key=lambda one: one.share)
        plain = [one for one in designs if one.row["kind"] == PLAIN and one is not shown]
        beside = max(plain, key=lambda one: one.share, default=None)
        rival = "" if beside is None else f", {full_name(beside.row)} {told_share(beside.share)}"
        yield (
            f"Of all {shown.pairs:,} pairs of a yellow and a red LED that {norm} allows, "
            f"{full_name(shown.row)} keeps {told_share(shown.share)} at least {asked.wanted_dn:g} {DN} "
            f"apart{rival}; its nearest are {shown.led('yellow')} and {shown.led('red')}, {shown.distance}."
        )
    peaks, widths = (f"{low:g} to {high:g} nm" for low, high in (asked.peak_nm, asked.fwhm_nm))
    yield (
        f"These are {_MODELED}, with peaks every {asked.peak_step_nm:g} nm ({peaks}) and widths at half height every "
        f"{asked.fwhm_step_nm:g} nm ({widths}), and all pairs count equally."
    )


def lamp_table(output: Output) -> pd.DataFrame:
    """A row per norm and design; empty where none are asked for."""
    rows = [
        {
            "norm": norm,
            "design": label(one.row),
            "pairs": f"{one.pairs:,}",
            "told apart": told_share(one.share),
            "nearest yellow": one.led("yellow"),
            "nearest red": one.led("red"),
            "their distance": one.distance,
        }
        for norm, designs in lamp_maps(output).items()
        for one in designs
    ]
    return pd.DataFrame(rows)


def lamp_drawings(output: Output) -> Iterator[tuple[str, str, Drawing]]:
    """(file name, caption, drawing) of the map of each norm."""
    asked = output.study.regions
    for number, (norm, designs) in enumerate(lamp_maps(output).items(), 1):
        assert asked is not None
        caption = f"{norm}: the smallest CSD over all widths of a yellow and a red LED, {_MODELED}"
        if len(designs) > _MOST_MAPS:
            caption += f"; the last {_MOST_MAPS} of {len(designs)} designs"
        yield f"regions-{number}", caption, partial(_draw, designs[-_MOST_MAPS:], caption, asked.wanted_dn)


def _draw(maps: Sequence[LampMap], title: str, wanted_dn: float) -> Figure:
    """A panel per design; a line where the wanted distance is reached, a cross at the nearest pair."""
    figure, panels = panel_grid(len(maps), _COLUMNS, (3.4, 2.6), (1.0, 0.6))
    most = max(float(np.nanmax(one.least_dn)) for one in maps)
    for axes, one in zip(panels, maps, strict=True):
        red, yellow, dn = one.least_dn.columns, one.least_dn.index, one.least_dn.to_numpy()
        drawn = axes.pcolormesh(red, yellow, dn, shading="nearest", cmap="viridis", vmin=0.0, vmax=most)
        if min(dn.shape) > 1 and np.nanmin(dn) < wanted_dn <= np.nanmax(dn):
            axes.contour(red, yellow, dn, levels=[wanted_dn], colors="white", linewidths=1.4)
        axes.plot(one.nearest["red_nm"], one.nearest["yellow_nm"], "x", color="#d55e00", markersize=8, clip_on=False)
        axes.set_title(f"{label(one.row)}: {told_share(one.share)}, nearest {one.distance}", fontsize=9)
    figure.supxlabel("peak of the red LED / nm", fontsize=9)
    figure.supylabel("peak of the yellow LED / nm", fontsize=9)
    bar = figure.colorbar(drawn, ax=panels, label=f"smallest CSD / {DN}")
    bar.ax.axhline(wanted_dn, color="white", linewidth=1.4)
    marks = f"white: {wanted_dn:g} {DN}; percent: pairs with at least that; cross: the nearest pair"
    figure.suptitle(f"{title}\n{marks}", fontsize=9)
    return figure
