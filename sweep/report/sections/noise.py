"""How often noise turns one signal color into another, and where each CFA may be used; with captures, their handovers."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from ...base.types import Array, Bool, BoolArray, Float
from ...metrics.columns.chromatic import CHROMATIC_ERROR
from ...metrics.columns.confusion import STATE_ERROR
from ...metrics.columns.sensitivity import CFA_SENSITIVITY
from ...results.output import Output
from ...results.tables import RGGB
from ...study.axes import series_of
from ..leaders import answering, label
from ..panels import Line, Lines, Picture
from ..row_panels import Bar, Bars
from ..section import MOST_ROWS, Section, Table
from ..series import Numbers, over_series
from ..words import amount, digits, inward, joined, one_in, quoted

Values = Float[Array, " numbers"]
_LEAST = 1e-12
_TICKS = ((0.5, "1 in 2"), (1e-3, "1 in 1,000"), (1e-6, "1 in a million"), (1e-9, "1 in a billion"), (_LEAST, "fewer"))


@dataclass(frozen=True)
class Noise(Section):
    """Errors of the worst two states over a number, for lamps of unknown brightness and of equal brightness.

    `ranges`: where each design has at most the allowed error, with refined ends; `steady`: the same of equally bright
    lamps, in words; `strokes`, `full`: where channels hand over to their next capture, and where the last one is full;
    `further`: the answers over other numbers of the study.
    """

    numbers: Numbers
    allowed: float
    states: tuple[str, ...]
    errors: Mapping[str, Values]
    ranges: Mapping[str, tuple[tuple[float, float], ...]]
    steady: Mapping[str, str]
    strokes: Mapping[str, tuple[float, ...]]
    full: Mapping[str, tuple[float, ...]]
    marked: str
    light: Mapping[str, float]
    hero: str
    further: tuple[str, ...] = ()

    leads = True

    @classmethod
    def of(cls, output: Output) -> Iterator[Section]:
        """Yield one for each series of a study of noise."""
        recognition = output.study.recognition
        if recognition is None:
            return
        rows, allowed = _with_worst_error(output), recognition.error_max
        light = {str(row["name"]): float(row[CFA_SENSITIVITY]) for row in rows.to_dict("records")}
        answers, sections = answering(output), list[Noise]()
        for (base, key), scenarios in series_of(output.study.scenarios).items():
            numbers = Numbers(base, key, tuple(scenarios.values()))
            x = np.array(numbers.x)
            errors = over_series(rows, scenarios, CHROMATIC_ERROR)
            ranges, steady = {}, {}
            for quantity in (CHROMATIC_ERROR, STATE_ERROR):
                crossings = _crossings(output, base, key, quantity)
                for name, error in over_series(rows, scenarios, quantity).items():
                    found = usable_ranges(x, error <= allowed, crossings.get(name))
                    if quantity == CHROMATIC_ERROR:
                        ranges[name] = found
                    else:
                        steady[name] = ranges_in_words(numbers, found)
            if errors:
                strokes, full, kind = _handovers(output, base, key, numbers)
                hero = "" if answers is None or label(answers) not in errors else label(answers)
                states = tuple(recognition.states or output.curves.bundles)
                handovers = strokes, full, kind
                sections.append(cls(numbers, allowed, states, errors, ranges, steady, *handovers, light, hero))
        if sections:
            others = tuple(section.in_short for section in sections[1:])
            yield replace(sections[0], further=others)
            yield from sections[1:]

    @property
    def title(self) -> str:
        """Over what."""
        return f"Errors over {self.numbers.name}"

    @property
    def answer(self) -> list[str]:
        """Where RGGB, the answering design and the one with the widest range have at most the allowed error."""
        rarely, what = one_in(self.allowed).replace("1 in", "1 error in"), joined([*self.states])
        lines = [f"{what.capitalize()} lamps of unknown brightness are told apart with at most {rarely} {self._where}."]
        rest = [name for name in self._widest if name not in self._shown]
        if rest:
            lines.append(
                f"Others: {'; '.join(f'{quoted(n)} {ranges_in_words(self.numbers, self.ranges[n])}' for n in rest)}."
            )
        if self.further:
            lines.append(" ".join(self.further))
        return lines

    @property
    def in_short(self) -> str:
        """The answer, as one of several over other numbers."""
        return f"Over {self.numbers.name}: {self._where}."

    @property
    def _widest(self) -> list[str]:
        return sorted(self.ranges, key=lambda name: -self._width(name))

    @property
    def _shown(self) -> list[str]:
        widest = self._widest
        return [name for name in widest if name in (RGGB, self.hero) or name == widest[0]]

    @property
    def _where(self) -> str:
        groups: dict[str, list[str]] = {}
        for name in self._shown:
            groups.setdefault(ranges_in_words(self.numbers, self.ranges[name]), []).append(name)
        parts = [f"**{where}** with {joined([quoted(name) for name in names])}" for where, names in groups.items()]
        return "; ".join(parts)

    def _width(self, name: str) -> float:
        """Return how much of the numbers is in a design's ranges, on the axis of the figure."""
        scale = np.log if self.numbers.log else np.asarray
        ends = np.clip(np.array(self.ranges[name]).reshape(-1, 2), self.numbers.x[0], self.numbers.x[-1])
        return float(np.diff(scale(ends), axis=1).sum())

    @property
    def limits(self) -> list[str]:
        """What known brightness changes, and when pixels are full."""
        groups: dict[str, list[str]] = {}
        for name, where in self.steady.items():
            groups.setdefault(where, []).append(name)
        lines = [
            f"If all lamps were equally bright: {'; '.join(f'{joined([quoted(name) for name in names])} {where}' for where, names in groups.items())}."
        ]
        if self.full:
            first = {name: min(places) for name, places in self.full.items() if places}
            if first:
                low, high = min(first.values()), max(first.values())
                span = (
                    self.numbers.with_unit(low) if low == high else f"{digits(low)} to {self.numbers.with_unit(high)}"
                )
                lines.append(
                    f"The median {self.marked} lamp fills a first channel at {span}, even in the last capture."
                )
        return lines

    @property
    def picture(self) -> Picture | None:
        """Errors, and below them the usable ranges."""
        x = np.array(self.numbers.drawn)
        lines = {name: Line(x, np.maximum(error, _LEAST)) for name, error in self.errors.items()}
        zone = (self.allowed, 0.5, f"more than {one_in(self.allowed)} ")
        errors = Lines(
            "How often the two most alike are confused", self.numbers.axis, lines, self.hero, self.numbers.log, True,
            zone=zone, ticks=_TICKS, left=104,
        )  # fmt: skip
        factor, ends = self.numbers.factor, (float(x[0]), float(x[-1]))
        bars = tuple(
            Bar(
                name, tuple((factor * low, factor * high) for low, high in found), ranges_in_words(self.numbers, found),
                tuple(factor * at for at in self.strokes.get(name, ())), tuple(factor * at for at in self.full.get(name, ())),
            )
            for name, found in self.ranges.items()
        )  # fmt: skip
        usable = Bars(
            f"Where there is at most {one_in(self.allowed)}", self.numbers.axis, bars, ends, self.numbers.log, self.hero
        )
        caption = "Each lamp against all of the other states, of any brightness. Errors under 1 in a trillion are drawn as fewer."
        if self.strokes:
            caption += f" For the median {self.marked} lamp a stroke marks where a channel hands over to its next capture, a cross where its last one is full."
        return Picture(
            (errors, usable), f"Errors over {self.numbers.name}, and where there are few.", caption, columns=1
        )

    @property
    def table(self) -> Table | None:
        """Ranges and light."""
        rows = [
            (name, ranges_in_words(self.numbers, found), self.steady.get(name, ""), amount(self.light[name], "share"))
            for name, found in list(self.ranges.items())[:MOST_ROWS]
        ]
        return Table(("", "any brightness", "equal brightness", "light of the CFA"), tuple(rows))


