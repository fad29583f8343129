"""The price of a worst case: what is found of both, nominal and worst, as a sentence and a figure."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import TYPE_CHECKING

import pandas as pd

from ..results.output import Output
from ..results.tables import NAMED, PLAIN
from .figures import COLORS, Drawing, canvas
from .leaders import leaders_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def price_lines(output: Output) -> Iterator[str]:
    """What the largest worst case that the search finds is at both ends of the trade-off."""
    found, _ = _parts(output)
    if len(found) < 2:
        return
    worst, first, last = output.goal, found.iloc[0], found.iloc[-1]
    nominal = output.columns[worst.of]
    yield (
        f"The largest {worst.words} that the search finds falls from {worst.told(first['worst'])} to "
        f"{worst.told(last['worst'])} while the nominal {nominal.words} grows from {nominal.told(first['nominal'])} to "
        f"{nominal.told(last['nominal'])} (before clipping and rounding)."
    )


def price_drawings(output: Output) -> Iterator[tuple[str, str, Drawing]]:
    """(file name, caption, drawing) of the trade-offs; nothing where no levels are asked for."""
    found, light = _parts(output)
    if len(found):
        caption = "What the worst case costs: the largest one that the search finds at each nominal level"
        yield "price", caption, partial(_draw, output, found, caption)
    if len(light):
        caption = "Nominal and worst case against light: what the search finds at each level of sensitivity"
        yield "price-light", caption, partial(_draw_light, output, light, caption)


def _parts(output: Output) -> tuple[pd.DataFrame, pd.DataFrame]:
    """The rows of nominal levels, and those of levels of light."""
    if output.price is None:
        return pd.DataFrame(), pd.DataFrame()
    of_light = output.price["sensitivity_min"].notna()
    return output.price[~of_light], output.price[of_light]


def _told_light(found: pd.DataFrame) -> str:
    low, high = (f"{end:.3f}" for end in (found["sensitivity"].min(), found["sensitivity"].max()))
    return f"found by the search, sensitivity {low if low == high else f'{low} to {high}'}"


def _draw_light(output: Output, found: pd.DataFrame, title: str) -> Figure:
    """Nominal and worst case of the filters with most of either, against the light of the whole CFA."""
    worst = output.goal
    figure, axes = canvas(7.0, 4.6)
    for at, (most, color) in enumerate((("worst case", COLORS["front"]), ("nominal", COLORS["named"]))):
        own = found.iloc[at::2]  # at each level first the largest worst case, then the most nominally
        for column, told, line in (("nominal", "nominal", "o--"), ("worst", "worst case", "o-")):
            axes.plot(own["cfa_sensitivity"], own[column], line, color=color, label=f"largest {most}: its {told}")
    axes.set_ylim(0, 1.3 * found["nominal"].max())  # room for the legend
    axes.set_xlabel(output.columns["cfa_sensitivity"].axis)
    axes.set_ylabel(output.columns[worst.of].axis)
    axes.set_title(title, fontsize=10)
    axes.legend(fontsize=8, frameon=False, loc="upper right", ncols=2)
    return figure


def _draw(output: Output, found: pd.DataFrame, title: str) -> Figure:
    """A point per level; CFAs and named designs of the same scenario beside them."""
    worst = output.goal
    nominal = output.columns[worst.of]
    figure, axes = canvas(7.0, 4.6)
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
