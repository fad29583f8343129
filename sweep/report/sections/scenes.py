"""The best design of each scene of a study with several."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from ...metrics.columns.sensitivity import CFA_SENSITIVITY
from ...metrics.quantity import Column
from ...results.output import Output
from ...results.tables import SEARCHED, SWEPT
from ...study.axes import series_of
from ..leaders import label, leaders_of, reference_of
from ..section import MOST_ROWS, Section, Table
from ..series import scene_in_words
from ..words import amount, of_column, quantity


@dataclass(frozen=True)
class Scenes(Section):
    """Best design, separation and light of each scene that is of no series, beside RGGB's separation."""

    column: Column
    rows: tuple[tuple[str, ...], ...]
    total: int

    heading = "In other scenes"

    @classmethod
    def of(cls, output: Output) -> Iterator[Section]:
        """Yield it for a study of several scenes whose designs are swept or searched."""
        if len(output.scenarios) < 2 or not output.table["kind"].isin([SWEPT, SEARCHED]).any():
            return
        column = output.trade_off[0]
        inner = {name for members in series_of(output.scenarios).values() for name in list(members)[1:-1]}
        rows = []
        for scenario in (name for name in output.scenarios if name not in inner):
            best, rggb = leaders_of(output, scenario).chosen, reference_of(output, scenario)
            its = "" if rggb is None else of_column(column, float(rggb[column.name]))
            if best is None:
                rows.append((scene_in_words(scenario), "none meets every constraint", "", "", its))
                continue
            value, light = of_column(column, float(best[column.name])), amount(float(best[CFA_SENSITIVITY]), "share")
            rows.append((scene_in_words(scenario), f"{label(best)} of {best['cfa']}", value, light, its))
        yield cls(column, tuple(rows[:MOST_ROWS]), len(rows))

    @property
    def table(self) -> Table | None:
        """A row each."""
        note = (
            f"{self.total - len(self.rows)} more scenes stand in results.parquet."
            if self.total > len(self.rows)
            else ""
        )
        return Table(("scene", "best design", quantity(self.column), "light", "RGGB"), self.rows, note)
