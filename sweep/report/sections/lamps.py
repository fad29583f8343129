"""Robustness against lamps: worst case beside the nominal one, yield, what breaks a design, and lamps that norms allow."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from ...base.types import Array, Float
from ...metrics.columns.sensitivity import CFA_SENSITIVITY
from ...metrics.quantity import WORST_CASE, Column
from ...metrics.share import format_share
from ...results.output import Output
from ...results.tables import NAMED, REFERENCE, RGGB, SEARCHED
from ...spectra.color import NORM_NAMES
from ..leaders import Row, answering, label, leaders_of, reference_of, upper_bound_beside
from ..look import styles_of
from ..panels import Curves, Map, Panel, Picture
from ..row_panels import Row as Drawn
from ..row_panels import Rows
from ..section import MOST_ROWS, Section, Table
from ..terms import bound_conditions, edges_in_words, edges_of, format_missed_constraints
from ..words import amount, change, digits, joined, lamp, of_column, quantity, quoted
from .trade_off import filter_curves

_MOST_MAPS = 3
_MODELED = "single LEDs, modeled as hyperbolic secants, all pairs counted equally"


@dataclass(frozen=True)
class Judged:
    """A design's worst and nominal separation, its yield with its 95 % interval, and what breaks it, in words."""

    name: str
    worst: float
    nominal: float
    share: tuple[float, float, float] | None
    breaks: str
    missed: str = ""


@dataclass(frozen=True)
class Lamps(Section):
    """Worst cases over lamps and production of every CFA and design."""

    column: Column
    nominal: Column
    designs: tuple[Judged, ...]
    hero: str
    edges: str
    light: tuple[float, float]
    rggb: str
    wanted_dn: float | None
    bound: float | None
    bound_of: str
    filters: Curves | None
    front: tuple[tuple[float, float], ...]

    heading = "In the worst case"
    leads = True

    @classmethod
    def of(cls, output: Output) -> Iterator[Section]:
        """Yield it where the separation is a worst case, and a section for each norm's lamps."""
        column = output.trade_off[0]
        scenario = leaders_of(output).scenario
        rows = output.named_rows[(output.named_rows["scenario"] == scenario) & (output.named_rows["status"] == "ok")]
        best, rggb = answering(output), reference_of(output, scenario)
        if column.extreme == WORST_CASE and column.role == "separation" and best is not None:
            judged = sorted(
                (_judged(output, row, rows.to_dict("records")) for row in rows.to_dict("records")),
                key=lambda one: -one.worst,
            )
            population = output.study.population
            front = () if output.front is None else tuple(
                (float(a), float(b)) for a, b in output.front[["sensitivity_min", "objective"]].dropna().to_numpy()
            )  # fmt: skip
            yield cls(
                column, output.columns[column.of], tuple(judged), label(best), edges_in_words(edges_of(best)),
                (float(best[CFA_SENSITIVITY]), np.nan if rggb is None else float(rggb[CFA_SENSITIVITY])),
                "" if rggb is None else label(rggb), None if population is None else population.wanted_dn,
                upper_bound_beside(output, best), bound_conditions(output),
                filter_curves(output, best, styles_of(one.name for one in judged)[label(best)].color, 200), front,
            )  # fmt: skip
        yield from Allowed.of(output)

    @property
    def answer(self) -> list[str]:
        """What the best one keeps in the worst case, beside others, and what that costs."""
        named = {one.name: one for one in self.designs}
        best, rggb = named.get(self.hero), named.get(self.rggb)
        if best is None:
            return []
        beside = "" if rggb is None else f" ({rggb.name}: {of_column(self.column, rggb.worst)})"
        who = f"{quoted(best.name)} ({self.edges})" if self.edges else quoted(best.name)
        light, its = (amount(share, "share") for share in self.light)
        lines = [
            f"{who} keeps **{of_column(self.column, best.worst)}** in the worst case{beside} and collects **{light}** of the light{'' if rggb is None else f' ({rggb.name}: {its})'}."
        ]
        rivals = [one for one in self.designs if one.name not in (self.hero, self.rggb) and one.nominal > best.nominal]
        if rivals:
            rival = max(rivals, key=lambda one: one.nominal)
            lost = amount(best.nominal, "DN")
            lines.append(
                f"That costs **{amount(1 - best.nominal / rival.nominal, 'share')}** of the nominal separation of {quoted(rival.name)} ({lost} instead of "
                f"{amount(rival.nominal, 'DN')}), which keeps {of_column(self.column, rival.worst)} in the worst case"
                f"{f', but {rival.missed}' if rival.missed else ''}."
            )
        return lines

    @property
    def limits(self) -> list[str]:
        """The upper bound, and when the best one falls below a plain CFA."""
        named = {one.name: one for one in self.designs}
        best = named.get(self.hero)
        lines = []
        if self.bound is not None and best is not None:
            lines.append(
                f"No filter of its kind in this pixel that stays below the curve that it replaces exceeds {self.column.format_bound(self.bound)} in the worst case {self.bound_of} "
                f"(proven, before rounding); {quoted(best.name)} reaches {amount(best.worst / self.bound, 'share')} of that."
            )
        order = sorted((one for one in self.designs if one.breaks), key=lambda one: one.name != self.hero)
        lines += [one.breaks for one in order[:3]]
        if len(self.front) > 1:
            (low, at_low), (high, at_high) = self.front[0], self.front[-1]
            lines.append(
                f"Keeping {amount(low, 'share')} of the pixel's sensitivity, a search ends at {of_column(self.column, at_low)}; at {amount(high, 'share')}, "
                f"at {of_column(self.column, at_high)}."
            )
        return lines

    @property
    def picture(self) -> Picture | None:
        """A dumbbell for each: the worst case filled, the nominal one open."""
        named = {one.name: one for one in self.designs}
        level = None if self.rggb not in named else (named[self.rggb].worst, f"{self.rggb}, worst case")
        least = named[self.rggb].worst if self.rggb in named else 0.0
        rows = tuple(
            Drawn(
                one.name,
                one.worst,
                one.nominal,
                text="" if one.share is None else format_share(one.share[0], 2),
                lost=one.worst < least,
            )
            for one in self.designs
        )
        yields = any(row.text for row in rows)
        right = f"yield, {digits(self.wanted_dn or 0.0)} DN or more" if yields else ""
        panel = Rows(
            "filled: worst case; open: nominal",
            f"{quantity(self.nominal)} / DN",
            rows,
            self.hero,
            level,
            self.bound,
            right=right,
        )
        caption = (
            f"Yield: share of drawn lamps and cameras with {digits(self.wanted_dn or 0.0)} DN or more."
            if yields
            else ""
        )
        panels = (panel,) if self.filters is None else (self.filters, panel)
        return Picture(panels, "Worst and nominal separation of each CFA and design.", caption, columns=1)

    @property
    def table(self) -> Table | None:
        """Worst case, nominal value and yield."""
        rggb = next((one for one in self.designs if one.name == self.rggb), None)
        rows = []
        for one in self.designs[:MOST_ROWS]:
            share = (
                ""
                if one.share is None
                else f"{format_share(one.share[0], 2)} ({format_share(one.share[1], 2)} to {format_share(one.share[2], 2)})"
            )
            against = "" if rggb is None or one is rggb else change(one.worst, rggb.worst)
            rows.append(
                (one.name, of_column(self.column, one.worst), of_column(self.nominal, one.nominal), share, against)
            )
        return Table(
            ("", "worst case", "nominal", "yield, 95 % interval", f"worst case against {self.rggb}"), tuple(rows)
        )


