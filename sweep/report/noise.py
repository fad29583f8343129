"""What noise does to the states of a study: figures, the level up to which each design is usable, recognition."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
import pandas as pd

from ..base.types import BoolArray, FloatArray
from ..metrics.classifiers import CLASSIFIERS
from ..metrics.columns.confusion import D_PRIME, STATE_ERROR, STATE_ERROR_BOUND
from ..metrics.recognition import MOST_LIKELY
from ..results.output import Output
from ..study.axes import series_of
from .series import Line, SeriesFigure, quantity_of
from .values import over_series, series_figures

_LEAST = 1e-12
_ERROR = "error of the worst pair of states"
_COMPUTED = (
    "Computed, not drawn: how often noise makes one of two signals of different states look like the other, for the "
    "two that are confused most. The dashed line is the error that the study allows; a ring marks where a design "
    "passes it."
)
_COUNTED = (
    "Counted: of raw patches drawn with noise, of all signals, the share whose state a classifier says that was "
    "trained on others. It is of all signals, the error above of the two that are confused most: neither follows from "
    "the other."
)
_RULE_NAMES = {MOST_LIKELY: "most likely signal", "nearest_centroid": "nearest centroid", "lda": "LDA"}


def _allowed(output: Output) -> float | None:
    """The largest error at which a design is usable; None in a study that does not ask."""
    asked = output.study.recognition
    return None if asked is None else asked.error_max


def all_series(output: Output) -> list[SeriesFigure]:
    """Every figure of a quantity over scenarios: errors and accuracies, if asked for, then separations."""
    return [*noise_figures(output), *series_figures(output)]


def noise_figures(output: Output) -> list[SeriesFigure]:
    """For each series of scenarios the error of the worst pair of states, and accuracies of classifiers on patches."""
    return output.once("noise over series", lambda: list(_noise_figures(output)))


def _noise_figures(output: Output) -> Iterator[SeriesFigure]:
    allowed = _allowed(output)
    if allowed is None:
        return
    rows = output.few
    for (base, key), scenarios in series_of(output.scenarios).items():
        x = np.array(list(scenarios.values()))
        where = f"{output.study.study}, {base}"
        errors = {
            n: Line(np.maximum(y, _LEAST), None, _crossing(output, base, key, n))
            for n, y in over_series(rows, scenarios, STATE_ERROR).items()
        }
        label = f"{_ERROR} ({_LEAST:g}: or less)"
        title = f"{where}: {_ERROR}"
        yield SeriesFigure(title, key, label, x, errors, "", log_y=True, level=allowed, note=_COMPUTED)
        for rule in CLASSIFIERS if output.recognition is not None else ():
            lines = {n: Line(y, None) for n, y in _accuracies(output, scenarios, rule).items()}
            label = f"accuracy of {_RULE_NAMES[rule]} on raw patches"
            yield SeriesFigure(
                f"{where}: {label}",
                key,
                label,
                x,
                lines,
                "",
                from_zero=False,
                note=_COUNTED,
            )


def _accuracies(output: Output, scenarios: dict[str, float], rule: str) -> dict[str, FloatArray]:
    assert output.recognition is not None
    return over_series(output.recognition, scenarios, f"{rule}_accuracy")


def usable_lines(output: Output) -> Iterator[str]:
    """For each series of scenarios, the numbers at which each design is usable; designs with the same ones together."""
    allowed = _allowed(output)
    if allowed is None:
        return
    rows = output.few
    for (base, key), scenarios in series_of(output.scenarios).items():
        name, unit = quantity_of(key)
        x = np.array(list(scenarios.values()))
        ranges: dict[str, list[str]] = {}
        for design, errors in over_series(rows, scenarios, STATE_ERROR).items():
            crossing = _crossing(output, base, key, design)
            where = _range(x, errors <= allowed, unit, None if crossing is None else crossing[0])
            ranges.setdefault(where, []).append(design)
        found = [f"{_listed(designs)} {where}" for where, designs in ranges.items()]
        if found:
            what = f"noise confuses the worst two states at most {allowed:g} of the time"
            yield f"Over {name}, {what}: {'; '.join(found)}."


def _listed(names: Sequence[str]) -> str:
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


def _range(x: FloatArray, usable: BoolArray, unit: str, crossing: float | None) -> str:
    """Where among the numbers `x` (ascending) a design is usable, in words.

    Where that ends once, by the computed `crossing`, rounded to the side where it is usable; without one, by the two
    numbers between which it ends.
    """
    if usable.all():
        return "everywhere"
    if not usable.any():
        return "nowhere"
    ends = np.flatnonzero(np.diff(usable))
    of = f" of {unit}" if " " in unit else f" {unit}".rstrip()
    if len(ends) > 1:
        return f"at {' '.join(f'{v:g}' for v in x[usable])}{of}"
    low, high = x[ends[0] : ends[0] + 2]
    word = "up to" if usable[0] else "from"
    if crossing is None:
        return f"{word} a number between {low:g} and {high:g}{of}"
    return f"{word} {_rounded(crossing, up=not usable[0])}{of}"


def _rounded(value: float, *, up: bool) -> str:
    """Three digits of a number, rounded to one side; also where the last ones are 0."""
    unit = 10.0 ** (math.floor(math.log10(abs(value))) - 2) if value else 1.0
    rounded = (math.ceil if up else math.floor)(value / unit * (1 - 1e-12)) * unit
    text = f"{rounded:#.3g}".removesuffix(".")
    return f"{float(text):g}" if "e" in text else text


def _crossing(output: Output, series: str, key: str, design: str) -> tuple[float, float] | None:
    """The number at which a design's error is what is allowed, and its error there, as the run has computed them."""
    return output.once("crossings", partial(_crossings, output)).get((series, key, design))


