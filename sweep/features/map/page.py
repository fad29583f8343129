"""Sections of a map: how exact a filter must be, and the weakest band that is enough."""

from __future__ import annotations

import pandas as pd

from ...report.panels import Section
from ...report.run import Run, unit_of, words_of
from ...report.sections import Sections, by_column, exactness_of
from ...report.tables import Column, Table
from . import MAP
from .bands import widest_bands
from .section import axes_of


def exactness(run: Run) -> Sections:
    """Yield the most that any filter has at each pair of two parameters of the map."""
    yield from exactness_of(run, _map_of_search(run))


def _map_of_search(run: Run) -> pd.DataFrame | None:
    names, cells = [*axes_of(run.study)], run.output.tables.get(MAP)
    if cells is None:
        return None
    x, y = names
    most = cells.assign(most=cells["objective"].where(cells["feasible"]))
    return most.pivot_table(index=y, columns=x, values="most", dropna=False)


def bands(run: Run) -> Sections:
    """Yield the widest absorption band of a map that has as much as each other design."""
    rows = widest_bands(run.output, run.values(run.goal.name))
    columns = {
        "wanted": Column(words_of(run.goal), unit_of(run.goal)),
        "fwhm_nm": Column("widest band, FWHM", "nm", promise=True), "peak_nm": Column("peak", "nm"),
        "absorbance": Column("absorbance"), "mol_per_l": Column("concentration", "mol/l"),
        "percent_by_weight": Column("by weight", "%"),
    }  # fmt: skip
    if rows:
        table = Table.of(by_column(columns, rows), reference="", hero=run.hero, head="as much as")
        yield Section(
            "The weakest band that is enough", table, note="Between cells of the map; decadic, in a film of 0.8 µm."
        )


def enough(run: Run) -> str:
    """Return the widest band that has as much as the reference, in words."""
    band = widest_bands(run.output, {run.reference: run.value(run.reference, run.goal.name) or 0.0}).get(run.reference)
    if band is None:
        return ""
    return (
        f" A band of FWHM **{band['fwhm_nm']:.1f} nm** at {band['peak_nm']:.0f} nm with absorbance "
        f"{band['absorbance']:.2f} has as much as {run.reference}."
    )


SECTIONS = {exactness: 11, bands: 20}
CLAUSES = {"trade_off": enough}
