"""A separation over scenes that differ in one number: who leads where, and where the filter loses."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from ...base.types import Array, Float
from ...metrics.columns.flicker import LAMP_SEEN
from ...metrics.columns.sensitivity import CFA_SENSITIVITY
from ...metrics.quantity import DN, Column
from ...results.output import Output
from ...study.axes import series_of
from ..leaders import RGGB, answering, label
from ..panels import Line, Lines, Picture, Ring
from ..section import MOST_ROWS, Section, Table
from ..series import Numbers, over_series
from ..terms import edges_in_words, edges_of
from ..words import amount, article, change, effect, inward, inward_share, joined, number, of_column, quantity, quoted

Values = Float[Array, " numbers"]
_LEAST = 1.0
"""DN; who separates less is not said to lead."""
_LEAST_DRAWN = 0.3
_SEEN = 1e-9
_MOST_RANGES = 4
_MOST_COLUMNS = 4


@dataclass(frozen=True)
class Series(Section):
    """The separation of each CFA and design over a number.

    `among`: the series, where several are over one number; `bests`: values at the best sampling phase; `searched`: the
    hero was searched for its worst value here; `missed`: the largest share of phases of a pulsed lamp that a CFA does
    not see, and `dark_s`, how long the lamp is dark; `worst`: worst values, also between the scenes, and where they are; `edges`: of the hero,
    in words; `pulses`: of the lamps.
    """

    column: Column
    numbers: Numbers
    among: str
    values: Mapping[str, Values]
    bests: Mapping[str, Values]
    light: Mapping[str, float]
    hero: str
    missed: Values | None = None
    dark_s: float | None = None
    searched: bool = False
    worst: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    edges: str = ""
    pulses: str = ""

    leads = True

    @classmethod
    def of(cls, output: Output) -> Iterator[Section]:
        """Yield one for each series; those in which separations vanish come first."""
        rows, column, series = output.named_rows, output.trade_off[0], series_of(output.scenarios)
        best = [
            c.name
            for c in output.columns.values()
            if (c.extreme, c.of) == ("best place", column.name) and c.name in rows
        ]
        light = {str(row["name"]): float(row[CFA_SENSITIVITY]) for row in rows.to_dict("records")}
        answers = answering(output)
        found = []
        for (base, key), scenarios in series.items():
            values = over_series(rows, scenarios, column.name)
            upper = over_series(rows, scenarios, best[0]) if best else {}
            upper = {
                name: y for name, y in upper.items() if np.isfinite(y).all() and not np.array_equal(y, values[name])
            }
            if values:
                numbers = Numbers(base, key, tuple(scenarios.values()))
                among = base if [other for _, other in series].count(key) > 1 else ""
                hero = "" if answers is None or label(answers) not in values else label(answers)
                worst = _worst(output, base, key)
                search = output.provenance.search
                searched = (
                    search is not None and search.scenarios > 1 and search.scenario in scenarios and hero in worst
                )
                missed, dark_s = _missed(output, scenarios)
                edges = edges_in_words(edges_of(answers)) if searched and answers is not None else ""
                pulses = _pulses(output, scenarios)
                found.append(
                    cls(
                        column,
                        numbers,
                        among,
                        values,
                        upper,
                        light,
                        hero,
                        missed,
                        dark_s,
                        searched,
                        worst,
                        edges,
                        pulses,
                    )
                )
        yield from sorted(
            found, key=lambda one: -sum(int((y < _LEAST).any()) for y in one.values.values()) * (column.unit == DN)
        )

    @property
    def title(self) -> str:
        """Over what."""
        return f"Over {self.numbers.name}{f', {self.among}' if self.among else ''}"

    @property
    def leads_of(self) -> list[tuple[str | None, int, int]]:
        """The leader of each range in order; None where no CFA reaches 1 DN.

        A leader stays one as long as no other design has more.
        """
        known = {name: np.nan_to_num(y, nan=-np.inf) for name, y in self.values.items()}
        least = _LEAST if self.column.unit == DN else 0.0
        leads: list[tuple[str | None, int, int]] = []
        for at in range(len(self.numbers.x)):
            most = max(y[at] for y in known.values())
            before = leads[-1][0] if leads else None
            leader: str | None = None
            if most >= least:
                ties = [name for name, y in known.items() if y[at] == most]
                leader = before if before in ties else ties[0]
            if leads and before == leader:
                leads[-1] = (leader, leads[-1][1], at)
            else:
                leads.append((leader, at, at))
        return leads

    @property
    def answer(self) -> list[str]:
        """The leader of each range, with its value and its rival's at the end; of a search its worst value."""
        if self.searched:
            return [*self._of_search(), *self._losses()]
        return [*self._of_pulses(), *self._reached(), self._of_leaders()]

    def _reached(self) -> Iterator[str]:
        """Yield where 1 DN is left, where that is not everywhere."""
        ranges: dict[str, list[str]] = {}
        masks = {name: y >= _LEAST for name, y in self.values.items() if np.isfinite(y).all()}
        if self.column.unit != DN or all(mask.all() for mask in masks.values()):
            return
        for name, mask in masks.items():
            ranges.setdefault(self.numbers.where(mask) if mask.any() else "nowhere", []).append(quoted(name))
        parts = [f"**{where}** with {joined(names)}" for where, names in ranges.items()]
        kinds = " and ".join(self.column.pair or ())
        kinds += " lamps of any brightness" if self.column.name.startswith("chromatic") else " lamps"
        yield f"{kinds.capitalize()} are 1 DN or more apart {'; '.join(parts)}."

    def _of_pulses(self) -> Iterator[str]:
        if self.missed is None or not (self.missed > _SEEN).any():
            return
        sure, most = self.missed <= _SEEN, amount(inward_share(float(self.missed.max())), "share")
        if self.dark_s and self.numbers.key == "exposure_s":
            worst = self.numbers.at(int(np.argmax(self.missed)))
            yield (
                f"A lamp pulsed {self.pulses} is dark for up to **{amount(self.dark_s, 's')}**: a longer exposure meets every pulse; one of "
                f"{worst} misses it in up to {most} of the phases."
            )
            return
        where = (
            f"Every CFA sees a lamp in all phases of its pulses **{self.numbers.where(sure)}**; else up to"
            if sure.any()
            else "Up to"
        )
        yield f"{where} {most} of the phases miss it."

    @property
    def short(self) -> str:
        """Where the filter loses, or who leads."""
        return next(iter(self._losses()), self._of_leaders())

    def _of_search(self) -> Iterator[str]:
        def least(name: str) -> str:
            value, number = self.worst[name]
            return f"{of_column(self.column, inward(value, up=False))} (at {self.numbers.with_unit(number)})"

        text = f"From {self.numbers.at(0)} to {self.numbers.at(len(self.numbers.x) - 1)}, {quoted(self.hero)}{f' ({self.edges})' if self.edges else ''} has {article(quantity(self.column))} of at least **{least(self.hero)}**"
        others = [f"{quoted(name)} {least(name)}" for name in self.worst if name != self.hero]
        yield f"{text}; others: {', '.join(others)}." if others else f"{text}."

    def _of_leaders(self) -> str:
        leads, parts = self.leads_of, []
        for leader, start, stop in leads[:_MOST_RANGES]:
            span = self.numbers.span(start, stop)
            if leader is None:
                parts.append(f"no CFA separates 1 DN {span}")
                continue
            verb = "" if any(" most " in part or " the largest " in part for part in parts) else f" {self._verb}"
            others = sorted(
                (d for d in self.values if d != leader), key=lambda d: -np.nan_to_num(self.values[d][stop], nan=-np.inf)
            )
            rival = next((name for name in (RGGB, self.hero) if name in others), next(iter(others), None))
            where = "" if start == stop else f" at {self.numbers.at(stop)}"
            beside = f"; {quoted(rival)} {self._value(rival, stop)}" if rival else ""
            parts.append(f"**{quoted(leader)}**{verb} {span} ({self._value(leader, stop)}{where}{beside})")
        more = f"; {len(leads) - _MOST_RANGES} more ranges follow" if len(leads) > _MOST_RANGES else ""
        among = f" ({self.among})" if self.among else ""
        return f"Over {self.numbers.name}{among}, {'; '.join(parts)}{more}."

    @property
    def _verb(self) -> str:
        """What the leader does."""
        if self.column.pair is None or self.column.unit != DN:
            return f"has the largest {quantity(self.column)}"
        kinds = f"{self.column.pair[0]} from {self.column.pair[1]} lamps"
        return f"separates {kinds}{' of any brightness' if self.column.name.startswith('chromatic') else ''} most"

    @property
    def limits(self) -> list[str]:
        """Where the filter has less than RGGB."""
        return [] if self.searched else [*self._losses()]

    def _losses(self) -> Iterator[str]:
        mine, its = self.values.get(self.hero), self.values.get(RGGB)
        if mine is None or its is None or self.hero == RGGB:
            return
        below = np.nan_to_num(mine, nan=-np.inf) < np.nan_to_num(its, nan=-np.inf)
        reached = np.maximum(mine, its) >= (_LEAST if self.column.unit == DN else 0.0)
        if (below & reached).any():
            yield f"{quoted(self.hero)} has less than RGGB {self.numbers.where(below & reached)}."

    @property
    def picture(self) -> Picture | None:
        """A line each, with rings where the filter falls below RGGB."""
        x, unit = np.array(self.numbers.drawn), self.column.unit
        vanish = unit == DN and any((y < _LEAST).any() for y in self.values.values())
        lines = {}
        for name, y in self.values.items():
            drawn = np.maximum(np.nan_to_num(y, nan=_LEAST_DRAWN), _LEAST_DRAWN) if vanish else y
            lines[name] = Line(x, drawn, self.bests.get(name))
        rings = self._rings(x, log=vanish)
        level = (_LEAST, "1 DN") if vanish else None
        band = None
        if self.missed is not None and self.missed[0] > _SEEN >= self.missed[-1]:
            last = float(x[np.flatnonzero(self.missed > _SEEN)[-1]])
            dark = self.numbers.factor * (self.dark_s or 0.0) if self.numbers.key == "exposure_s" else last
            band, level = (float(x[0]), max(last, dark), "the lamp\nmay be dark"), None
        parts = [f"{_LEAST_DRAWN:g} DN or less is drawn at {_LEAST_DRAWN:g} DN."] if vanish else []
        parts += (
            ["A line is the worst, its band goes up to the best, of all places of a lamp on the pixels."]
            if self.bests
            else []
        )
        parts += ["Rings: where the filter passes RGGB, between two computed scenes."] if rings else []
        words = f"{quantity(self.column)} / {unit}" if unit else quantity(self.column)
        panel = Lines(
            words, self.numbers.axis, lines, self.hero, self.numbers.log, vanish, level, band=band, rings=rings
        )
        return Picture(
            (panel,), f"{quantity(self.column)} over {self.numbers.name}: {', '.join(self.values)}.", " ".join(parts)
        )

    def _rings(self, x: Values, *, log: bool) -> tuple[Ring, ...]:
        """Return where the filter passes RGGB, on straight lines of the figure between computed scenes."""
        mine, its = self.values.get(self.hero), self.values.get(RGGB)
        if mine is None or its is None or self.hero == RGGB:
            return ()
        across = np.log(x) if self.numbers.log else x
        heights = [np.log(np.maximum(y, _LEAST_DRAWN)) if log else y for y in (mine, its)]
        apart, rings = heights[0] - heights[1], []
        for at in np.flatnonzero(np.sign(apart[:-1]) * np.sign(apart[1:]) < 0):
            share = apart[at] / (apart[at] - apart[at + 1])
            number = across[at] + share * (across[at + 1] - across[at])
            height = heights[1][at] + share * (heights[1][at + 1] - heights[1][at])
            rings.append(
                Ring(float(np.exp(number) if self.numbers.log else number), float(np.exp(height) if log else height))
            )
        return tuple(rings)

    @property
    def table(self) -> Table | None:
        """Values at a few numbers: the ends, and where leaders change."""
        last = len(self.numbers.x) - 1
        places = sorted({0, last, *(start for _, start, _ in self.leads_of), last // 2})
        while len(places) > _MOST_COLUMNS:
            places.pop(len(places) // 2)
        compared = RGGB if RGGB in self.values else next(iter(self.values))
        its, rows = self.values[compared], []
        seen = [at for at in places if its[at] >= (_LEAST if self.column.unit == DN else 0.0)]
        for name, y in list(self.values.items())[:MOST_ROWS]:
            cells = [self._value(name, at) for at in places]
            if seen:
                against = "" if name == compared else change(float(y[seen[-1]]), float(its[seen[-1]]))
                cells += [against, effect(self.column, float(y[seen[-1]]), float(its[seen[-1]])) if against else ""]
            rows.append((name, amount(self.light[name], "share"), *cells))
        head = [
            "",
            "light of the CFA",
            *(self.numbers.at(at) for at in places),
            *([f"{self.numbers.at(seen[-1])}, against {compared}", ""] if seen else []),
        ]
        return Table(tuple(head), tuple(rows))

    def _value(self, name: str, at: int) -> str:
        return of_column(self.column, float(self.values[name][at]))


def _worst(output: Output, base: str, key: str) -> dict[str, tuple[float, float]]:
    """Return the worst value of the objective over a series, also between its scenes, and where it is, by design."""
    if output.worst is None:
        return {}
    known = output.worst[
        (output.worst["series"] == base) & (output.worst["key"] == key) & (output.worst["quantity"] == output.goal.name)
    ]
    return {str(row["name"]): (float(row["value"]), float(row["at"])) for row in known.dropna().to_dict("records")}


def _missed(output: Output, scenarios: Mapping[str, float]) -> tuple[Values | None, float | None]:
    """Return the largest share of phases of a pulsed lamp that a CFA does not see, and how long the lamp is dark."""
    rows = output.named_rows
    seen = over_series(rows, scenarios, LAMP_SEEN) if LAMP_SEEN in rows else {}
    if not seen or not np.isfinite(np.concatenate([*seen.values()])).all():
        return None, None
    drives = [output.study.scenarios[name].drive for name in scenarios]
    dark = [(1 - drive.duty) / drive.frequency_hz for drive in drives if drive is not None]
    return 1 - np.min([*seen.values()], axis=0), max(dark, default=None)


def _pulses(output: Output, scenarios: Mapping[str, float]) -> str:
    """Return frequency and duty of the pulses that all scenes share, in words."""
    drives = [output.study.scenarios[name].drive for name in scenarios]
    known = {(drive.frequency_hz, drive.duty) for drive in drives if drive is not None}
    if len(known) != 1:
        return ""
    ((frequency_hz, duty),) = known
    return f"at {number(frequency_hz)} Hz, on for {number(100 * duty)} % of the time,"
