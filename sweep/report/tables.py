"""The tables of the report, as plain values."""

from __future__ import annotations

import numpy as np
import pandas as pd

from ..metrics.evaluate import WORST
from ..metrics.separation import CSD
from ..results.output import Output

QUANTITIES = ("sensitivity", "cfa_sensitivity")


def comparison_table(output: Output) -> pd.DataFrame:
    """Plain CFAs, named designs and the search's answer with all CSDs and sensitivities."""
    rows = output.kind("reference", "design", "search")
    return _shown(rows, ["name", "scenario", *output.distances, *QUANTITIES, *output.further, "feasible"])


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
        *QUANTITIES,
        *output.further,
        "pareto",
    ]
    return _shown(ranked, columns)


def geometry_table(output: Output) -> pd.DataFrame:
    """Object resolution of each distance scenario (the paper's Table 1)."""
    rows = [
        {
            "scenario": name,
            "distance_m": g.distance_m,
            "fov_deg": g.fov_deg,
            "object_resolution_px": round(g.object_resolution_px, 1),
        }
        for name, g in output.geometry.items()
    ]
    return pd.DataFrame(rows)


def _shown(rows: pd.DataFrame, columns: list[str]) -> pd.DataFrame:
    shown = rows[columns].copy()
    for column in columns:
        if column.removeprefix(WORST).startswith(CSD):
            shown[column] = shown[column].round(1)
        elif shown[column].dtype == np.float64:
            shown[column] = shown[column].round(4)
    several = rows["scenario"].nunique() > 1
    return shown if several else shown.drop(columns="scenario")
