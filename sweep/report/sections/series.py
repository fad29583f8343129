"""A separation over scenes that differ in one number: who leads where, and where the filter loses."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from ...base.types import Array, Float
from ...metrics.columns.chromatic import CHROMATIC_DPRIME
from ...metrics.columns.confusion import D_PRIME
from ...metrics.columns.flicker import LAMP_SEEN
from ...metrics.columns.sensitivity import CFA_SENSITIVITY
from ...metrics.quantity import DN, Column
from ...results.output import Output
from ...results.tables import RGGB
from ...study.axes import series_of
from ..leaders import answering, label
from ..panels import Line, Lines, Panel, Picture, Ring
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
    in words; `pulses`: of the lamps; `swaps`: numbers at which two designs change places, and their value there.
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
    swaps: Mapping[tuple[str, str], tuple[tuple[float, float], ...]] = field(default_factory=dict)

    leads = True

    @classmethod
    def of(cls, output: Output) -> Iterator[Section]:
        """Yield one for each series; those in which separations vanish come first."""
        rows, column, series = output.named_rows, output.trade_off[0], series_of(output.study.scenarios)
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
                        _swaps(output, base, key),
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
        leads: list[tuple[str | None, int, int]] = []
        for at in range(len(self.numbers.x)):
            most = max(y[at] for y in known.values())
            before = leads[-1][0] if leads else None
            leader: str | None = None
            if most >= self._least:
                ties = [name for name, y in known.items() if y[at] == most]
                leader = before if before in ties else ties[0]
            if leads and before == leader:
                leads[-1] = (leader, leads[-1][1], at)
            else:
                leads.append((leader, at, at))
        return leads

    @property
    def answer(self) -> list[str]:
        """The leader of each range, with its value and its rival's; of a search its worst value."""
        if self.searched:
            return [*self._of_search(), *self._losses()]
        return [*self._of_pulses(), *self._reached(), *self._of_leaders()]

    @property
    def _least(self) -> float:
        return _LEAST if self.column.unit == DN else 0.0

    def _swap(self, first: str, second: str, at: int) -> tuple[float, float] | None:
        """Return where two designs change places after a computed number, and their value there, or None."""
        low, high = self.numbers.x[at : at + 2]
        if self.missed is not None and (self.missed[at : at + 2] > _SEEN).any():
            return None
        known = (*self.swaps.get((first, second), ()), *self.swaps.get((second, first), ()))
        return next((swap for swap in known if low <= swap[0] <= high), None)

    def _where(self, first: str, second: str) -> str:
        """Return in words where one design has at least what another has."""
        mine, its = (np.nan_to_num(self.values[name], nan=-np.inf) for name in (first, second))
        mask, parts = mine >= its, []
        for run in np.split(np.arange(mask.size), np.flatnonzero(np.diff(mask)) + 1):
            start, stop = int(run[0]), int(run[-1])
            if not mask[start]:
                continue
            ends = [None if end in (-1, mask.size - 1) else self._swap(first, second, end) for end in (start - 1, stop)]
            parts.append(self.numbers.between(start, stop, *(None if end is None else end[0] for end in ends)))
        return joined(parts)

    @property
    def _vanishes(self) -> bool:
        return self.column.unit == DN and any((y < _LEAST).any() for y in self.values.values())

    def _reached(self) -> Iterator[str]:
        """Yield where the filter and RGGB have 1 DN, where that is not everywhere."""
        if not self._vanishes or (self.missed is not None and (self.missed > _SEEN).any()):
            return
        ranges: dict[str, list[str]] = {}
        for name in dict.fromkeys((self.hero, RGGB)):
            if name in self.values:
                ranges.setdefault(self._from_least(name), []).append(quoted(name))
        kinds = " and ".join(self.column.pair or ())
        kinds += " lamps of any brightness" if self.column.name.startswith("chromatic") else " lamps"
        parts = [f"**{where}** with {joined(names)}" for where, names in ranges.items()]
        if parts:
            yield f"{kinds.capitalize()} are 1 DN or more apart {'; '.join(parts)}."

    def _from_least(self, name: str) -> str:
        return self.numbers.where(np.nan_to_num(self.values[name]) >= _LEAST) or "nowhere"

    def _of_pulses(self) -> Iterator[str]:
        if self.missed is None or not (self.missed > _SEEN).any():
            return
        sure, most = self.missed <= _SEEN, amount(inward_share(float(self.missed.max())), "share")
        if self.dark_s and self.numbers.key == "exposure_s":
            worst = self.numbers.at(int(np.argmax(self.missed)))
            yield (
                f"A {f'lamp pulsed {self.pulses}' if self.pulses else 'pulsed lamp'} is dark for up to **{amount(self.dark_s, 's')}**: a longer exposure meets every pulse; one of "
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
        return next(iter((*self._losses(), *self._of_leaders())), "")

    def _of_search(self) -> Iterator[str]:
        def least(name: str) -> str:
            value, number = self.worst[name]
            return f"{of_column(self.column, inward(value, up=False))} at {self.numbers.with_unit(number)}"

        span = f"From {self.numbers.at(0)} to {self.numbers.at(len(self.numbers.x) - 1)}"
        who = f"{quoted(self.hero)}{f' ({self.edges})' if self.edges else ''}"
        others = [name for name in self.worst if name not in (self.hero, RGGB)]
        shown = [*((RGGB,) if RGGB in self.worst else ()), *sorted(others, key=lambda name: -self.worst[name][0])[:1]]
        beside = f" ({'; '.join(f'{quoted(name)}: {least(name)}' for name in shown)})" if shown else ""
        if self.column.metric in (D_PRIME, CHROMATIC_DPRIME) and self.column.pair:
            far = " of any brightness" if self.column.metric == CHROMATIC_DPRIME else ""
            value, number = self.worst[self.hero]
            yield (
                f"{span}, {who} keeps {' and '.join(self.column.pair)} lamps{far} apart by at least "
                f"**{of_column(self.column, inward(value, up=False))} times their noise** (d', at {self.numbers.with_unit(number)}){beside}."
            )
            return
        yield f"{span}, {who} has {article(quantity(self.column))} of at least **{least(self.hero)}**{beside}."

    def _of_leaders(self) -> Iterator[str]:
        parts, told = list[str](), 0
        pulsed = self.missed is not None and bool((self.missed > _SEEN).any())
        leads = [lead for lead in self.leads_of if lead[0] is not None or not pulsed]
        for at, (leader, start, stop) in enumerate(leads[:_MOST_RANGES]):
            if leader is None:
                parts.append(f"no CFA separates 1 DN {self.numbers.span(start, stop)}")
                continue
            ends = []
            for other, end in ((at - 1, start - 1), (at + 1, stop)):
                name = leads[other][0] if 0 <= other < len(leads) else None
                crossed = None if name is None else self._swap(leader, name, end)
                ends.append(None if crossed is None else crossed[0])
            verb = "" if told else f" {self._verb}"
            told += 1
            own = self.values[leader][start : stop + 1]
            most = start + int(np.nanargmax(own))
            others = sorted(
                (d for d in self.values if d != leader),
                key=lambda d: -np.nan_to_num(self.values[d][most], nan=-np.inf),
            )
            rival = next((name for name in (RGGB, self.hero) if name in others), next(iter(others), None))
            known = rival is not None and np.isfinite(self.values[rival][most])
            beside = f"; {quoted(rival)} {self._value(rival, most)}" if rival and known else ""
            where = self.numbers.between(start, stop, *ends)
            parts.append(
                f"**{quoted(leader)}**{verb} {where} ({self._value(leader, most)} at {self.numbers.at(most)}{beside})"
            )
        more = f"; {len(leads) - _MOST_RANGES} more ranges follow" if len(leads) > _MOST_RANGES else ""
        among = f" ({self.among})" if self.among and not pulsed else ""
        if parts:
            yield f"Over {self.numbers.name}{among}, {'; '.join(parts)}{more}."

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
        reached = np.maximum(mine, its) >= self._least
        if (below & reached).any():
            where = (
                self._where(RGGB, self.hero)
                if reached.all() and not (mine == its).any()
                else self.numbers.where(below & reached)
            )
            yield f"{quoted(self.hero)} has less than RGGB {where}."

    @property
    def picture(self) -> Picture | None:
        """A line each, with rings where the filter passes RGGB; of lamps that may be dark how often they are, too."""
        x, unit = np.array(self.numbers.drawn), self.column.unit
        pulsed = self.missed is not None and self.missed[0] > _SEEN >= self.missed[-1]
        seen = np.ones(x.size, dtype=bool) if self.missed is None or not pulsed else self.missed <= _SEEN
        lines = {}
        for name, y in self.values.items():
            drawn = np.maximum(np.nan_to_num(y, nan=_LEAST_DRAWN), _LEAST_DRAWN) if self._vanishes else y
            lines[name] = self._with_ends(name, Line(x, np.where(seen, drawn, np.nan), self.bests.get(name)))
        rings = self._rings()
        level, band, panels = (_LEAST, "1 DN") if self._vanishes and not pulsed else None, None, list[Panel]()
        if self.missed is not None and pulsed:
            last = float(x[np.flatnonzero(~seen)[-1]])
            dark = self.numbers.factor * (self.dark_s or 0.0) if self.numbers.key == "exposure_s" else last
            band = (float(x[0]), max(last, dark), "the lamp\nmay be dark")
            ends = np.append(x, dark), np.append(100 * self.missed, 0.0)
            order = np.argsort(ends[0], kind="stable")
            phases = {"every CFA": Line(ends[0][order], ends[1][order])}
            panels.append(
                Lines(
                    "phases of the pulses that miss the lamp / %",
                    self.numbers.axis,
                    phases,
                    "every CFA",
                    self.numbers.log,
                    height=150,
                )
            )
        parts = [f"{_LEAST_DRAWN:g} DN or less is drawn at {_LEAST_DRAWN:g} DN."] if self._vanishes else []
        parts += (
            ["A line is the worst, its band goes up to the best, of all places of a lamp on the pixels."]
            if self.bests
            else []
        )
        parts += ["Rings: where the filter passes RGGB."] if rings else []
        parts += ["Rings with names: the least of the whole range."] if self.searched else []
        words = f"{quantity(self.column)} / {unit}" if unit else quantity(self.column)
        panels.append(
            Lines(words, self.numbers.axis, lines, self.hero, self.numbers.log, self._vanishes, level, band=band,
                  rings=(*rings, *self._least_rings()))
        )  # fmt: skip
        return Picture(
            tuple(panels), f"{quantity(self.column)} over {self.numbers.name}: {', '.join(self.values)}.", " ".join(parts),
            columns=1,
        )  # fmt: skip

    def _rings(self) -> tuple[Ring, ...]:
        """Return where the filter passes RGGB."""
        mine, its = self.values.get(self.hero), self.values.get(RGGB)
        if mine is None or its is None or self.hero == RGGB:
            return ()
        found = [self._swap(self.hero, RGGB, at) for at in range(len(self.numbers.x) - 1)]
        text = not self.searched
        return tuple(
            Ring(self.numbers.factor * one[0], one[1], self.numbers.with_unit(one[0]) if text else "")
            for one in found
            if one is not None and one[1] >= self._least
        )

    def _with_ends(self, name: str, line: Line) -> Line:
        """Return a line with what its rings show: where the filter passes RGGB, and of a search the worst place."""
        more = [(ring.x, ring.y) for ring in self._rings()] if name in (self.hero, RGGB) else []
        if self.searched and name in self.worst:
            value, number = self.worst[name]
            more.append((self.numbers.factor * number, value))
        x = np.concatenate([line.x, [at for at, _ in more]])
        order = np.argsort(x, kind="stable")
        y = np.concatenate([line.y, [value for _, value in more]])
        upper = None if line.upper is None else np.interp(x, line.x, line.upper)[order]
        return Line(x[order], y[order], upper)

    def _least_rings(self) -> Iterator[Ring]:
        """Yield the worst places of the filter and of RGGB."""
        for name in (self.hero, RGGB) if self.searched else ():
            if name in self.worst:
                value, number = self.worst[name]
                yield Ring(
                    self.numbers.factor * number,
                    value,
                    f"{name}: {of_column(self.column, inward(value, up=False))}",
                    below=True,
                )

    @property
    def table(self) -> Table | None:
        """Values at a few numbers: the ends, and where leaders change."""
        last = len(self.numbers.x) - 1
        places = sorted({0, last, *(start for _, start, _ in self.leads_of), last // 2})
        while len(places) > _MOST_COLUMNS:
            places.pop(len(places) // 2)
        compared = RGGB if RGGB in self.values else next(iter(self.values))
        its, rows = self.values[compared], []
        seen = [at for at in places if its[at] >= self._least]
        for name, y in list(self.values.items())[:MOST_ROWS]:
            cells = [self._value(name, at) for at in places]
            if seen:
                against = "" if name == compared else change(float(y[seen[-1]]), float(its[seen[-1]]))
                cells += [against, effect(self.column, float(y[seen[-1]]), float(its[seen[-1]])) if against else ""]
            first = self._from_least(name) if self._vanishes else amount(self.light[name], "share")
            rows.append((name, first, *cells))
        head = [
            "",
            "1 DN or more" if self._vanishes else "light of the CFA",
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


def _swaps(output: Output, base: str, key: str) -> dict[tuple[str, str], tuple[tuple[float, float], ...]]:
    """Return the numbers of a series at which designs change places, and their separation there."""
    if output.crossings is None or "against" not in output.crossings:
        return {}
    known = output.crossings.dropna(subset=["against"])
    known = known[(known["series"] == base) & (known["key"] == key)]
    return {
        (str(first), str(second)): tuple(zip(part["at"].astype(float), part["value"].astype(float), strict=True))
        for (first, second), part in known.groupby(["name", "against"], sort=False)
    }


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
