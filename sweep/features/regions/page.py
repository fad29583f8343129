"""Sections of lamps that norms allow, and of reds that move."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...report.numbers import SHARE, span
from ...report.panels import Map, Section
from ...report.run import Run
from ...report.sections import Sections, around, by_column
from ...report.tables import Axis, Column, Marks, Table
from . import LAMP_LIMITS, REGIONS_MAP


def norms(run: Run) -> Sections:
    """Yield every pair of a yellow and a red LED that a norm allows."""
    regions, population = run.output.tables.get(REGIONS_MAP), run.study.population
    if regions is None or population is None:
        return
    wanted = population.wanted_dn
    for norm, of in regions.groupby("norm", sort=False):
        rows = {
            run.names[number]: {
                "share": float(cells["separated"].sum() / cells["pairs"].sum()),
                "below": float(cells["below_rggb"].sum() / cells["pairs"].sum()),
                "any": float(cells["chromatic_below_rggb"].sum() / cells["pairs"].sum()),
                "least": float(cells["least_dn"].min()),
            }
            for number, cells in ((int(key), cells) for key, cells in of.groupby("design_id", sort=False))  # type: ignore[arg-type]
            if number in run.names
        }
        columns = {
            "share": Column(f"pairs with {wanted:g} DN" if wanted else "pairs", SHARE, "more"),
            "least": Column("least", "DN", "more"),
            "below": Column(f"below {run.reference}", SHARE),
            "any": Column(f"below {run.reference}, any brightness", SHARE),
        }
        panels = []
        for name in dict.fromkeys((run.hero, run.reference)):
            part = of[of["design_id"] == run.here[name]["design_id"]] if name in run.here else of[:0]
            if len(part):
                table = part.pivot_table(index="yellow_nm", columns="red_nm", values="least_dn", aggfunc="min")
                x, y = table.columns.to_numpy(dtype=float), table.index.to_numpy(dtype=float)
                level = (float(wanted), f"{wanted:g} DN") if wanted else None
                panels.append(Map(
                    f"{name}: least separation / DN", around("peak of the red LED", x), around("peak of the yellow LED", y),
                    "", x, y, table.to_numpy(dtype=float), level, most=float(of["least_dn"].max()),
                ))  # fmt: skip
        table = Table.of(by_column(columns, rows), reference=run.reference, hero=run.hero)
        title = f"Lamps that {str(norm).replace('_', ' ').upper()} allows"
        yield Section(title, table, tuple(panels), "Single LEDs, modeled; all pairs counted equally.")


def deep_reds(run: Run) -> Sections:
    """Yield from which red on designs fall below the reference."""
    limits = run.output.tables.get(LAMP_LIMITS)
    if limits is None:
        return
    rows: dict[str, dict[str, Any]] = {}
    known = limits[limits["design_id"].isin([*run.names]) & np.isfinite(limits["red_limit_nm"])]
    for number, of in known.groupby("design_id", sort=False):
        row = rows.setdefault(run.names[int(number)], {})
        for quantity, part in of.groupby("quantity", sort=False):
            key = "any" if str(quantity).startswith("chromatic") else "equal"
            peaks = float(part["red_limit_nm"].min()), float(part["red_limit_nm"].max())
            row[key] = Marks([peaks], (), span(peaks, "nm"))
        deepest = of[~of["quantity"].str.startswith("chromatic")].dropna(subset=["deepest_ratio"])
        if len(deepest):
            row["deepest"] = span(deepest["deepest_ratio"].tolist())
            row["at"] = float(deepest["deepest_nm"].iloc[0])
    ends = [end for row in rows.values() for key in ("any", "equal") if key in row for end in row[key].spans[0]]
    if rows:
        axis = Axis("", "nm", min(ends) - 2, max(ends) + 2)
        group = f"peak of the red LED from which it is below {run.reference}, by the LED's shape"
        columns = {
            "equal": Column("equal brightness", axis=axis, group=group), "any": Column("any brightness", axis=axis, group=group),
            "deepest": Column(f"times {run.reference} at the deepest red"), "at": Column("deepest red", "nm"),
        }  # fmt: skip
        yield Section("Deeper reds", Table.of(by_column(columns, rows), hero=run.hero))


SECTIONS = {norms: 30, deep_reds: 40}
