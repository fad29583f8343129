"""Gains and losses of the best design against the plain CFA with the largest separation."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd

from ..metrics.columns.chromatic import CHROMATIC_CSD
from ..metrics.columns.sensitivity import CFA_SENSITIVITY
from ..metrics.quantity import Column
from ..results.output import Output
from ..spectra.lights import pair_name
from .leaders import capital, label, leaders_of

_TASKS = ("low_light_lux_led", "low_light_lux_a", "color_delta_e_mean_d65", "color_delta_e_mean_a")
_SAME = 0.005
"""Relative difference below which a figure is neither gain nor loss."""


def price_table(output: Output) -> pd.DataFrame:
    """Return gains and losses of the best design beside the plain CFA with the largest separation.

    Returns one row per figure: separation, chromatic separation, light, tasks of color and low light, and the smallest
    other CSD of a pair. Empty without tasks.
    """
    leaders, separation = leaders_of(output), output.trade_off[0]
    best, plain = leaders.chosen, leaders.plain
    if best is None or plain is None or not any(name in output.columns for name in _TASKS):
        return pd.DataFrame()
    names = [separation.name, CFA_SENSITIVITY, *_TASKS]
    if separation.pair is not None:
        names.insert(1, pair_name(CHROMATIC_CSD, separation.pair))
    others = [name for name in output.distances if name != separation.name and best[name] > 0]
    if others:
        names.append(min(others, key=lambda name: float(best[name] / plain[name])))
    rows = []
    for name in dict.fromkeys(names):
        values = (float(plain.get(name, np.nan)), float(best.get(name, np.nan)))
        if name in output.columns and all(math.isfinite(value) and value > 0 for value in values):
            rows.append(_row(output.columns[name], *values))
    return pd.DataFrame(rows, columns=["", label(plain), label(best), "factor", "effect"])


def _row(column: Column, plain: float, best: float) -> tuple[str, str, str, str, str]:
    better = best > plain if column.direction == "more" else best < plain
    effect = "same" if abs(best / plain - 1) < _SAME else "gain" if better else "loss"
    unit = f" {column.unit}" if column.unit and column.unit != "1" else ""
    plain_text, best_text = (f"{value:.{_digits(value)}f}{unit}" for value in (plain, best))
    return column.words, plain_text, best_text, f"{best / plain:.2f}", effect


def _digits(value: float) -> int:
    return 0 if value >= 100 else 1 if value >= 1 else 3


def price_line(output: Output) -> str:
    """Return gains and losses in one sentence.

    Empty without a table.
    """
    table = price_table(output)
    if table.empty:
        return ""
    _, plain, best, *_ = table.columns
    parts = {
        effect: "; ".join(f"{row.iloc[0]} {row.iloc[2]} for {row.iloc[1]}" for _, row in rows.iterrows())
        for effect, rows in table.groupby("effect", sort=False)
    }
    texts = [f"{effect}: {parts[effect]}" for effect in ("gain", "loss") if effect in parts]
    return f"{capital(best)} against {plain}. {'. '.join(text.capitalize()[:1] + text[1:] for text in texts)}."
