"""The tables of the report, as plain values."""

from __future__ import annotations

import numpy as np
import pandas as pd

from ..results.output import Output

_DIGITS = 4
"""Of columns that are no quantities."""


def comparison_table(output: Output) -> pd.DataFrame:
    """Plain CFAs, named designs and the search's answer with all CSDs and sensitivities."""
    columns = ["name", "scenario", *output.distances, *output.light, *output.further, "feasible"]
    return _shown(output, output.few, columns)


def best_table(output: Output, most: int = 12) -> pd.DataFrame:
    """The best feasible designs with their parameters."""
    ranked = output.best.head(most)
    columns = [
        "design_id",
        "kind",
        "cfa",
        "scenario",
        *output.parameters,
        *output.distances,
        *output.light,
        *output.further,
        "pareto",
    ]
    return _shown(output, ranked, columns)


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
    return shown if several else shown.drop(columns="scenario")
