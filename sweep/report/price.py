"""The price of a worst case: what is found of both, nominal and worst, as a sentence and a figure."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import pandas as pd

from ..results.output import Output
from ..results.tables import NAMED, PLAIN
from .figures import COLORS, canvas
from .leaders import leaders_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def price_lines(output: Output) -> Iterator[str]:
    """What the largest worst case that the search finds is at both ends of the trade-off."""
    if output.price is None or len(output.price) < 2:
        return
    worst, first, last = output.goal, output.price.iloc[0], output.price.iloc[-1]
    nominal = output.columns[worst.of]
    yield (
        f"The largest {worst.words} that the search finds falls from {worst.told(first['worst'])} to "
        f"{worst.told(last['worst'])} while the nominal {nominal.words} grows from {nominal.told(first['nominal'])} to "
        f"{nominal.told(last['nominal'])} (before clipping and rounding)."
    )


def price_drawings(output: Output) -> Iterator[tuple[str, str, Figure]]:
    """(file name, caption, figure) of the trade-off; nothing where no levels are asked for."""
    if output.price is not None:
        caption = "What the worst case costs: the largest one that the search finds at each nominal level"
        yield "price", caption, _draw(output, caption)


def _told_light(found: pd.DataFrame) -> str:
    low, high = (f"{end:.3f}" for end in (found["sensitivity"].min(), found["sensitivity"].max()))
    return f"found by the search, sensitivity {low if low == high else f'{low} to {high}'}"


def _draw(output: Output, title: str) -> Figure:
    """A point per level; CFAs and named designs of the same scenario beside them."""
    assert output.price is not None
    worst = output.goal
    nominal = output.columns[worst.of]
    figure, axes = canvas(7.0, 4.6)
    found = output.price
    axes.plot(found["nominal"], found["worst"], "o-", color=COLORS["front"], label=_told_light(found), zorder=3)
    rows = output.named[output.named["scenario"] == leaders_of(output).scenario]
    for kind, color, marker in ((PLAIN, COLORS["reference"], "s"), (NAMED, COLORS["named"], "D")):
        own = rows[(rows["kind"] == kind) & rows[worst.name].notna()]
        axes.plot(own[nominal.name], own[worst.name], marker, color=color, linestyle="none", zorder=4)
        for row in own.to_dict("records"):
            where = (row[nominal.name], row[worst.name])
            axes.annotate(str(row["name"]), where, textcoords="offset points", xytext=(7, 4), fontsize=9, zorder=5)
    axes.set_xlim(left=0)
    axes.margins(x=0.1)
    axes.set_ylim(bottom=0)
    axes.set_xlabel(f"nominal {nominal.axis}")
    axes.set_ylabel(worst.axis)
    axes.set_title(title, fontsize=10)
    axes.legend(fontsize=8, loc="upper left", frameon=False)
    return figure