def usable_ranges(
    x: Values, usable: Bool[BoolArray, " numbers"], passes: Float[Array, " crossings"] | None
) -> tuple[tuple[float, float], ...]:
    """Return the ranges in which something holds, by its computed crossings if they fit, else by the numbers alone.

    A range that goes on beyond the numbers ends at infinity.
    """
    if passes is not None and passes.size % 2 == int(usable[0] != usable[-1]):
        edges = [*([-math.inf] if usable[0] else []), *passes.tolist(), *([math.inf] if usable[-1] else [])]
        return tuple(zip(edges[::2], edges[1::2], strict=True))
    runs = np.split(np.arange(x.size), np.flatnonzero(np.diff(usable)) + 1)
    ends = [(run[0], run[-1]) for run in runs if usable[run[0]]]
    return tuple(
        (-math.inf if low == 0 else float(x[low]), math.inf if high == x.size - 1 else float(x[high]))
        for low, high in ends
    )


def ranges_in_words(numbers: Numbers, ranges: tuple[tuple[float, float], ...]) -> str:
    """Return ranges in words, their ends rounded inward; an end of what was computed is said to be one."""
    if not ranges:
        return "nowhere"
    parts, first, last = [], numbers.bare(numbers.x[0]), numbers.at(len(numbers.x) - 1)
    for low, high in ranges:
        start, stop = inward(low, up=True), inward(high, up=False)
        if math.isinf(low) and math.isinf(high):
            parts.append(f"at all computed, {first} to {last}")
        elif math.isinf(low):
            parts.append(f"at all computed, {first} to {numbers.with_unit(stop)}")
        elif math.isinf(high):
            parts.append(f"from {numbers.with_unit(start)} to {last}, the last computed")
        elif start < stop:
            parts.append(f"{digits(numbers.factor * start)} to {numbers.with_unit(stop)}")
        else:
            parts.append(f"near {numbers.with_unit((low + high) / 2)}")
    return joined(parts)


