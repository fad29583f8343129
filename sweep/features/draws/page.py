"""Sections of random sensors and other draws, and columns of designs."""

from __future__ import annotations

import pandas as pd

from ...camera.curve_errors import UNCLIPPED
from ...metrics.quantity import YIELD
from ...report.numbers import span
from ...report.panels import Section, axis_over
from ...report.run import Run, unit_of, words_of
from ...report.sections import Sections, by_column
from ...report.tables import Column, Marks, Table
from . import ROBUSTNESS, UNCERTAINTY, YIELDS


def uncertain(run: Run) -> Sections:
    """Yield quantiles over random sensors."""
    known = run.output.tables.get(UNCERTAINTY)
    if known is None or UNCLIPPED in run.facts.warnings:
        return
    of = known[(known["quantity"] == run.goal.name) & (known["scenario"] == run.scene)]
    axis = axis_over("", unit_of(run.goal), [*of["dn_5"], *of["dn_95"]], log=False)
    rows = {}
    for row in of.to_dict("records"):
        ends = float(row["dn_5"]), float(row["dn_95"])
        ratio = span([row["ratio_5"], row["ratio_95"]]) if row["name"] != run.reference else ""
        rows[str(row["name"])] = {
            "track": Marks([ends], (), span(ends, unit_of(run.goal))),
            "ratio": ratio,
            "least": ends[0],
        }
    columns = {
        "track": Column(f"{words_of(run.goal)}, 5 to 95 % of random sensors", axis=axis),
        "ratio": Column(f"times {run.reference} of the same sensor"),
        "least": Column("95 % have", unit_of(run.goal), "more", promise=True),
    }
    if rows:
        table = Table.of(by_column(columns, rows), reference=run.reference, hero=run.hero)
        yield Section("If the sensor's curves are uncertain", table, note="Before clipping and rounding.")


def yields(run: Run) -> Sections:
    """Yield what a share of other random lamps and cameras has."""
    known = run.output.tables.get(YIELDS)
    if known is None:
        return
    of = known[known["scenario"] == run.scene]
    for name, part in of.groupby("quantity", sort=False):
        column, share = run.output.columns[str(name)], float(part["share"].iloc[0])
        axis = axis_over("", unit_of(column), [*part["dn_low"], *part["dn_high"]], log=False)
        rows = {
            str(row["name"]): {
                "track": Marks(
                    [(row["dn_low"], row["dn_high"])], (), span((row["dn_low"], row["dn_high"]), unit_of(column))
                ),
                "dn": float(row["dn"]),
            }
            for row in part.to_dict("records")
        }
        what = f"{100 * share:.10g} % of {int(part['draws'].iloc[0]):,} other draws have"
        columns = {
            "dn": Column(what, unit_of(column), "more", promise=True),
            "track": Column("95 % interval of that", axis=axis),
        }
        table = Table.of(by_column(columns, rows), reference=run.reference, hero=run.hero)
        yield Section(f"On other random draws: {words_of(column)}", table, note="Before clipping and rounding.")


def _with_robustness(table: pd.DataFrame, of_designs: pd.DataFrame) -> pd.DataFrame:
    """Add how far tolerances may grow."""
    return table.merge(of_designs.drop(columns="filter_id", errors="ignore"), on="design_id", how="left")


def _with_judged(table: pd.DataFrame, yields: pd.DataFrame) -> pd.DataFrame:
    """Put the yields of other draws in the place of those that chose the designs, where they were computed."""
    rows = {design_id: at for at, design_id in table["design_id"].items()}
    for known in yields.to_dict("records"):
        if known["design_id"] in rows:
            table.loc[rows[known["design_id"]], YIELD + known["quantity"]] = known["dn"]
    return table


SECTIONS = {uncertain: 80, yields: 90}
ROWS = {ROBUSTNESS: _with_robustness, YIELDS: _with_judged}
