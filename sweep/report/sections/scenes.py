"""The best design of each scene of a study with several."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from ...metrics.columns.sensitivity import CFA_SENSITIVITY
from ...metrics.quantity import Column
from ...results.output import Output
from ...results.tables import SEARCHED, SWEPT
from ...study.axes import series_of
from ..hold import scene_conditions
from ..leaders import label, leaders_of, reference_of
from ..panels import Picture
from ..row_panels import Row, Rows
from ..section import MOST_ROWS, Section, Table
from ..series import scene_in_words
from ..words import amount, change, joined, of_column, quantity


@dataclass(frozen=True)
class Scenes(Section):
    """Best design, separation and light of each scene that is of no series, beside RGGB's separation."""

    column: Column
    rows: tuple[tuple[str, ...], ...]
    total: int
    drawn: tuple[Row, ...]
    above: tuple[int, int]
    rggb: str
    swept: bool

    heading = "In each scene"
    leads = True

    @classmethod
    def of(cls, output: Output) -> Iterator[Section]:
        """Yield it for a study of several scenes whose designs are swept or searched."""
        if len(output.scenarios) < 2 or not output.table["kind"].isin([SWEPT, SEARCHED]).any():
            return
        column = output.trade_off[0]
        inner = {name for members in series_of(output.study.scenarios).values() for name in list(members)[1:-1]}
        rows, drawn, above, rggb_name = list[tuple[str, ...]](), list[Row](), 0, ""
        for scenario in (name for name in output.scenarios if name not in inner):
            best, rggb = leaders_of(output, scenario).chosen, reference_of(output, scenario)
            its = "" if rggb is None else of_column(column, float(rggb[column.name]))
            if best is None:
                rows.append((scene_in_words(scenario), "none meets every constraint", "", "", its))
                continue
            value, light = of_column(column, float(best[column.name])), amount(float(best[CFA_SENSITIVITY]), "share")
            if rggb is not None and float(rggb[column.name]) > 0:
                ratio, rggb_name = float(best[column.name]) / float(rggb[column.name]), label(rggb)
                drawn.append(Row(scene_in_words(scenario), ratio, text=f"{value}; {rggb_name} {its}", lost=ratio < 1))
                above += ratio > 1
            what = scene_conditions([output.study.scenarios[scenario]])
            rows.append((f"{scene_in_words(scenario)}: {what}", f"{label(best)} of {best['cfa']}", value, light, its))
        shown = tuple(drawn) if len(drawn) == len(rows) <= MOST_ROWS else ()
        alone = output.provenance.search is None and not series_of(output.study.scenarios)
        yield cls(column, tuple(rows[:MOST_ROWS]), len(rows), shown, (above, len(drawn)), rggb_name, alone)

    @property
    def answer(self) -> list[str]:
        """In how many scenes the best design of a sweep is above RGGB, and where it is least so."""
        if not self.swept or not self.drawn:
            return []
        above, of = self.above
        gains, losses = ([row for row in self.drawn if row.lost == lost] for lost in (False, True))
        ends = dict.fromkeys(change(pick(row.value for row in gains), 1.0) for pick in (min, max)) if gains else {}
        more = f", **{' to '.join(ends)}**" if gains else ""
        lost = (
            f"; **{joined([f'{change(row.value, 1.0)} in {row.name} ({row.text})' for row in losses])}**"
            if losses
            else ""
        )
        return [
            f"In **{above} of {of} scenes** the best filter of this sweep has a larger {quantity(self.column)} than "
            f"{self.rggb}{more}{lost}."
        ]

    @property
    def picture(self) -> Picture | None:
        """The ratio to RGGB of each scene."""
        if not self.swept or not self.drawn:
            return None
        axis = f"times the {quantity(self.column)} of {self.rggb}"
        panel = Rows(
            "best filter of each scene",
            axis,
            self.drawn,
            level=(1.0, f"as {self.rggb}"),
            plain=True,
            right=quantity(self.column),
        )
        return Picture((panel,), f"The best filter of each scene against {self.rggb}.")

    @property
    def table(self) -> Table | None:
        """A row each."""
        note = (
            f"{self.total - len(self.rows)} more scenes stand in results.parquet."
            if self.total > len(self.rows)
            else ""
        )
        return Table(("scene", "best design", quantity(self.column), "light", "RGGB"), self.rows, note)
