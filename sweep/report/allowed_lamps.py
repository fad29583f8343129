"""Which lamps that a norm allows a camera can't tell apart: sentences, a table, and a map for each norm."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from ..base.types import FloatArray
from ..curves.regulations import NORM_NAMES
from ..curves.single_leds import RegionMap
from ..metrics.quantity import DN
from ..metrics.share import told_share
from ..results.output import Output
from ..results.tables import PLAIN
from .figures import Drawing, empty_figure
from .leaders import Row, leaders_of
from .names import capital, full_name, label

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_MOST_MAPS, _COLUMNS = 9, 3
_MODELED = "single LEDs, modeled as hyperbolic secants"


@dataclass(frozen=True)
class LampMap:
    """How far a design tells the lamps of a norm apart.

    `share`: of all pairs, with at least the wanted distance; `nearest`: the two LEDs that are nearest to each other.
    `yellow_nm`, `red_nm`: peaks, ndarray[n_yellow] and ndarray[n_red]; `least_dn`: the smallest distance over widths,
    NaN where none is allowed, ndarray[n_yellow, n_red].
    """

    row: Row
    norm: str
    pairs: int
    share: float
    nearest: Mapping[str, float]
    yellow_nm: FloatArray
    red_nm: FloatArray
    least_dn: FloatArray


def lamp_maps(output: Output) -> list[LampMap]:
    """Those of every design and norm, in the scenario of the best design or in the first one; none if not asked for."""
    if output.regions is None:
        return []
    few = output.few[output.few["scenario"] == leaders_of(output).scenario]
    named = {row["design_id"]: row for row in few.to_dict("records")}
    found = []
    for key, cells in output.regions.groupby(["norm", "design_id"], sort=False):
        norm, design = key
        if design in named:
            least = cells.pivot_table(index="yellow_nm", columns="red_nm", values="least_dn")
            pairs = int(cells["pairs"].sum())
            found.append(
                LampMap(
                    named[design],
                    str(norm),
                    pairs,
                    float(cells["separated"].sum()) / pairs,
                    _nearest(cells),
                    least.index.to_numpy(dtype=float),
                    least.columns.to_numpy(dtype=float),
                    least.to_numpy(dtype=float),
                )
            )
    return found


def _nearest(cells: pd.DataFrame) -> dict[str, float]:
    """The two LEDs that are nearest to each other, and their distance."""
    at = int(cells["least_dn"].to_numpy().argmin())
    names = ("yellow_nm", "yellow_fwhm_nm", "red_nm", "red_fwhm_nm", "least_dn")
    return {name: float(cells[name].to_numpy()[at]) for name in names}


def lamp_lines(output: Output) -> Iterator[str]:
    """For each norm what the best design tells apart, else the one that tells most apart, beside the best plain CFA."""
    maps, best = lamp_maps(output), leaders_of(output).chosen
    for norm in dict.fromkeys(each.norm for each in maps):
        own = [each for each in maps if each.norm == norm]
        chosen = [each for each in own if best is not None and each.row["design_id"] == best["design_id"]]
        shown = chosen[0] if chosen else max(own, key=lambda each: each.share)
        plain = [each for each in own if each.row["kind"] == PLAIN and each is not shown]
        beside = max(plain, key=lambda each: each.share, default=None)
        rival = "" if beside is None else f", {full_name(beside.row)} {told_share(beside.share)}"
        asked, near = _asked(output), shown.nearest
        yield (
            f"Of all {shown.pairs:,} pairs of a yellow and a red LED that {NORM_NAMES[norm]} allows, "
            f"{full_name(shown.row)} keeps {told_share(shown.share)} at least {asked.wanted_dn:g} {DN} "
            f"apart{rival}; its nearest are {_led(near, 'yellow')} and {_led(near, 'red')}, {_dn(near['least_dn'])}."
        )
    if maps:
        yield f"{capital(_grid(_asked(output)))}."


def _dn(value: float) -> str:
    return f"{value:.0f} {DN}" if value >= 10 else f"{value:.1f} {DN}"


def _led(near: Mapping[str, float], kind: str) -> str:
    return f"{near[f'{kind}_nm']:g} nm ({near[f'{kind}_fwhm_nm']:g} nm wide)"


def _asked(output: Output) -> RegionMap:
    asked = output.study.regions
    assert asked is not None
    return asked


def _grid(asked: RegionMap) -> str:
    """What a share is of."""
    peaks, widths = (f"{low:g} to {high:g} nm" for low, high in (asked.peak_nm, asked.fwhm_nm))
    return (
        f"these are {_MODELED}, with peaks every {asked.peak_step_nm:g} nm ({peaks}) and widths at half height every "
        f"{asked.fwhm_step_nm:g} nm ({widths}), and all pairs count equally"
    )


def lamp_table(output: Output) -> pd.DataFrame:
    """A row per norm and design; empty where none are asked for."""
    return pd.DataFrame(
        [
            {
                "norm": NORM_NAMES[each.norm],
                "design": label(each.row),
                "pairs": f"{each.pairs:,}",
                "told apart": told_share(each.share),
                "nearest yellow": _led(each.nearest, "yellow"),
                "nearest red": _led(each.nearest, "red"),
                "their distance": _dn(each.nearest["least_dn"]),
            }
            for each in lamp_maps(output)
        ]
    )


def lamp_drawings(output: Output) -> Iterator[tuple[str, str, Drawing]]:
    """(file name, caption, drawing) of the map of each norm."""
    maps = lamp_maps(output)
    for number, norm in enumerate(dict.fromkeys(each.norm for each in maps), 1):
        own = [each for each in maps if each.norm == norm]
        shown = own[-_MOST_MAPS:]
        caption = f"{NORM_NAMES[norm]}: the smallest CSD over all widths of a yellow and a red LED, {_MODELED}"
        if len(own) > len(shown):
            caption += f"; the last {len(shown)} of {len(own)} designs"
        yield f"regions-{number}", caption, partial(_draw, shown, caption, _asked(output).wanted_dn)


def _draw(maps: list[LampMap], title: str, wanted_dn: float) -> Figure:
    """A panel per design; a line where the wanted distance is reached, a cross at the nearest pair."""
    columns = min(_COLUMNS, len(maps))
    rows = -(-len(maps) // columns)
    figure = empty_figure(3.4 * columns + 1.0, 2.6 * rows + 0.6)
    most = max(float(np.nanmax(each.least_dn)) for each in maps)
    panels = []
    for number, each in enumerate(maps):
        axes = figure.add_subplot(rows, columns, number + 1)
        drawn = axes.pcolormesh(
            each.red_nm, each.yellow_nm, each.least_dn, shading="nearest", cmap="viridis", vmin=0.0, vmax=most
        )
        if min(each.least_dn.shape) > 1 and np.nanmin(each.least_dn) < wanted_dn <= np.nanmax(each.least_dn):
            axes.contour(each.red_nm, each.yellow_nm, each.least_dn, levels=[wanted_dn], colors="white", linewidths=1.4)
        axes.plot(each.nearest["red_nm"], each.nearest["yellow_nm"], "x", color="#d55e00", markersize=8, clip_on=False)
        axes.set_title(
            f"{label(each.row)}: {told_share(each.share)}, nearest {_dn(each.nearest['least_dn'])}", fontsize=9
        )
        panels.append(axes)
    figure.supxlabel("peak of the red LED / nm", fontsize=9)
    figure.supylabel("peak of the yellow LED / nm", fontsize=9)
    bar = figure.colorbar(drawn, ax=panels, label=f"smallest CSD / {DN}")
    bar.ax.axhline(wanted_dn, color="white", linewidth=1.4)
    told = f"{title}\nwhite: {wanted_dn:g} {DN}; percent: pairs with at least that; cross: the nearest pair"
    figure.suptitle(told, fontsize=9)
    return figure
