"""Section of lights that a search leaves out."""

from __future__ import annotations

from ...report.numbers import amount
from ...report.panels import Section
from ...report.run import Run, unit_of
from ...report.sections import Sections, by_column
from ...report.tables import Column, Table
from . import LEFT_OUT


def left_out(run: Run) -> Sections:
    """Yield the largest falls of the objective where a lamp was left out of the search."""
    of = run.output.tables.get(LEFT_OUT)
    if of is None:
        return
    worst = of.sort_values("fall", ascending=False).head(6)
    rows = {
        str(row["signal"]): {"kept": row["objective"] - row["fall"], "fall": row["fall"]}
        for row in worst.to_dict("records")
    }
    unit = unit_of(run.output.goal)
    columns = {"kept": Column("with that lamp again", unit), "fall": Column("less than with it in the search", unit)}
    yield Section(
        "Searched without one lamp",
        Table.of(by_column(columns, rows), head="lamp"),
        note=f"Mean of all {len(of)}: {amount(float(of['fall'].mean()), unit)} less; leave_one_out.parquet has each.",
    )


SECTIONS = {left_out: 110}
