"""The best design: its curve over the lamps, and what it buys in separation and costs in light."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ...base.types import Array, Float
from ...metrics.columns.chromatic import CHROMATIC_CSD
from ...metrics.columns.color_separation import CSD
from ...metrics.columns.confusion import CNR, D_PRIME
from ...metrics.columns.pixel_separation import CHROMATIC_PIXEL_CSD, PIXEL_CSD
from ...metrics.columns.sensitivity import CFA_SENSITIVITY, SENSITIVITY
from ...metrics.columns.tasks import PREFIX
from ...metrics.limiting import limited_by_name
from ...metrics.quantity import OF_A_SHARE, WORST_CASE, Column
from ...results.output import Output
from ...results.tables import NAMED, REFERENCE, SEARCHED, SWEPT
from ...spectra.lights import pair_name
from ..leaders import (
    Row,
    bounds_figure,
    label,
    leaders_of,
    modifications,
    own_tile,
    reference_of,
    upper_bound_beside,
)
from ..look import CHANNELS, DIM, styles_of
from ..panels import Curves, Panel, Picture
from ..point_panels import Pairs, Point, Scatter
from ..section import Section
from ..series import scene_in_words
from ..terms import (
    bound_conditions,
    colorants_of,
    edges_in_words,
    edges_of,
    format_bounded,
    format_missed_constraints,
    is_angle_dependent,
    response_of,
)
from ..words import against_in_words, amount, article, joined, lamps, of_column, quantity, quoted
from .deeper_reds import DeeperReds

Values = Float[Array, " wavelengths"]
_MOST_CLOUD, _MOST_LESS = 400, 5


@dataclass(frozen=True)
class Side:
    """A design's separation and light, as shares of a clear sensor's."""

    name: str
    separation: float
    light: float


@dataclass(frozen=True)
class TradeOff(Section):
    """The best design beside RGGB, and what limits it.

    `found`: how it was found, for a sentence; `edges`: of stopbands, nm; `notes`: colorants and the like; `over`: what
    its separation is the worst of; `where`: scene, if there are several; `tile`: the plain CFA of its own tile; `kept`: constrained figures beside the lamps; `bound`: of any filter in its pixel, `below`:
    the curve that it replaces, and the constraints that the bound leaves out; `own`: an objective that is to be the least, in its own unit; `lost`: the light that filters take from their pixels, the best one's first, where least loss is the objective; `more`: a design that separates more, and what it misses; `less`: other designs where RGGB itself is best; `deepest`: what the design has at the deepest red.
    """

    column: Column
    best: Side
    cfa: str
    found: str
    edges: tuple[tuple[float, float], ...]
    notes: tuple[str, ...]
    over: str
    where: str
    rggb: Side | None
    tile: Side | None
    kept: tuple[str, ...]
    equal: tuple[str, ...]
    lamps: str
    bound: float | None
    below: str
    bound_of: str
    more: tuple[Side, str] | None
    others: tuple[Side, ...]
    filters: Curves | None
    points: tuple[Point, ...]
    cloud: Pairs | None
    traced: Pairs | None
    bounds: Pairs | None
    light_of: str
    own: tuple[str, ...] = ()
    lost: tuple[str, ...] = ()
    by_pixel: tuple[float, float] | None = None
    less: tuple[Side, ...] = ()
    deepest: str = ""

    heading = "What it buys"
    leads = True

    @classmethod
    def of(cls, output: Output) -> Iterator[Section]:
        """Yield it for the scenario that answers."""
        leaders, column = leaders_of(output), output.trade_off[0]
        best = leaders.chosen
        alone = len(output.scenarios) == 1
        if best is None or not (alone or best["kind"] in (SWEPT, SEARCHED)):
            return
        scenario = leaders.scenario
        rggb = reference_of(output, scenario)
        if rggb is not None and rggb["design_id"] == best["design_id"]:
            rggb = None
        bound = upper_bound_beside(output, best)
        most = leaders.separates
        more = None
        if most is not None and most[column.name] > best[column.name] * (1 + 1e-9):
            missed = "" if most["kind"] == REFERENCE else format_missed_constraints(output, most)
            more = _side(column, most), missed
        rows = output.named_rows[(output.named_rows["scenario"] == scenario) & (output.named_rows["status"] == "ok")]
        rows = rows[np.isfinite(rows[column.name].to_numpy(dtype=float))]
        shown = [row for row in rows.to_dict("records") if row["design_id"] != best["design_id"]]
        points = [*(_point(column, row) for row in shown), _point(column, best)]
        sensor = output.provenance.sensor
        yield cls(
            column=column,
            best=Side(label(best), float(best[column.name]), float(best[CFA_SENSITIVITY])),
            cfa=str(best["cfa"]),
            found={SEARCHED: "of this search", SWEPT: "of this sweep", NAMED: "of this study's designs"}.get(best["kind"], "of this study's CFAs"),
            edges=edges_of(best) if best["kind"] in (SWEPT, SEARCHED) else (),
            notes=(*colorants_of(output, best), *_unconverged(output, best)),
            over=_over(output, column),
            where="" if alone else scene_in_words(scenario),
            rggb=None if rggb is None else _side(column, rggb),
            tile=_tile(output, best),
            kept=tuple(_kept(output, best, rggb)),
            equal=_equal(output, best, [row for row in shown if rggb is None or label(row) != label(rggb)]),
            lamps=_limited(output, best),
            bound=bound,
            below=_below(output, best),
            bound_of=bound_conditions(output),
            more=more,
            others=tuple(_side(column, row) for row in leaders.others),
            filters=filter_curves(output, best, styles_of(point.name for point in points)[label(best)].color),
            points=tuple(points),
            cloud=_cloud(output, scenario, column, best),
            traced=_line(output, scenario, "objective", best),
            bounds=_line(output, scenario, "upper_bound", best) if bounds_figure(output, scenario, str(best["cfa"])) else None,
            own=tuple(_least(output, best, rggb)),
            lost=tuple(_lost(output, best, [*shown, *leaders.others])),
            by_pixel=_by_pixel(column, best, rggb),
            less=() if rggb is not None else tuple(sorted((_side(column, row) for row in shown), key=lambda one: -one.separation)[:_MOST_LESS]),
            deepest=next((reds.deepest for reds in DeeperReds.of(output) if isinstance(reds, DeeperReds)), ""),
            light_of="a sensor without filters" if sensor.has_clear else f"{sensor.reference} pixels alone",
        )  # fmt: skip

    @property
    def answer(self) -> list[str]:
        """What the best design has, beside RGGB."""
        best, rggb = self.best, self.rggb
        value = of_column(self.column, best.separation)
        edges = f"With {edges_in_words(self.edges)}, " if self.edges else ""
        notes = f" ({'; '.join(self.notes)})" if self.notes else ""
        who = (
            f"the {best.name} {self.found}{notes} in {self.cfa}"
            if best.name.startswith("best ")
            else f"{best.name}{notes}, the best {self.found},"
        )
        text = f"{edges}{who if edges or who.startswith(best.name) else who[:1].upper() + who[1:]}"
        plain = [one for one in (rggb, self.tile) if one is not None]
        beside = (
            f" ({', '.join(f'{one.name}: {of_column(self.column, one.separation)}' for one in plain)})" if plain else ""
        )
        if rggb is not None and (against := against_in_words(best.separation, rggb.separation, rggb.name)):
            beside = f", **{against}**{beside}"
        if self.lost:
            least, *of_others = self.lost
            beside_it = f" ({', '.join(of_others)})" if of_others else ""
            text += f" takes **{least}** of the light of its pixel{beside_it}, and"
        if self.own:
            text += f" has {joined([*self.own])}"
        elif self.column.pair is None or self.column.metric in (D_PRIME, CNR):
            text += f" has {article(quantity(self.column))} of **{value}**{self.over}{beside}"
        else:
            far = self.column.words.startswith("chromatic")
            by_pixel = self.column.metric in (PIXEL_CSD, CHROMATIC_PIXEL_CSD)
            text += f" separates {self.column.pair[0]} from {self.column.pair[1]} lamps{' of any brightness' * far}{' with every pixel counted' * by_pixel} by **{value}**{self.over}{beside}"
        light = f"It collects **{amount(best.light, 'share')}** of the light of {self.light_of}"
        lights = [f"{one.name}: {amount(one.light, 'share')}" for one in plain]
        light += f" ({', '.join(lights)})" if plain else ""
        where = f" in {self.where}" if self.where else ""
        less = [f"{one.name} ({of_column(self.column, one.separation)})" for one in self.less]
        less = [] if self.equal or self.own or self.more is not None else less
        return [
            f"{text}{where}.",
            f"{light}.",
            *([f"Less have {joined(less)}."] if less else []),
            *([f"It keeps {joined([*self.kept])}."] if self.kept else []),
            *(
                [
                    f"{joined([quoted(name) for name in self.equal])} {'has' if len(self.equal) == 1 else 'have'} {value}, too."
                ]
                if self.equal
                else []
            ),
        ]

    @property
    def limits(self) -> list[str]:
        """Nearest lamps, upper bound, and who separates more."""
        lines = []
        if self.by_pixel is not None and self.rggb is not None:
            mine, its = self.by_pixel
            against = against_in_words(mine, its, self.rggb.name)
            beside = f", {against} ({of_column(self.column, its)})" if against else ""
            lines.append(
                f"With every pixel counted, as noise sees them, it separates by {of_column(self.column, mine)}{beside}."
            )
        lines += [f"The nearest pair is {lamps(self.lamps)}.{self.deepest}"] if self.lamps else []
        if self.bound is not None:
            share = amount(self.best.separation / self.bound, "share") if self.bound > 0 else ""
            lines.append(
                f"No filter in this pixel{self.below} exceeds {self.column.format_bound(self.bound)} {self.bound_of} (proven, before "
                f"rounding to digital numbers); {quoted(self.best.name)} reaches {share} of that."
            )
        if self.more is not None:
            side, missed = self.more
            text = f"{side.name[:1].upper()}{side.name[1:]} separates more: {of_column(self.column, side.separation)} at {amount(side.light, 'share')} of the light"
            lines.append(f"{text}{f', but {missed}' if missed else ''}.")
        lines += [
            f"In another tile, {side.name} has {of_column(self.column, side.separation)} at {amount(side.light, 'share')} of the light."
            for side in self.others[:1]
        ]
        return lines

    @property
    def picture(self) -> Picture | None:
        """Curves of the best design over the lamps, and separation against light."""
        panels: list[Panel] = [] if self.filters is None else [self.filters]
        level = None if self.rggb is None else self.rggb.separation
        panels.append(
            Scatter(
                f"What it buys: {quantity(self.column)}{f' / {self.column.unit}' if self.column.unit else ''}", f"light of the whole CFA / % of {self.light_of}", self.points,
                self.best.name, self.cloud, self.traced, self.bounds, level,
            )
        )  # fmt: skip
        alone = f"{self.best.name}: {of_column(self.column, self.best.separation)} at {amount(self.best.light, 'share')} of the light, beside other CFAs."
        parts = ["Solid: the best of the search at each light."] if self.traced is not None else []
        parts += ["Dashed: the upper bound."] if self.bounds is not None else []
        parts += ["Small dots: swept designs on the front."] if self.cloud is not None else []
        parts += ["Areas: the lamps' spectra."] if self.filters is not None else []
        return Picture(tuple(panels), alone, " ".join(parts))


def lamp_areas(output: Output) -> dict[str, Values]:
    """Return the largest spectrum of each signal type at each wavelength, with peaks of 1."""
    return {
        kind: np.max(photons / photons.max(axis=1, keepdims=True), axis=0)
        for kind, photons in output.curves.bundles.items()
    }


def _side(column: Column, row: Row) -> Side:
    edges = edges_in_words(edges_of(row)).replace("**", "") if row["kind"] == SWEPT else ""
    name = f"a filter with {edges} ({label(row)})" if edges else quoted(label(row))
    return Side(name, float(row[column.name]), float(row[CFA_SENSITIVITY]))


def _point(column: Column, row: Row) -> Point:
    name = label(row)
    return Point(
        name,
        100 * float(row[CFA_SENSITIVITY]),
        float(row[column.name]),
        f"{name} {column.formatted(row[column.name]).removesuffix(' DN')}",
    )


def filter_curves(output: Output, best: Row, color: str, height: float = 320) -> Curves | None:
    """Return a design's modified channels beside the curves that they lie between, over the lamps."""
    kept = output.curves.designs.get(int(best["design_id"]))
    if not kept:
        return None
    entries = [entry for entry in modifications(output) if entry.cfa == best["cfa"]]
    ends = dict.fromkeys(end for entry in entries for end in (entry.base, entry.to) if isinstance(end, str))
    replaced = {name: output.curves.sensor[name] for name in ends if name in output.curves.sensor}
    curves = {**replaced, **kept}
    edges = edges_of(best) if best["kind"] in (SWEPT, SEARCHED) else ()
    return Curves(
        f"Where it filters: {response_of(output.curves.sensor)}",
        output.curves.wavelength_nm,
        curves,
        lamp_areas(output),
        {name: color if name in kept else CHANNELS.get(name, DIM) for name in curves},
        tuple(kept),
        tuple(replaced),
        tuple(edge for pair in edges for edge in pair),
        height,
    )


