"""Section and files of published figures."""

from __future__ import annotations

import pyarrow as pa

from ...report.panels import Section
from ...report.run import Run
from ...report.sections import Sections, by_column
from ...report.tables import Column, Table
from ...results.output import Output
from ...results.tables import csv_of, encoded
from . import PUBLISHED_CSV, PUBLISHED_PARQUET
from .published import comparison_with_published

_MOST_ROWS = 12


def published(run: Run) -> Sections:
    """Yield printed figures beside those of the run."""
    of = comparison_with_published(run.output)
    for table, part in of.groupby("table", sort=False):
        rows = {
            f"{row['cfa']} {row['quantity']}": {"paper": row["paper"], "ours": row["ours"], "error": row["error"]}
            for row in part.to_dict("records")
        }
        columns = {"paper": Column("published"), "ours": Column("this run"), "error": Column("difference")}
        shown = dict(list(rows.items())[:_MOST_ROWS])
        more = len(rows) - len(shown)
        note = f"{more} more in paper_comparison.csv." if more else ""
        yield Section(f"Published: {table}", Table.of(by_column(columns, shown), head="figure"), note=note)


def published_files(output: Output) -> dict[str, bytes]:
    """Return the files of the comparison with published figures."""
    table = comparison_with_published(output)
    if not len(table):
        return {}
    return {
        PUBLISHED_CSV: csv_of(table).encode("utf-8"),
        PUBLISHED_PARQUET: encoded(pa.Table.from_pandas(table, preserve_index=False)),
    }


SECTIONS = {published: 120}
REPORT_FILES = {"published": published_files}