def _judged(output: Output, row: Row, rows: Sequence[Row]) -> Judged:
    column = output.trade_off[0]
    share = tuple(float(row.get(name, np.nan)) for name in ("yield", "yield_low", "yield_high"))
    known = (share[0], share[1], share[2]) if np.isfinite(share).all() else None
    missed = "" if row["kind"] == REFERENCE else format_missed_constraints(output, row)
    return Judged(label(row), float(row[column.name]), float(row[column.of]), known, _breaks(output, row, rows), missed)


def _breaks(output: Output, row: Row, rows: Sequence[Row]) -> str:
    """Return where a design falls below the best plain CFA, by which lights, at which temperature."""
    at = float(row.get("breaks_at", np.nan))
    plain = [other for other in rows if other["kind"] == REFERENCE]
    if output.study.population is None or row["kind"] not in (NAMED, SEARCHED) or not plain:
        return ""
    column, who = output.trade_off[0], quoted(label(row))
    rival = label(max(plain, key=lambda other: float(other[column.name])))
    if not np.isfinite(at):
        return (
            f"{who} stays above the plain CFAs up to 3 times the stated range of lamps and edges."
            if row["kind"] == SEARCHED
            else ""
        )
    if at == 0:
        return f"{who} is below {rival} even with the study's own lamps."
    text = joined(
        [f"{lamp(row[f'breaks_{side}'])} at {row[f'breaks_{side}_nm']:+.1f} nm" for side in ("first", "second")]
    )
    low, high = row["breaks_low_c"], row["breaks_high_c"]
    if np.isfinite(low):
        text += f", junctions at {' to '.join(dict.fromkeys((f'{low:.0f}', f'{high:.0f}')))} °C"
    return f"{who} falls below {rival} at {at:.2f} times the stated range of lamps and production ({text})."


