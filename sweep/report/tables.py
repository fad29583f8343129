"""Tables of the report, as plain values."""

from __future__ import annotations

import pandas as pd

from ..camera.scene import OBJECT_RESOLUTION
from ..metrics.columns.sensitivity import CFA_SENSITIVITY
from ..metrics.limiting import limited_by_name
from ..metrics.quantity import HELD_OUT
from ..results.output import Output
from .pages import aligned

_MOST_PARAMETERS = 7
_DIGITS = 4
"""Digits of columns that are no quantities."""


def comparison_table(output: Output) -> pd.DataFrame:
    """Return plain CFAs, named designs and the answer with CSDs, sensitivities and limiting lights.

    Parameters
    ----------
    output : Output
        Finished run.

    Returns
    -------
    pandas.DataFrame
        Table.
    """
    rest = [*output.light, *output.further, *output.distances]
    return _shown(output, output.few, ["name", "scenario"], [*rest, "feasible"])


def best_table(output: Output, most: int = 12) -> pd.DataFrame:
    """Return the best feasible designs with their parameters; over several scenarios the best of each CFA.

    Parameters
    ----------
    output : Output
        Finished run.
    most : int
        Rows at most.

    Returns
    -------
    pandas.DataFrame
        Table.
    """
    ranked = output.best.head(most)
    if len(output.scenarios) > 1:
        ranked = output.best.groupby(["scenario", "cfa"], sort=False, observed=True).head(1)
    used = [name for name in output.parameters if ranked[name].nunique() > 1 or len(ranked) == 1]
    rest = [*used[:_MOST_PARAMETERS], *output.light, *output.further, "pareto"]
    return _shown(output, ranked, ["filter_id", "kind", "cfa", "scenario"], rest)


def _shown(output: Output, rows: pd.DataFrame, keys: list[str], rest: list[str]) -> pd.DataFrame:
    """Return keys, separation and light of the trade-off, other CSDs, further columns, and limiting lights."""
    separation = output.trade_off[0]
    first = [separation.name, CFA_SENSITIVITY]
    held_out = [name for distance in output.distances if (name := HELD_OUT + distance) in output.table]
    limits = [] if separation.pair is None else [limited_by_name(separation.pair)]
    columns = [*keys, *first, *held_out, *(name for name in rest if name not in first), *limits]
    shown = rows[columns].copy()
    for column in shown.select_dtypes("float64"):
        quantity = output.columns.get(str(column))
        shown[column] = shown[column].round(_DIGITS if quantity is None else quantity.digits)
    if rows["scenario"].nunique() <= 1:
        shown = shown.drop(columns="scenario")
    words = {name: output.words(name).replace("_", " ") for name in columns}
    words |= dict.fromkeys(limits, f"{separation.words} limited by")
    words |= {name: f"{output.words(name.removeprefix(HELD_OUT))}, other lights" for name in held_out}
    return shown.rename(columns=words)


def costliest_omission(output: Output, most: int = 10) -> pd.DataFrame:
    """Return the lights whose absence from the search costs most.

    Parameters
    ----------
    output : Output
        Finished run.
    most : int
        Rows at most.

    Returns
    -------
    pandas.DataFrame
        Table.
    """
    if output.left_out is None:
        return pd.DataFrame()
    worst = output.left_out.nlargest(most, "fall").round(1)
    return worst.assign(objective=[output.words(name) for name in worst["objective"]])


def geometry_table(output: Output) -> pd.DataFrame:
    """Return the object resolution of each distance scenario (paper, Table 1).

    Parameters
    ----------
    output : Output
        Finished run.

    Returns
    -------
    pandas.DataFrame
        Table.
    """
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


PUBLISHED_CSV, PUBLISHED_PARQUET = "paper_comparison.csv", "paper_comparison.parquet"


def comparison_with_published(output: Output) -> pd.DataFrame:
    """Return one row per published figure, with ours and the error.

    Columns: table, cfa (or geometry), quantity, paper, ours, error, relative_error, ours_exact.

    `ours` is rounded to the printed digits, and `error` is its difference; `ours_exact` is not rounded. Values are of
    the first scenario.

    Parameters
    ----------
    output : Output
        Finished run.

    Returns
    -------
    pandas.DataFrame
        Table.
    """
    named = output.named[output.named["scenario"] == output.scenarios[0]].set_index("name")
    rows = []
    for table, entries in output.study.published.items():
        for name, values in entries.items():
            for quantity, paper in values.items():
                if quantity == OBJECT_RESOLUTION:
                    exact = output.study.geometry[name].object_resolution_px
                else:
                    exact = float(named[quantity][name])
                printed = len(f"{paper:g}".partition(".")[2])
                ours = round(exact, printed)
                error = round(ours - paper, 12)
                rows.append((table, name, quantity, paper, ours, error, error / paper if paper else None, exact))
    columns = ["table", "cfa", "quantity", "paper", "ours", "error", "relative_error", "ours_exact"]
    return pd.DataFrame(rows, columns=columns)


def comparison_lines(comparison: pd.DataFrame) -> list[str]:
    """Return the comparison as text: our figures, with the printed ones in brackets.

    Parameters
    ----------
    comparison : pandas.DataFrame
        Result of `comparison_with_published`.

    Returns
    -------
    list of str
        Lines.
    """
    lines = []
    for name, rows in comparison.groupby("table", sort=False):
        cells = rows["ours"].map("{:g}".format) + rows["paper"].map(" ({:g})".format)
        wide = rows.assign(cells=cells).pivot(index="quantity", columns="cfa", values="cells").fillna("")
        wide = wide.loc[rows["quantity"].unique(), rows["cfa"].unique()].reset_index()
        lines += [f"{name}, ours (printed):", *aligned(wide)]
    return lines
