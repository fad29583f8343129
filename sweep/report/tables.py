"""Tables of the report, as data frames."""

from __future__ import annotations

import pandas as pd

from ..camera.scene import OBJECT_RESOLUTION
from ..metrics.columns.sensitivity import CFA_SENSITIVITY
from ..metrics.limiting import limited_by_name
from ..results.output import Output
from .pages import aligned

PUBLISHED_CSV, PUBLISHED_PARQUET = "paper_comparison.csv", "paper_comparison.parquet"
_MAX_PARAMETERS = 7
"""Columns of design parameters that a table shows."""
_DIGITS = 4
"""Decimal places of columns that have no `Column`: design parameters."""


def comparison_table(output: Output) -> pd.DataFrame:
    """Return the table that compares plain CFAs, named designs and the answer of the search.

    Returns one row per design and scenario: name, CSDs, sensitivities, limiting lights, feasibility.
    """
    rest = [*output.light, *output.further, *output.distances]
    return _shown(output, output.named_rows, ["name", "scenario"], [*rest, "feasible"])


def best_table(output: Output, max_rows: int = 12) -> pd.DataFrame:
    """Return the table of the best feasible designs, best first.

    `max_rows`: largest number of rows if the study has one scenario. With several scenarios: one row, the best design,
    per scenario and CFA.
    """
    ranked = output.best.head(max_rows)
    if len(output.scenarios) > 1:
        ranked = output.best.groupby(["scenario", "cfa"], sort=False, observed=True).head(1)
    # A parameter that all designs share is no news; a single design shows all of its parameters.
    varied = [name for name in output.parameters if len(ranked) == 1 or ranked[name].nunique() > 1]
    rest = [*varied[:_MAX_PARAMETERS], *output.light, *output.further, "pareto"]
    return _shown(output, ranked, ["filter_id", "kind", "cfa", "scenario"], rest)


def _shown(output: Output, rows: pd.DataFrame, keys: list[str], rest: list[str]) -> pd.DataFrame:
    """Return rows of the result table for display: columns selected, rounded and renamed.

    Order of the columns: `keys`, both axes of the trade-off, `rest` without the former, limiting lights.
    """
    separation = output.trade_off[0]
    axes = [separation.name, CFA_SENSITIVITY]
    limits = [limited_by_name(separation.pair)] if separation.pair and separation.role == "separation" else []
    columns = [*keys, *axes, *(name for name in rest if name not in axes), *limits]
    shown = rows[columns].copy()
    for column in shown.select_dtypes("float64"):
        quantity = output.columns.get(str(column))
        shown[column] = shown[column].round(_DIGITS if quantity is None else quantity.digits)
    if rows["scenario"].nunique() <= 1:
        shown = shown.drop(columns="scenario")
    titles = {name: output.words(name).replace("_", " ") for name in columns}
    titles |= dict.fromkeys(limits, f"{separation.words} limited by")
    return shown.rename(columns=titles)


def costliest_omission(output: Output, max_rows: int = 10) -> pd.DataFrame:
    """Return the lights whose omission from the search lowers the objective most.

    Returns one row per objective and left-out light, with `seen`, `with_it` and `fall` as in `left_out_table`, in the
    unit of the objective. Empty if the run left out no light.
    """
    if output.left_out is None:
        return pd.DataFrame()
    worst = output.left_out.nlargest(max_rows, "fall").round(1)
    return worst.assign(objective=[output.words(name) for name in worst["objective"]])


def geometry_table(output: Output) -> pd.DataFrame:
    """Return the object resolution of each distance scenario (paper, Table 1).

    Returns one row per distance scenario: scenario, distance_m, fov_deg (degrees), object_resolution_px (pixels across
    the light).
    """
    rows = [
        {
            "scenario": name,
            "distance_m": geometry.distance_m,
            "fov_deg": geometry.fov_deg,
            "object_resolution_px": round(geometry.object_resolution_px, 1),
        }
        for name, geometry in output.study.geometry.items()
    ]
    return pd.DataFrame(rows)


def comparison_with_published(output: Output) -> pd.DataFrame:
    """Compare each published value with the value of this run in the first scenario.

    Returns one row per published value: table, cfa (for the object resolution, the distance scenario), quantity, paper
    (published value), ours (rounded to the decimal places printed in the paper), error (ours - paper), relative_error
    (error / paper. None if paper is 0), ours_exact (not rounded).
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
                printed_digits = len(f"{paper:g}".partition(".")[2])
                ours = round(exact, printed_digits)
                error = round(ours - paper, 12)  # 12 decimal places remove the rounding of binary floats
                rows.append((table, name, quantity, paper, ours, error, error / paper if paper else None, exact))
    columns = ["table", "cfa", "quantity", "paper", "ours", "error", "relative_error", "ours_exact"]
    return pd.DataFrame(rows, columns=columns)


def comparison_lines(comparison: pd.DataFrame) -> list[str]:
    """Format the comparison as text: our values, with the published values in parentheses."""
    lines = []
    for name, rows in comparison.groupby("table", sort=False):
        cells = rows["ours"].map("{:g}".format) + rows["paper"].map(" ({:g})".format)
        wide = rows.assign(cells=cells).pivot(index="quantity", columns="cfa", values="cells").fillna("")
        wide = wide.loc[rows["quantity"].unique(), rows["cfa"].unique()].reset_index()
        lines += [f"{name}, ours (printed):", *aligned(wide)]
    return lines
