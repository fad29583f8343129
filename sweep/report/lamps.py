"""Robustness against lamps: cost of a worst case, changes that break a design, yield, and lamps that norms allow."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from ..metrics.quantity import DN, WORST, WORST_CASE
from ..metrics.share import format_share
from ..results.output import Output
from ..results.tables import NAMED, REFERENCE, SEARCHED
from ..spectra.color import NORM_NAMES
from .figures import Drawing, panel_grid
from .leaders import Row, capital, full_name, label, leaders_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_MOST_MAPS, _COLUMNS = 9, 3
_OF_NEAREST = ("yellow_nm", "yellow_fwhm_nm", "red_nm", "red_fwhm_nm", "least_dn")
_MODELED = "single LEDs, modeled as hyperbolic secants"


def over_population(output: Output) -> bool:
    """Return whether the separation of the trade-off is a worst case over a population of lights."""
    separation = output.trade_off[0]
    return output.study.population is not None and separation.extreme == WORST_CASE and separation.pair is not None


def robustness_lines(output: Output, best: Row | None) -> Iterator[str]:
    """Yield causes of failure, and yields; nothing without a population of lights."""
    if output.study.population is None:
        return
    scenario = output.scenarios[0] if best is None else best["scenario"]
    rows: list[Row] = list(output.named_rows[output.named_rows["scenario"] == scenario].to_dict("records"))
    plain = [row for row in rows if row["kind"] == REFERENCE]
    for row in rows:
        if row["kind"] in (NAMED, SEARCHED) and np.isfinite(row.get("breaks_at", np.nan)):
            yield _breaks(output, row, plain)
        elif row["kind"] == SEARCHED and plain:
            who = capital(full_name(row))
            yield f"{who} stays above the plain CFAs up to 3 times the stated range of lamps and edges."
    shares = []
    for row in rows:
        if np.isfinite(row.get("yield", np.nan)):
            share, low, high = (format_share(row[name], 2) for name in ("yield", "yield_low", "yield_high"))
            name = "the search's answer" if row["kind"] == SEARCHED else row["name"]
            shares.append(f"{name} {share} ({low} to {high})")
    if shares:
        wanted_dn = output.trade_off[0].formatted(output.study.population.wanted_dn or 0.0)
        yield f"Share of random lamps and cameras with {wanted_dn} or more (95 % interval): {', '.join(shares)}."


def cost_of_worst_case(output: Output, best: Row | None) -> Iterator[str]:
    """Yield the best design of a worst case beside the named design with the largest nominal separation.

    It is a sentence, if the separation is a worst case over a population of lights.
    """
    if best is None or not over_population(output):
        return
    named = output.kind(NAMED)
    named = named[named["scenario"] == best["scenario"]].to_dict("records")
    worst = output.trade_off[0]
    nominal = output.columns[worst.of]
    rivals = [row for row in named if row[nominal.name] > best[nominal.name] and row[worst.name] > 0]
    if rivals:
        rival = max(rivals, key=lambda row: float(row[nominal.name]))
        lost, gained = 1 - best[nominal.name] / rival[nominal.name], best[worst.name] / rival[worst.name]
        yield (
            f"Its worst case costs {lost:.1%} of the nominal separation ({nominal.formatted(best[nominal.name])}, "
            f"{rival['name']} {nominal.formatted(rival[nominal.name])}) and has {gained:.2f} times the worst case of "
            f"{rival['name']} ({worst.formatted(rival[worst.name])})."
        )


def _breaks(output: Output, row: Row, plain: list[Row]) -> str:
    """Return where a design falls below the best plain CFA, by which lights, at which temperature."""
    separation, who = output.trade_off[0], capital(full_name(row))
    worst = WORST + (separation.of or separation.name)
    rival = max(plain, key=lambda other: float(other[worst]))
    if row["breaks_at"] == 0:
        return f"{who} is below {rival['name']} with the study's own lights."
    text = " and ".join(f"{row[f'breaks_{side}']} ({row[f'breaks_{side}_nm']:+.1f} nm)" for side in ("first", "second"))
    low, high = row["breaks_low_c"], row["breaks_high_c"]
    if np.isfinite(low):
        text += f", junctions at {' to '.join(dict.fromkeys((f'{low:.0f}', f'{high:.0f}')))} degrees"
    if row["breaks_edge_nm"]:
        text += f", edges {row['breaks_edge_nm']:+.1f} nm"
    if row["breaks_thickness"]:
        text += f", films {row['breaks_thickness']:+.2%}"
    if row["breaks_broadening"]:
        text += f", bands {row['breaks_broadening']:.0%} broader"
    return (
        f"{who} falls below {rival['name']} at {row['breaks_at']:.2f} times the stated range of lamps and "
        f"production: {text}, {separation.formatted(row['breaks_dn'])}."
    )


@dataclass(frozen=True)
class LampMap:
    """Distances of the lamps of a norm with a design.

    `share`: share of pairs with at least the wanted CSD; `least_dn`: smallest CSD over widths, a row per yellow and a
    column per red peak, nm; NaN where none is allowed.
    """

    row: Row
    pairs: int
    share: float
    nearest: Mapping[str, float]
    least_dn: pd.DataFrame

    @property
    def distance(self) -> str:
        """CSD of the nearest two with its unit."""
        value = self.nearest["least_dn"]
        return f"{value:.{0 if value >= 10 else 1}f} {DN}"

    def led(self, color: str) -> str:
        """Describe one of the nearest two."""
        return f"{self.nearest[f'{color}_nm']:g} nm ({self.nearest[f'{color}_fwhm_nm']:g} nm wide)"


def lamp_maps(output: Output) -> dict[str, list[LampMap]]:
    """Return the maps of every design, in the scenario of the best design or in the first one."""
    if output.regions is None:
        return {}
    rows = output.named_rows[output.named_rows["scenario"] == leaders_of(output).scenario]
    designs = {row["design_id"]: row for row in rows.to_dict("records")}
    maps: dict[str, list[LampMap]] = {}
    for (norm, design), cells in output.regions.groupby(["norm", "design_id"], sort=False):
        if design in designs:
            pairs = int(cells["pairs"].sum())
            at = int(cells["least_dn"].to_numpy().argmin())
            nearest = {column: float(cells[column].iloc[at]) for column in _OF_NEAREST}
            least = cells.pivot_table(index="yellow_nm", columns="red_nm", values="least_dn")
            share = float(cells["separated"].sum()) / pairs
            maps.setdefault(NORM_NAMES[str(norm)], []).append(LampMap(designs[design], pairs, share, nearest, least))
    return maps


def lamp_lines(output: Output) -> Iterator[str]:
    """Yield for each norm the share of the best design, else the largest one, beside that of the best plain CFA."""
    best, regions = leaders_of(output).chosen, output.study.regions
    maps = lamp_maps(output)
    if not maps or regions is None:
        return
    for norm, designs in maps.items():
        chosen = [
            lamp_map for lamp_map in designs if best is not None and lamp_map.row["design_id"] == best["design_id"]
        ]
        shown = chosen[0] if chosen else max(designs, key=lambda lamp_map: lamp_map.share)
        plain = [lamp_map for lamp_map in designs if lamp_map.row["kind"] == REFERENCE and lamp_map is not shown]
        beside = max(plain, key=lambda lamp_map: lamp_map.share, default=None)
        rival = "" if beside is None else f", {full_name(beside.row)} {format_share(beside.share)}"
        yield (
            f"Of all {shown.pairs:,} pairs of a yellow and a red LED that {norm} allows, "
            f"{full_name(shown.row)} keeps {format_share(shown.share)} at least {regions.wanted_dn:g} {DN} "
            f"apart{rival}; its nearest are {shown.led('yellow')} and {shown.led('red')}, {shown.distance}."
        )
    peaks, widths = (f"{low:g} to {high:g} nm" for low, high in (regions.peak_nm, regions.fwhm_nm))
    yield (
        f"These are {_MODELED}, with peaks every {regions.peak_step_nm:g} nm ({peaks}) and widths at half height every "
        f"{regions.fwhm_step_nm:g} nm ({widths}), and all pairs count equally."
    )


def lamp_table(output: Output) -> pd.DataFrame:
    """Return one row per norm and design; empty if none are requested."""
    rows = [
        {
            "norm": norm,
            "design": label(lamp_map.row),
            "pairs": f"{lamp_map.pairs:,}",
            "separated": format_share(lamp_map.share),
            "nearest yellow": lamp_map.led("yellow"),
            "nearest red": lamp_map.led("red"),
            "their distance": lamp_map.distance,
        }
        for norm, designs in lamp_maps(output).items()
        for lamp_map in designs
    ]
    return pd.DataFrame(rows)


def lamp_drawings(output: Output) -> Iterator[tuple[str, str, Drawing]]:
    """Yield the map of each norm."""
    regions = output.study.regions
    for number, (norm, designs) in enumerate(lamp_maps(output).items(), 1):
        assert regions is not None
        caption = f"{norm}: the smallest CSD over all widths of a yellow and a red LED, {_MODELED}"
        if len(designs) > _MOST_MAPS:
            caption += f"; the last {_MOST_MAPS} of {len(designs)} designs"
        yield f"regions-{number}", caption, partial(_draw, designs[-_MOST_MAPS:], caption, regions.wanted_dn)


def _draw(maps: Sequence[LampMap], title: str, wanted_dn: float) -> Figure:
    """Draw one panel per design; a line at the wanted CSD, a cross at the nearest pair."""
    figure, panels = panel_grid(len(maps), _COLUMNS, (3.4, 2.6), (1.0, 0.6))
    most = max(float(np.nanmax(lamp_map.least_dn)) for lamp_map in maps)
    for axes, lamp_map in zip(panels, maps, strict=True):
        red, yellow, dn = lamp_map.least_dn.columns, lamp_map.least_dn.index, lamp_map.least_dn.to_numpy()
        drawn = axes.pcolormesh(red, yellow, dn, shading="nearest", cmap="viridis", vmin=0.0, vmax=most)
        if min(dn.shape) > 1 and np.nanmin(dn) < wanted_dn <= np.nanmax(dn):
            axes.contour(red, yellow, dn, levels=[wanted_dn], colors="white", linewidths=1.4)
        axes.plot(
            lamp_map.nearest["red_nm"], lamp_map.nearest["yellow_nm"], "x", color="#d55e00", markersize=8, clip_on=False
        )
        axes.set_title(
            f"{label(lamp_map.row)}: {format_share(lamp_map.share)}, nearest {lamp_map.distance}", fontsize=9
        )
    figure.supxlabel("peak of the red LED / nm", fontsize=9)
    figure.supylabel("peak of the yellow LED / nm", fontsize=9)
    bar = figure.colorbar(drawn, ax=panels, label=f"smallest CSD / {DN}")
    bar.ax.axhline(wanted_dn, color="white", linewidth=1.4)
    marks = f"white: {wanted_dn:g} {DN}; percent: pairs with at least that; cross: the nearest pair"
    figure.suptitle(f"{title}\n{marks}", fontsize=9)
    return figure
