"""The tables of the report, as plain values."""

from __future__ import annotations

import numpy as np
import pandas as pd

from ..metrics.columns.sensitivity import CFA_SENSITIVITY
from ..metrics.limiting import limited_by_name
from ..metrics.quantity import HELD_OUT
from ..results.output import Output

_MOST_PARAMETERS = 7
_DIGITS = 4
"""Of columns that are no quantities."""


def comparison_table(output: Output) -> pd.DataFrame:
    """Plain CFAs, named designs and the search's answer with all CSDs, sensitivities and the lights that limit them."""
    columns = ["name", "scenario", *_first(output), *_held_out(output), *_rest(output), "feasible", *_limits(output)]
    return _shown(output, output.few, columns)


def best_table(output: Output, most: int = 12) -> pd.DataFrame:
    """Best feasible designs with their parameters: the first ones, or over several scenarios the best of each CFA."""
    ranked = output.best.head(most)
    if len(output.scenarios) > 1:
        ranked = output.best.groupby(["scenario", "cfa"], sort=False, observed=True).head(1)
    used = [name for name in output.parameters if ranked[name].nunique() > 1 or len(ranked) == 1]
    keys = ["filter_id", "kind", "cfa", "scenario"]
    asked = [name for name in (*output.light, *output.further) if name not in _first(output)]
    columns = [
        *keys,
        *_first(output),
        *_held_out(output),
        *used[:_MOST_PARAMETERS],
        *asked,
        "pareto",
        *_limits(output),
    ]
    return _shown(output, ranked, columns)


def _first(output: Output) -> list[str]:
    """The separation of the trade-off and the light of the CFA."""
    return [output.trade_off[0].name, CFA_SENSITIVITY]


def _rest(output: Output) -> list[str]:
    """All other CSDs and sensitivities, and what constraints and objective name."""
    return [n for n in (*output.light, *output.further, *output.distances) if n not in _first(output)]


def _limits(output: Output) -> list[str]:
    """The column of the two lights that limit the separation of the trade-off."""
    pair = output.trade_off[0].pair
    return [] if pair is None else [limited_by_name(pair)]


def _held_out(output: Output) -> list[str]:
    """Columns of the CSDs of other lights, of those that the study asks for."""
    return [name for each in output.distances if (name := HELD_OUT + each) in output.table]


def worst_left_out(output: Output, most: int = 10) -> pd.DataFrame:
    """The lights whose absence from the search costs most."""
    if output.left_out is None:
        return pd.DataFrame()
    worst = output.left_out.nlargest(most, "fall").round(1)
    return worst.assign(objective=[output.words(name) for name in worst["objective"]])


def geometry_table(output: Output) -> pd.DataFrame:
    """Object resolution of each distance scenario (the paper's Table 1)."""
    rows = [
        {
            "scenario": name,
            "distance_m": g.distance_m,
            "fov_deg": g.fov_deg,
            "object_resolution_px": round(g.object_resolution_px, 1),
        }
        for name, g in output.study.geometry.items()
    ]
    return pd.DataFrame(rows)


def _shown(output: Output, rows: pd.DataFrame, columns: list[str]) -> pd.DataFrame:
    shown = rows[columns].copy()
    for column in columns:
        if shown[column].dtype == np.float64:
            own = output.columns.get(column)
            shown[column] = shown[column].round(_DIGITS if own is None else own.digits)
    several = rows["scenario"].nunique() > 1
    shown = shown if several else shown.drop(columns="scenario")
    words = {name: output.words(name).replace("_", " ") for name in columns}
    separation = output.trade_off[0]
    words |= dict.fromkeys(_limits(output), f"{separation.words} limited by")
    words |= {name: f"{output.words(name.removeprefix(HELD_OUT))}, other lights" for name in _held_out(output)}
    return shown.rename(columns=words)