@dataclass(frozen=True)
class OfNorm:
    """Pairs of lamps that a norm allows, with a design: the share that is apart, and the nearest pair."""

    name: str
    share: float
    yellow: str
    red: str
    least_dn: float
    yellow_nm: Float[Array, " yellows"]
    red_nm: Float[Array, " reds"]
    apart_dn: Float[Array, "yellows reds"]
    below: tuple[float, float] | None


@dataclass(frozen=True)
class Allowed(Section):
    """All yellow and red LEDs that a norm allows."""

    norm: str
    pairs: int
    wanted_dn: float
    designs: tuple[OfNorm, ...]
    hero: str

    @classmethod
    def of(cls, output: Output) -> Iterator[Section]:
        """Yield one for each norm."""
        regions, best = output.study.regions, answering(output)
        if output.regions is None or regions is None:
            return
        rows = output.named_rows[output.named_rows["scenario"] == leaders_of(output).scenario]
        names = {row["design_id"]: label(row) for row in rows.to_dict("records")}
        for norm, cells in output.regions.groupby("norm", sort=False):
            designs, pairs = [], 0
            for design, own in cells.groupby("design_id", sort=False):
                if design not in names:
                    continue
                pairs = int(own["pairs"].sum())
                near = own.iloc[int(own["least_dn"].to_numpy().argmin())]
                least = own.pivot_table(index="yellow_nm", columns="red_nm", values="least_dn")
                led = {c: f"{near[f'{c}_nm']:g} nm ({near[f'{c}_fwhm_nm']:g} nm wide)" for c in ("yellow", "red")}
                designs.append(
                    OfNorm(
                        names[design], float(own["separated"].sum()) / pairs, led["yellow"], led["red"], float(near["least_dn"]),
                        least.index.to_numpy(dtype=float), least.columns.to_numpy(dtype=float), least.to_numpy(dtype=float),
                        _below(own, pairs),
                    )
                )  # fmt: skip
            if designs:
                yield cls(
                    NORM_NAMES[str(norm)], pairs, regions.wanted_dn, tuple(designs), "" if best is None else label(best)
                )

    @property
    def title(self) -> str:
        """Of which norm."""
        return f"Lamps that {self.norm} allows"

    @property
    def answer(self) -> list[str]:
        """The share that each design keeps apart."""
        parts = [f"{quoted(one.name)} {format_share(one.share)}" for one in self.designs]
        return [
            f"Of all {self.pairs:,} pairs of a yellow and a red LED that {self.norm} allows, at least {self.wanted_dn:g} DN are kept apart by {', '.join(parts)}."
        ]

    @property
    def short(self) -> str:
        """Its answer, and how often the design that answers is below RGGB."""
        hero = next((one for one in self.designs if one.name == self.hero and one.below is not None), None)
        if hero is None or hero.below is None:
            return self.answer[0]
        csd, chromatic = map(format_share, hero.below)
        return f"{self.answer[0]} Pair by pair {quoted(hero.name)} is below RGGB in {csd}, at any brightness in {chromatic}."

    @property
    def _shown(self) -> list[OfNorm]:
        order = sorted(self.designs, key=lambda one: (one.name != self.hero, one.name != RGGB, -one.share))
        return order[:_MOST_MAPS]

    @property
    def picture(self) -> Picture | None:
        """Maps of a few designs."""
        most = max(float(np.nanmax(one.apart_dn)) for one in self._shown)
        panels: list[Panel] = [
            Map(one.name, "peak of the red LED / nm", "peak of the yellow LED / nm", one.red_nm, one.yellow_nm, one.apart_dn,
                ((self.wanted_dn, f"{self.wanted_dn:g} DN"),), most=most, height=230)
            for one in self._shown
        ]  # fmt: skip
        return Picture(
            tuple(panels),
            f"Least separation of lamps that {self.norm} allows.",
            f"Smallest separation over all widths, dark is more; {_MODELED}.",
        )

    @property
    def table(self) -> Table | None:
        """Share and nearest pair of each design."""
        rows = [
            (one.name, format_share(one.share), one.yellow, one.red, amount(one.least_dn, "DN"))
            for one in self.designs[:MOST_ROWS]
        ]
        return Table(
            ("", f"{self.wanted_dn:g} DN or more", "nearest yellow", "nearest red", "their distance"), tuple(rows)
        )


def _below(cells: pd.DataFrame, pairs: int) -> tuple[float, float] | None:
    """Return the shares of pairs that RGGB keeps farther apart, also at any brightness."""
    if cells["below_rggb"].isna().any():
        return None
    return float(cells["below_rggb"].sum()) / pairs, float(cells["chromatic_below_rggb"].sum()) / pairs
