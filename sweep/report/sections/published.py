"""Published figures beside ours."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ...results.output import Output
from ..published import comparison_with_published
from ..section import MOST_ROWS, Section, Table


@dataclass(frozen=True)
class Published(Section):
    """Rows of the comparison, those that differ most first."""

    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    total: int

    heading = "Published figures beside ours"

    @classmethod
    def of(cls, output: Output) -> Iterator[Section]:
        """Yield it for a study with published figures."""
        table = comparison_with_published(output)
        if not len(table):
            return
        cells = [
            tuple(
                f"{value:.4g}"
                if isinstance(value, float) and np.isfinite(value)
                else ""
                if isinstance(value, float)
                else str(value)
                for value in row
            )
            for row in table.itertuples(index=False)
        ]
        yield cls(tuple(map(str, table.columns)), tuple(cells[:MOST_ROWS]), len(cells))

    @property
    def table(self) -> Table | None:
        """A few rows; the file has all."""
        note = f"{len(self.rows)} of {self.total}; all in paper_comparison.csv." if self.total > len(self.rows) else ""
        return Table(self.head, self.rows, note)
