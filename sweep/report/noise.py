"""Effects of noise on the states of a study: figures, usable ranges, table."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import numpy as np
import pandas as pd

from ..base.types import Array, Bool, BoolArray, Float, PerValue
from ..metrics.columns.chromatic import CHROMATIC_ERROR
from ..metrics.columns.confusion import D_PRIME, STATE_ERROR, STATE_ERROR_BOUND
from ..results.output import Output
from ..spectra.lights import Pair
from ..study.axes import series_of
from .series import Line, SeriesFigure, over_series, quantity_of, series_figures

_LEAST = 1e-12
_BRIGHTNESS = {CHROMATIC_ERROR: "with lamps of unknown brightness", STATE_ERROR: "of equal brightness"}
_ERROR = "error of the worst pair of states"
_COMPUTED = (
    "Computed, not drawn: how often noise makes one of two signals of different states look like the other, for the "
    "two that are confused most. The dashed line is the error that the study allows; a ring marks where a design "
    "passes it."
)
_LEAST_DPRIME, _DRAWN_DPRIME = "d' of the worst pair of states", (0.1, 1e4)
_ANY = "error, lamps of unknown brightness"
_ANY_NOTE = (
    "A camera does not know how bright a lamp is: each signal is compared with those of other states of any "
    "brightness, by Gaussians with the noise of both. The dashed line is the error that the study allows; a ring marks "
    "where a design passes it."
)
_HANDOVERS = (
    "A stroke marks where a channel hands over to its next capture, or is saturated, for the median {kind} lamp."
)


def all_series(output: Output) -> list[SeriesFigure]:
    """Return every figure of a quantity over scenarios: errors, if requested, then separations."""
    figures = [*_noise_figures(output), *series_figures(output)]
    if output.handovers is not None:
        figures = [_with_handovers(figure, output.handovers, output.trade_off[0].pair) for figure in figures]
    return figures


def _with_handovers(figure: SeriesFigure, handovers: pd.DataFrame, pair: Pair | None) -> SeriesFigure:
    """Mark where channels of an HDR pixel hand over to their next capture, or saturate."""
    known = handovers[(handovers["series"] == figure.base) & (handovers["key"] == figure.key)]
    kind = known["signal_type"].iloc[-1] if pair is None else pair[-1]
    known = known[(known["signal_type"] == kind) & known["at"].between(figure.x[0], figure.x[-1])]
    marks = {str(name): np.unique(part["at"]) for name, part in known.groupby("name", sort=False)}
    if not marks:
        return figure
    return replace(figure, marks=marks, note=f"{figure.note} {_HANDOVERS.format(kind=kind)}".strip())


def _noise_figures(output: Output) -> Iterator[SeriesFigure]:
    """Yield for each series of scenarios the error of the worst pair of states."""
    if output.study.recognition is None:
        return
    for (base, key), scenarios in series_of(output.scenarios).items():
        draw = partial(SeriesFigure, key=key, x=np.array(list(scenarios.values())), band="", base=base)
        where = f"{output.study.study}, {base}"
        allowed = output.study.recognition.error_max
        for quantity, title, note in ((CHROMATIC_ERROR, _ANY, _ANY_NOTE), (STATE_ERROR, _ERROR, _COMPUTED)):
            passes = _crossings(output, base, key, quantity)
            lines = {
                name: Line(np.maximum(error, _LEAST), None, tuple((at, allowed) for at in passes.get(name, ())))
                for name, error in over_series(_with_worst_error(output), scenarios, quantity).items()
            }
            y_label = f"{title} ({_LEAST:g}: or less)"
            yield draw(f"{where}: {title}", y_label=y_label, lines=lines, log_y=True, level=allowed, note=note)
        if output.study.pixel.captures:
            least = output.named_rows[_dprimes(output)].min(axis=1).clip(*_DRAWN_DPRIME)
            dprimes = over_series(output.named_rows.assign(**{D_PRIME: least}), scenarios, D_PRIME)
            lines = {name: Line(dprime, None) for name, dprime in dprimes.items()}
            y_label = f"{_LEAST_DPRIME} ({_DRAWN_DPRIME[0]:g}: or less)"
            yield draw(f"{where}: {_LEAST_DPRIME}", y_label=y_label, lines=lines, log_y=True)


def usable_lines(output: Output) -> Iterator[str]:
    """Yield for each series of scenarios the usable ranges of designs; equal ones together."""
    if output.study.recognition is None:
        return
    allowed = output.study.recognition.error_max
    for (base, key), scenarios in series_of(output.scenarios).items():
        name, unit = quantity_of(key)
        x = np.array(list(scenarios.values()))
        for quantity, of in (
            (CHROMATIC_ERROR, "with lamps of unknown brightness"),
            (STATE_ERROR, "of equal brightness"),
        ):
            passes, ranges = _crossings(output, base, key, quantity), dict[str, list[str]]()
            for design, errors in over_series(_with_worst_error(output), scenarios, quantity).items():
                where = usable_range(x, errors <= allowed, unit, passes.get(design))
                ranges.setdefault(where, []).append(design)
            if ranges:
                usable = "; ".join(f"{', '.join(designs)} {where}" for where, designs in ranges.items())
                yield f"At most {_rate(allowed)} between the worst two states {of}, over {name}: {usable}."


def _with_worst_error(output: Output) -> pd.DataFrame:
    """Return the rows with the worst error of any two states of lamps of unknown brightness."""
    of_pairs = [name for name, column in output.columns.items() if column.metric == CHROMATIC_ERROR]
    return output.named_rows.assign(**{CHROMATIC_ERROR: output.named_rows[of_pairs].max(axis=1)})


def _rate(allowed: float) -> str:
    """Return an error probability in words: `1 error in 1,000`."""
    one_in = round(1 / allowed)
    return f"1 error in {one_in:,}" if math.isclose(one_in * allowed, 1, rel_tol=1e-9) else f"{allowed:g} errors"


def usable_range(
    x: PerValue, usable: Bool[BoolArray, " values"], unit: str, passes: Float[Array, " passes"] | None
) -> str:
    """Return the usable range of a design in words, by the computed crossings if there are any."""
    of = f" of {unit}" if " " in unit else f" {unit}".rstrip()
    if passes is None or passes.size % 2 != int(usable[0] != usable[-1]):
        ends = np.flatnonzero(np.diff(usable))
        if not ends.size:
            return "everywhere" if usable.all() else "nowhere"
        if ends.size > 1:
            runs = [run for run in np.split(np.arange(x.size), ends + 1) if usable[run[0]]]
            return f"at {', '.join(_span(x[run[0]], x[run[-1]]) for run in runs)}{of}"
        low, high = (float(f"{end:.3g}") for end in x[ends[0] : ends[0] + 2])
        return f"{'up to' if usable[0] else 'from'} a number between {low:g} and {high:g}{of}"
    if not passes.size:
        return "everywhere" if usable[0] else "nowhere"
    edges = [-math.inf, *passes.tolist()] if usable[0] else passes.tolist()
    edges += [math.inf] if usable[-1] else []
    parts = []
    for low, high in zip(edges[::2], edges[1::2], strict=True):
        if math.isinf(low):
            parts.append(f"up to {rounded(high, up=False)}")
        elif math.isinf(high):
            parts.append(f"from {rounded(low, up=True)}")
        else:
            first, last = rounded(low, up=True), rounded(high, up=False)
            parts.append(f"from {first} to {last}" if float(first) < float(last) else f"near {(low + high) / 2:.3g}")
    return f"{' and '.join([', '.join(parts[:-1]), parts[-1]] if len(parts) > 1 else parts)}{of}"


def _span(low: float, high: float) -> str:
    return f"{low:.3g}" + (f" to {high:.3g}" if high > low else "")


def rounded(value: float, *, up: bool) -> str:
    """Return a number with three digits, rounded to one side."""
    unit = 10.0 ** (math.floor(math.log10(abs(value))) - 2) if value else 1.0
    rounded = (math.ceil if up else math.floor)(value / unit * (1 - 1e-12)) * unit
    text = f"{rounded:#.3g}".removesuffix(".")
    return f"{float(text):g}" if "e" in text else text


def _crossings(output: Output, series: str, key: str, quantity: str) -> dict[str, Float[Array, " _passes"]]:
    """Return the numbers at which each design has the allowed error, in order; empty for those that have it nowhere."""
    if output.crossings is None:
        return {}
    known = output.crossings[(output.crossings["series"] == series) & (output.crossings["key"] == key)]
    known = known[known["quantity"] == quantity]
    names = output.named_rows["name"].dropna().unique()
    return {str(name): np.sort(known.loc[known["name"] == name, "at"].to_numpy(dtype=float)) for name in names}


def _dprimes(output: Output) -> list[str]:
    """Return the columns of d'."""
    return [name for name, column in output.columns.items() if column.metric == D_PRIME]


def recognition_table(output: Output) -> pd.DataFrame:
    """Return errors, one row per design and scenario."""
    if output.study.recognition is None:
        return pd.DataFrame()
    rows = output.named_rows
    dprime = _dprimes(output)
    shown = pd.DataFrame({"name": rows["name"].astype(str), "scenario": rows["scenario"].astype(str)})
    shown["smallest d'"] = rows[dprime].min(axis=1).map("{:.2f}".format)
    for column, label in ((STATE_ERROR, _ERROR), (STATE_ERROR_BOUND, "bound of the error")):
        shown[label] = rows[column].map("{:.2g}".format)
    return shown
