"""Which tile, and which of its pixels to modify: the best of all tiles at each level of light, and what none exceeds."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...metrics.quantity import DN, Column
from ...results.output import Output
from ...results.tables import COUNTED
from ..section import Section, Table
from ..terms import bound_conditions, edges_in_words, edges_of
from ..words import amount, joined, of_column

_LOOSE = 0.5
_WORDS = ("lamps of equal brightness", "these, every pixel counted", "lamps of any brightness", "these, by pixel")
_COUNTED = dict(zip(COUNTED, _WORDS, strict=True))


@dataclass(frozen=True)
class AllTiles(Section):
    """The best tile of each level of light.

    `best`: rows of `tiles.parquet`, the first at the light that the study needs; `limits_of`: the bound over all tiles
    at each; `counts`: tiles by what became of them; `under`: constraints of the bound, in words.
    """

    column: Column
    best: tuple[dict[str, Any], ...]
    limits_of: tuple[float, ...]
    counts: dict[str, int]
    under: str

    heading = "Over all tiles"

    @classmethod
    def of(cls, output: Output) -> Iterator[Section]:
        """Yield it for a search over tiles."""
        search, table = output.provenance.search, output.tiles
        if table is None or search is None or not search.tiles:
            return
        levels = [
            table["cfa_sensitivity_min"].isna(),
            *(table["cfa_sensitivity_min"] == v for v in table["cfa_sensitivity_min"].dropna().unique()),
        ]
        shown = [
            table[of_level & table["best"]].iloc[0].to_dict() for of_level in levels if (of_level & table["best"]).any()
        ]
        proven = [
            float(table.loc[of_level, "upper_bound"].max()) for of_level in levels if (of_level & table["best"]).any()
        ]
        yield cls(output.goal, tuple(shown), tuple(proven), search.tiles, bound_conditions(output))

    @property
    def answer(self) -> list[str]:
        """The best tile, what none exceeds, and how many were searched."""
        best, proven, counts = self.best[0], self.limits_of[0], self.counts
        told = {
            "searched": "searched",
            "excluded": "excluded without a search, since their upper bounds are no higher",
            "too dark": "too dark with any filter",
            "impossible": "without a filter that meets the constraints (proven)",
        }
        parts = [f"{count} {told.get(status, status)}" for status, count in counts.items() if count]
        text = (
            f"Of {sum(counts.values())} tiles with one modified pixel ({joined(parts)}), **{_tile(best)}** is the best "
            f"found: **{of_column(self.column, best['objective'])}**, with {edges_in_words(edges_of(best))}, before "
            "rounding to digital numbers."
        )
        if np.isfinite(proven):
            text += (
                " No filter that takes light away from one pixel of any of these tiles exceeds "
                f"**{self.column.format_bound(proven)}** {self.under} (proven)."
            )
        return [text]

    @property
    def limits(self) -> list[str]:
        """Where the bound is far, and what the search is within."""
        known = zip(self.best, self.limits_of, strict=True)
        far = [
            amount(best["cfa_sensitivity"], "share")
            for best, proven in known
            if np.isfinite(proven) and best["objective"] < _LOOSE * proven
        ]
        lines = [
            "The filters are found within the study's box of edges; tiles with equal values count as the one with more light, then with fewer kinds of pixels."
        ]
        far = list(dict.fromkeys(far))
        if far:
            lines.append(
                f"At {joined(far)} of the light the bound is more than twice what was found: another shape may be much better."
            )
        return lines

    @property
    def table(self) -> Table | None:
        """A row for each level of light."""
        counted = [name for name in _COUNTED if any(np.isfinite(row.get(name, np.nan)) for row in self.best)]
        head = [
            "light at least",
            "tile",
            "light",
            "edges",
            "found",
            "none exceeds",
            *(_COUNTED[name] for name in counted),
        ]
        rows = []
        for row, proven in zip(self.best, self.limits_of, strict=True):
            level = row["cfa_sensitivity_min"]
            rows.append(
                (
                    "the study's" if not np.isfinite(level) else amount(level, "share"),
                    f"{row['cfa']}, N of {row['base']}",
                    amount(row["cfa_sensitivity"], "share"),
                    edges_in_words(edges_of(row)).replace("**", "").removeprefix("edges at "),
                    of_column(self.column, row["objective"]),
                    of_column(self.column, proven) if np.isfinite(proven) else "",
                    *(f"{row[name]:.1f} {DN}" if np.isfinite(row[name]) else "" for name in counted),
                )
            )
        return Table(tuple(head), tuple(rows))


def _tile(row: dict[str, Any]) -> str:
    """Return a tile with its modified pixel, which is N, and the curve that the filter is in."""
    return f"{row['cfa']} (N: {row['base']} with a filter)"
