"""Uncertain curves: separations of random sensors within stated errors."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from ...results.output import Output
from ..leaders import answering, label
from ..panels import Picture
from ..row_panels import Row, Rows
from ..section import Section
from ..words import of_column


@dataclass(frozen=True)
class Uncertain(Section):
    """Median and 5 to 95 % of the separation of each design over random sensors."""

    words: str
    axis: str
    rows: tuple[Row, ...]
    draws: int
    hero: str

    heading = "If the sensor's curves are uncertain"

    @classmethod
    def of(cls, output: Output) -> Iterator[Section]:
        """Yield it for a study of uncertain curves."""
        errors, column, best = output.study.uncertainty, output.trade_off[0], answering(output)
        if output.uncertainty is None or errors is None:
            return
        known = output.uncertainty
        known = known[(known["quantity"] == column.name) & (known["scenario"] == output.scenario)]
        rows = tuple(
            Row(
                str(r["name"]),
                float(r["dn_50"]),
                None,
                float(r["dn_5"]),
                float(r["dn_95"]),
                f"{of_column(column, r['dn_5'])} to {of_column(column, r['dn_95'])}",
            )
            for r in known.to_dict("records")
        )
        if rows:
            yield cls(column.words, column.axis, rows, errors.draws, "" if best is None else label(best))

    @property
    def answer(self) -> list[str]:
        """What holds for 90 % of the sensors."""
        return [
            f"Of {self.draws:,} random sensors within the stated errors, 90 % have a {self.words} in the bars, before clipping and rounding."
        ]

    @property
    def picture(self) -> Picture | None:
        """A bar each."""
        return Picture((Rows(self.axis, self.axis, self.rows, self.hero),), f"{self.words} of random sensors.")