def _with_worst_error(output: Output) -> pd.DataFrame:
    """Return the rows with the worst error of any two states of lamps of unknown brightness."""
    of_pairs = [name for name, column in output.columns.items() if column.metric == CHROMATIC_ERROR]
    return output.named_rows.assign(**{CHROMATIC_ERROR: output.named_rows[of_pairs].max(axis=1)})


def _crossings(output: Output, series: str, key: str, quantity: str) -> dict[str, Values]:
    """Return the numbers at which each design has the allowed error, in order; empty for those that have it nowhere."""
    if output.crossings is None:
        return {}
    known = output.crossings[(output.crossings["series"] == series) & (output.crossings["key"] == key)]
    known = known[known["quantity"] == quantity]
    names = output.named_rows["name"].dropna().unique()
    return {str(name): np.sort(known.loc[known["name"] == name, "at"].to_numpy(dtype=float)) for name in names}


def _handovers(
    output: Output, base: str, key: str, numbers: Numbers
) -> tuple[dict[str, tuple[float, ...]], dict[str, tuple[float, ...]], str]:
    """Return where channels of an HDR pixel hand over, where their last capture is full, and of which lamps."""
    if output.handovers is None:
        return {}, {}, ""
    known = output.handovers[(output.handovers["series"] == base) & (output.handovers["key"] == key)]
    pair = output.trade_off[0].pair
    kind = str(known["signal_type"].iloc[-1]) if pair is None else pair[-1]
    known = known[(known["signal_type"] == kind) & known["at"].between(numbers.x[0], numbers.x[-1])]
    last = known["capture"].max()
    strokes, full = (
        {str(name): tuple(np.unique(part["at"])) for name, part in rows.groupby("name", sort=False)}
        for rows in (known[known["capture"] < last], known[known["capture"] == last])
    )
    return strokes, full, kind