def _crossings(output: Output) -> dict[tuple[str, str, str], tuple[float, float]]:
    """The same of each series, key and design."""
    if output.crossings is None:
        return {}
    known = output.crossings.dropna(subset=["at", "error"])
    return {(row["series"], row["key"], row["name"]): (row["at"], row["error"]) for row in known.to_dict("records")}


@dataclass(frozen=True)
class UsableEnds:
    """Where designs reach the largest error that is allowed over one number of the scenarios; the best one first.

    `name`, `unit`: of the number. `more`: the best one bears the largest number, else it needs the smallest.
    """

    name: str
    unit: str
    error_max: float
    more: bool
    at: dict[str, float]

    def told(self, design: str) -> str:
        """Where a design stops being usable, rounded to the side where it is usable; without its unit."""
        return _rounded(self.at[design], up=not self.more)


def usable_ends(output: Output) -> Iterator[UsableEnds]:
    """For each series of scenarios where designs stop being usable.

    None where one is usable everywhere, or somewhere with an end that is not known: it may be the best one.
    """
    allowed = _allowed(output)
    for series in noise_figures(output):
        usable = {} if allowed is None else {n: line for n, line in series.lines.items() if (line.y <= allowed).any()}
        ends = {name: line.passes[0] for name, line in usable.items() if line.passes is not None}
        if allowed is None or not ends or len(ends) < len(usable):
            continue
        sides = {bool(series.lines[name].y[0] <= allowed) for name in ends}
        if len(sides) == 1:
            more = sides.pop()
            ordered = sorted(ends, key=lambda name: -ends[name] if more else ends[name])
            yield UsableEnds(*series.quantity, allowed, more, {name: ends[name] for name in ordered})


def told_apart_table(output: Output) -> pd.DataFrame:
    """Errors in closed form and accuracies on drawn patches, a row per design and scenario."""
    if _allowed(output) is None:
        return pd.DataFrame()
    rows = output.few
    dprime = [name for name, column in output.columns.items() if column.metric == D_PRIME]
    shown = pd.DataFrame({"name": rows["name"].astype(str), "scenario": rows["scenario"].astype(str)})
    shown["smallest d'"] = rows[dprime].min(axis=1).map("{:.2f}".format)
    for column, label in ((STATE_ERROR, _ERROR), (STATE_ERROR_BOUND, "bound of the error")):
        shown[label] = rows[column].map("{:.2g}".format)
    drawn = output.recognition
    if drawn is not None:
        by_id = drawn.set_index("design_id").reindex(rows["design_id"])
        for rule in (MOST_LIKELY, *CLASSIFIERS):
            low, high = by_id[f"{rule}_accuracy_low"], by_id[f"{rule}_accuracy_high"]
            values = zip(by_id[f"{rule}_accuracy"], low, high, strict=True)
            shown[f"accuracy, {_RULE_NAMES[rule]}"] = [f"{v:.4f} ({a:.4f} to {b:.4f})" for v, a, b in values]
    return shown