def _by_pixel(column: Column, best: Row, rggb: Row | None) -> tuple[float, float] | None:
    """Return the separations with every pixel counted, where the study's is one that counts each channel once."""
    name = {CSD: PIXEL_CSD, CHROMATIC_CSD: CHROMATIC_PIXEL_CSD}.get(column.metric)
    if name is None or column.extreme or rggb is None or column.pair is None:
        return None
    values = [float(row.get(pair_name(name, column.pair), np.nan)) for row in (best, rggb)]
    return (values[0], values[1]) if np.isfinite(values).all() else None


def _unconverged(output: Output, best: Row) -> Iterator[str]:
    search = output.provenance.search
    if best["kind"] == SEARCHED and search is not None and not search.converged:
        yield "best found; no start converged"


def _over(output: Output, column: Column) -> str:
    """Return what a separation is the worst of, or the share that has it."""
    if column.extreme == WORST_CASE:
        over = ["production"] if output.study.production.tolerance else []
        over += ["all lamps"] if output.study.population is not None else []
        return f" in the worst case of {joined(over)}"
    if column.extreme == OF_A_SHARE:
        return column.words.removeprefix(output.columns[column.of].words).replace(" of ", " for ", 1)
    return ""


def _equal(output: Output, best: Row, others: list[Row]) -> tuple[str, ...]:
    """Return CFAs and named designs whose separation is the best one's in all digits that are shown."""
    column = output.trade_off[0]
    shown = of_column(column, float(best[column.name]))
    return tuple(label(row) for row in others if of_column(column, float(row[column.name])) == shown)


