"""Published figures beside ours."""

from __future__ import annotations

import pandas as pd

from ..camera.scene import OBJECT_RESOLUTION
from ..results.output import Output

PUBLISHED_CSV, PUBLISHED_PARQUET = "paper_comparison.csv", "paper_comparison.parquet"


def comparison_with_published(output: Output) -> pd.DataFrame:
    """One row per published figure: table, cfa (or geometry), quantity, paper, ours, error, relative_error, ours_exact.

    `ours` is rounded to the digits that are printed, and `error` is its difference; `ours_exact` is not rounded. Ours
    is of the study's first scenario. Empty when the study publishes nothing.
    """
    first = output.scenarios[0]
    named = output.named
    named = named[named["scenario"] == first].set_index("name")
    rows = []
    for table, entries in output.study.published.items():
        for name, values in entries.items():
            for quantity, paper in values.items():
                if quantity == OBJECT_RESOLUTION:
                    exact = output.study.geometry[name].object_resolution_px
                else:
                    exact = float(named[quantity][name])
                ours = round(exact, _decimals(paper))
                error = round(ours - paper, 12)
                rows.append((table, name, quantity, paper, ours, error, error / paper if paper else None, exact))
    columns = ["table", "cfa", "quantity", "paper", "ours", "error", "relative_error", "ours_exact"]
    return pd.DataFrame(rows, columns=columns)


def _decimals(printed: float) -> int:
    """Digits behind the point of a figure as it is printed."""
    return len(f"{printed:g}".partition(".")[2])


def comparison_lines(found: pd.DataFrame) -> list[str]:
    """The comparison as tables of text: ours, and in brackets the printed figure."""
    lines = []
    for table, rows in found.groupby("table", sort=False):
        names = list(dict.fromkeys(rows["cfa"]))
        width = max(len(f"{q} ") for q in rows["quantity"])
        lines.append(f"{table}, ours (printed):")
        lines.append(" " * width + "".join(name.rjust(15) for name in names))
        for quantity, line in rows.groupby("quantity", sort=False):
            cells = {row.cfa: f"{row.ours:g} ({row.paper:g})" for row in line.itertuples()}
            lines.append(str(quantity).ljust(width) + "".join(cells.get(name, "").rjust(15) for name in names))
    return lines
