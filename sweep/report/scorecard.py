"""Gains and losses of designs in the tasks of a study: one table, and factors in one plot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from ..base.types import Array, Num, PerDesign
from ..metrics.columns.tasks import PREFIX
from ..metrics.quantity import Column
from ..results.output import Output
from ..results.tables import REFERENCE
from .figures import CURVE_CYCLE, canvas, legend_beside
from .leaders import label

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_MARKERS = "osD^vPX*"
_MOST_FACTOR = 10.0
_MOST_NAMED = 4
"""Gains that a sentence names; of more it says how many."""
_SAME = 1e-9
"""Designs whose values differ by less, relative to the largest, differ by rounding alone."""


@dataclass(frozen=True)
class ScoreRow:
    """Figure of a task over the designs.

    `values`: values; NaN where a design has none; `best`, `worst`: designs with the best and the worst value; empty if
    all are equal.
    """

    column: Column
    values: Num[Array, " designs"]
    best: frozenset[int]
    worst: frozenset[int]

    @property
    def cells(self) -> list[tuple[str, str]]:
        """Text and mark of each design: `best`, `worst` or nothing."""
        return [
            (
                "-" if np.isnan(value) else f"{value:.{self.column.digits}f}",
                "best" if at in self.best else "worst" if at in self.worst else "",
            )
            for at, value in enumerate(self.values)
        ]

    @property
    def factors(self) -> PerDesign:
        """Factors by which designs are better than the first; NaN where they are undefined."""
        of = self.values[0]
        ratio = np.full(self.values.shape, np.nan)
        is_positive = (self.values > 0) & (of > 0) & bool(self.best)
        np.divide(self.values, of, out=ratio, where=is_positive)
        return ratio if self.column.direction == "more" else 1 / ratio


@dataclass(frozen=True)
class Scorecard:
    """All rows of a scorecard, and names of the designs; the first is the plain CFA that factors are relative to."""

    names: tuple[str, ...]
    rows: tuple[ScoreRow, ...]


def scorecard(output: Output) -> Scorecard | None:
    """Return the scores of plain CFAs, named designs and the answer in the first scenario.

    None without tasks.
    """
    columns = [c for c in output.columns.values() if c.metric.startswith(PREFIX) and not c.extreme]
    if columns:
        from ..metrics.tasks.figures import FIGURES  # noqa: PLC0415  (few studies have tasks)

        first = {PREFIX + figure.what for figures in FIGURES.values() for figure in figures if figure.first}
        columns = [column for column in columns if column.metric in first]
    rows = output.named_rows[
        (output.named_rows["scenario"] == output.scenarios[0]) & (output.named_rows["status"] == "ok")
    ]
    if not columns or rows.empty:
        return None
    # The reference, the designs that are judged, and the other plain CFAs.
    plain = rows["kind"] == REFERENCE
    rows = pd.concat([rows[plain].head(1), rows[~plain], rows[plain].iloc[1:]])
    names = tuple(label(row) for row in rows.to_dict("records"))
    return Scorecard(names, tuple(_row(column, rows[column.name].to_numpy(dtype=float)) for column in columns))


def _row(column: Column, values: Num[Array, " designs"]) -> ScoreRow:
    known = values[np.isfinite(values)]
    if not known.size or np.ptp(known) <= _SAME * np.abs(known).max() or np.abs(known).max() < 10.0**-column.digits:
        return ScoreRow(column, values, frozenset(), frozenset())
    ends = (known.max(), known.min()) if column.direction == "more" else (known.min(), known.max())
    best, worst = (frozenset(np.flatnonzero(values == end).tolist()) for end in ends)
    return ScoreRow(column, values, best, worst)


def score_lines(card: Scorecard | None) -> list[str]:
    """Return the numbers of best and worst figures of each design, in one line."""
    if card is None:
        return []
    marked = [row for row in card.rows if row.best]
    best = [sum(at in row.best for row in marked) for at in range(len(card.names))]
    worst = [sum(at in row.worst for row in marked) for at in range(len(card.names))]
    order = sorted(range(len(card.names)), key=lambda at: (-best[at], worst[at]))
    counts = "; ".join(f"{card.names[at]} {best[at]} and {worst[at]}" for at in order[1:])
    lines = _against(card, marked)
    equal = [row.column.words for row in card.rows if not row.best]
    lines += [f"Equal in all: {', '.join(equal)}."] if equal else []
    return [
        f"{card.names[order[0]]} is best in {best[order[0]]} of {len(marked)} figures of tasks and worst in "
        f"{worst[order[0]]}; the others, best and worst: {counts}.",
        *lines,
    ]


def _against(card: Scorecard, rows: Sequence[ScoreRow]) -> list[str]:
    """Return where, or how often, other designs are better than the first, in one line; equal ones together."""
    reference, *others = card.names
    alike: dict[tuple[str, int], list[str]] = {}
    for at, name in enumerate(others, 1):
        signs = [
            np.sign(row.values[at] - row.values[0]) * (1 if row.column.direction == "more" else -1) for row in rows
        ]
        gains = [row.column.words for row, sign in zip(rows, signs, strict=True) if sign > 0]
        better = f"in {len(gains)}" + (f" ({', '.join(gains)})" if 0 < len(gains) <= _MOST_NAMED else "")
        alike.setdefault((better, sum(sign < 0 for sign in signs)), []).append(name)
    parts = [f"{', '.join(names)} {better} and {worse}" for (better, worse), names in alike.items()]
    return [f"Better and worse than {reference}: {'; '.join(parts)}."]


def draw_scorecard(card: Scorecard) -> Figure:
    """Draw factors relative to the reference, one line per figure; better is to the right."""
    drawn = [(row.column.words, row.factors) for row in card.rows]
    drawn = [(words, factors) for words, factors in drawn if np.isfinite(factors).sum() > 1]
    figure, axes = canvas(9.0, 1.4 + 0.27 * len(drawn))
    for at, name in enumerate(card.names):
        x = np.clip([factors[at] for _, factors in drawn], 1 / _MOST_FACTOR, _MOST_FACTOR)
        marker, color = _MARKERS[at % len(_MARKERS)], CURVE_CYCLE[at % len(CURVE_CYCLE)]
        axes.plot(x, np.arange(len(drawn)), marker, color=color, label=name, markersize=5.5, alpha=0.85)
    axes.axvline(1.0, color="#666666", linewidth=1.0)
    axes.set_xscale("log")
    axes.set_xlim(0.9 / _MOST_FACTOR, 1.1 * _MOST_FACTOR)
    axes.set_yticks(np.arange(len(drawn)), [words for words, _ in drawn], fontsize=8)
    axes.invert_yaxis()
    axes.grid(axis="y", color="#eeeeee")
    axes.set_xlabel(f"times better than {card.names[0]} (beyond {_MOST_FACTOR:g} times: at the edge)")
    legend_beside(axes)
    return figure
