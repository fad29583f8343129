"""Section of a search over tiles."""

from __future__ import annotations

import numpy as np

from ...report.numbers import SHARE, amount, joined
from ...report.panels import Section
from ...report.run import COUNTED, Run, unit_of
from ...report.sections import Sections, by_column
from ...report.tables import Column, Table
from . import TILES
from .search import COUNTED as OF_TILES


def tiles(run: Run) -> Sections:
    """Yield the best tile of each level of light, and what none exceeds."""
    of, search = run.output.tables.get(TILES), run.facts.search
    if of is None or search is None:
        return
    unit, rows = unit_of(run.output.goal), {}
    for level, part in of.groupby(of["cfa_sensitivity_min"].fillna(-1.0), sort=True):
        best = part[part["best"]]
        if len(best):
            row = best.iloc[0]
            edges = [float(row.get(name, np.nan)) for name in ("left_nm", "right_nm")]
            rows["the study's" if level < 0 else f"{amount(float(level), SHARE, trim=True)} of the light"] = {
                "tile": f"{row['cfa']}, N of {row['base']}", "light": row["cfa_sensitivity"], "found": row["objective"],
                "proven": part["upper_bound"].max(), "edges": " and ".join(f"{e:.0f}" for e in edges if np.isfinite(e)),
                **{name: row[name] for name in OF_TILES if name in row},
            }  # fmt: skip
    columns = {
        "tile": Column("tile"), "light": Column("light", SHARE), "edges": Column("edges / nm"), "found": Column("best found", unit),
        "proven": Column("no tile exceeds (proven)", unit),
        **{name: Column(words, "DN", group="as it is read out") for name, words in zip(OF_TILES, COUNTED.values(), strict=True)},
    }  # fmt: skip
    counts = joined([f"{count} {status}" for status, count in search.features["tiles"]["counts"].items() if count])
    yield Section("Over all tiles", Table.of(by_column(columns, rows), head="at least"), note=f"Tiles: {counts}.")


SECTIONS = {tiles: 100}