def _limited(output: Output, row: Row) -> str:
    """Return the two lights that limit a row's separation, if they are lights of the study."""
    column = output.trade_off[0]
    known = row.get(limited_by_name(column.pair)) if column.pair else None
    drawn = column.extreme == OF_A_SHARE or (column.extreme == WORST_CASE and output.study.population is not None)
    return known if isinstance(known, str) and column.role == "separation" and not drawn else ""


def _cloud(output: Output, scenario: str, column: Column, best: Row) -> Pairs | None:
    """Return swept designs on the front, at most some hundreds."""
    rows = output.table[
        (output.table["scenario"] == scenario) & (output.table["kind"] == SWEPT) & output.table["pareto"]
    ]
    rows = rows[rows["feasible"] & (rows["cfa"] == best["cfa"])].iloc[:: max(1, len(rows) // _MOST_CLOUD)]
    if rows.empty:
        return None
    return 100 * rows[CFA_SENSITIVITY].to_numpy(dtype=float), rows[column.name].to_numpy(dtype=float)


def _line(output: Output, scenario: str, of: str, best: Row) -> Pairs | None:
    """Return optima, or the upper bound, of a search over the light of the whole CFA."""
    search, front = output.provenance.search, output.front
    if front is None or search is None or search.scenario != scenario or search.cfa != best["cfa"]:
        return None
    x = "cfa_sensitivity" if of == "objective" else "cfa_sensitivity_min"
    known = front[[x, of]].dropna().sort_values(x)
    if len(known) < 2 or output.goal.name != output.trade_off[0].name:
        return None
    return 100 * known[x].to_numpy(dtype=float), known[of].to_numpy(dtype=float)


def _tile(output: Output, best: Row) -> Side | None:
    """Return the plain CFA of a design's tile, where the study has it and it is not the one to compare with."""
    tile = own_tile(output, best) if best["kind"] != REFERENCE else None
    rggb = reference_of(output, str(best["scenario"]))
    known = () if rggb is None else (rggb["design_id"],)
    return (
        None
        if tile is None or tile["design_id"] in known or tile["status"] != "ok"
        else _side(output.trade_off[0], tile)
    )


def _kept(output: Output, best: Row, rggb: Row | None) -> Iterator[str]:
    """Yield constrained figures beside the lamps, with their limits."""
    for name, bound in output.constraints.items():
        column = output.columns.get(name)
        if column is not None and column.metric.startswith(PREFIX):
            plain = [row for row in (rggb, own_tile(output, best)) if row is not None]
            beside = "".join(f"; {label(row)}: {of_column(column, float(row[name]))}" for row in plain)
            yield f"{quantity(column)} at **{of_column(column, float(best[name]))}** ({format_bounded(column, bound)}{beside})"


def _least(output: Output, best: Row, rggb: Row | None) -> Iterator[str]:
    """Yield the quantities of an objective that is to be the least, each in its own unit beside RGGB's."""
    for name in output.objective.weights if output.objective.rule.direction != "more" else ():
        column = output.columns[name]
        beside = "" if rggb is None else f" ({label(rggb)}: {of_column(column, float(rggb[name]))})"
        yield f"{article(quantity(column))} of **{of_column(column, float(best[name]))}**{beside}"


def _lost(output: Output, best: Row, others: list[Row]) -> Iterator[str]:
    """Yield the light that feasible filters take from their pixels, where the objective is to take the least."""
    if output.goal.name == SENSITIVITY:
        yield amount(1 - float(best[SENSITIVITY]), "share")
        for row in others:
            if row["feasible"] and np.isfinite(row[SENSITIVITY]):
                name = "best swept" if row["kind"] == SWEPT else label(row)
                yield f"{name} in {row['cfa']}: {amount(1 - float(row[SENSITIVITY]), 'share')}"


def _below(output: Output, best: Row) -> str:
    """Return for which filters a bound holds: below the curve that they replace, and of the answer's kind."""
    search = output.provenance.search
    base = None if search is None else (output.study.sweeps | output.study.boxes)[search.space].base
    alike = " that moves like it" if is_angle_dependent(output, best) else ""
    box = " or the box" if search is not None and search.upper_bound_of_box else ""
    return f"{alike} that stays below {base}{box}" if base else alike
