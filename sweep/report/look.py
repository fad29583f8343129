"""One look of all figures: a color, dash and marker for each name, axes, labels at lines, and SVG in two widths."""

from __future__ import annotations

import io
import re
import textwrap
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDE, NARROW = 1040, 368
"""Widths of a figure, px; the page shows the one that fits."""
INK, DIM, GRID = "#1d1d1f", "#5c6066", "#e7e8ea"
GAIN, LOSS, FORBIDDEN = "#0b5fa5", "#b3400e", "#fbeee8"
LAMPS = {"green": "#7cc4a4", "yellow": "#f0cf5b", "orange": "#f0a860", "red": "#e58a84"}
"""Areas of the lamps of each signal type."""
CHANNELS = {
    "R": "#c0392b",
    "Rx": "#8c2d04",
    "G": "#2e8b57",
    "B": "#2c6fbb",
    "Y": "#b07a00",
    "Cy": "#17a2a2",
    "C": DIM,
    "W": DIM,
}
_FONT, _FONT_NARROW = 14, 12
_LINE, _BOLD = 1.7, 3.2
_DIGITS = re.compile(r"(\d+\.\d{2})\d+")
_CLIP_PATH = re.compile(rb"\bp[0-9a-f]{10}\b")


@dataclass(frozen=True)
class Style:
    """How a CFA or design is drawn on every page; `text` is dark enough for words."""

    color: str
    dash: Any = "-"
    marker: str = "o"
    text: str = ""

    @property
    def ink(self) -> str:
        """Color of words."""
        return self.text or self.color


_KNOWN = {
    "RGGB": Style("#1d1d1f", "-", "s"),
    "RCCB": Style("#767676", (0, (6, 3)), "^", "#6a6a6a"),
    "RCCC": Style("#a6a6a6", (0, (1, 2)), "v", "#757575"),
    "RYYCy": Style("#b07a00", (0, (6, 2, 1, 2)), "D", "#8a5f00"),
    "paper_N4": Style("#39b1e2", (0, (4, 2)), "o", "#11749f"),
    "best stopband": Style("#065dcb", "-", "*"),
    "best at f/2": Style("#088a40", (0, (8, 3)), "P", "#077a39"),
    "robust to lamps": Style("#540fcf", "-", "X"),
    "robust to angles": Style("#fc4686", "-", "h", "#cf1a60"),
}
_OTHERS = (
    Style("#065dcb", "-", "*"),
    Style("#088a40", (0, (8, 3)), "P", "#077a39"),
    Style("#540fcf", "-", "X"),
    Style("#fc4686", (0, (5, 2)), "h", "#cf1a60"),
    Style("#39b1e2", (0, (4, 2)), "o", "#11749f"),
    Style("#00857c", (0, (7, 2, 2, 2)), "p"),
    Style("#a0522d", (0, (3, 1)), "d"),
    Style("#b07a00", (0, (2, 2)), "D", "#8a5f00"),
    Style("#767676", (0, (6, 2, 1, 2)), "p", "#6a6a6a"),
)


def styles_of(names: Iterable[str]) -> dict[str, Style]:
    """Return the style of each name: its own on every page, else one that no other has here."""
    names = list(dict.fromkeys(names))
    styles = {name: _KNOWN[name] for name in names if name in _KNOWN}
    spare = [style for style in _OTHERS if style.color not in {used.color for used in styles.values()}]
    for at, name in enumerate(name for name in names if name not in styles):
        styles[name] = (spare or list(_OTHERS))[at % len(spare or _OTHERS)]
    return styles


def sheet(wide: bool, height: float) -> Figure:
    """Return an empty figure of a height in px."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg  # noqa: PLC0415  (slow to import)
    from matplotlib.figure import Figure  # noqa: PLC0415

    figure = Figure(figsize=((WIDE if wide else NARROW) / 72, height / 72))
    FigureCanvasAgg(figure)
    return figure


def place(figure: Figure, left: float, top: float, width: float, height: float) -> Axes:
    """Add axes at a place in px, from the upper left corner, in the look of all figures."""
    total_width, total_height = (72 * size for size in figure.get_size_inches())
    bounds = left / total_width, 1 - (top + height) / total_height, width / total_width, height / total_height
    axes = figure.add_axes(bounds)
    axes.grid(visible=True, color=GRID, linewidth=0.8)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    for side in ("left", "bottom"):
        axes.spines[side].set_color("#9a9ea4")
    axes.tick_params(colors=DIM, labelsize=font(figure), length=0, pad=5)
    return axes


def font(figure: Figure) -> float:
    """Size of a figure's letters, px."""
    return _FONT if 72 * figure.get_size_inches()[0] > NARROW else _FONT_NARROW


def is_wide(axes: Axes) -> bool:
    """Return whether axes are of the wide figure."""
    return font(axes.figure) == _FONT  # type: ignore[arg-type]


def words_at(axes: Axes, text: str, x: float, y: float, **how: Any) -> None:
    """Write words at a place of the data; the page draws a white edge around all words."""
    axes.text(x, y, text, **({"fontsize": font(axes.figure), "va": "center"} | how))  # type: ignore[arg-type]


def wrapped(name: str) -> str:
    """Return a name in lines of few letters, for a narrow screen."""
    return "\n".join(textwrap.wrap(name, 13, break_long_words=False)) or name


def label_ends(axes: Axes, ends: Mapping[str, tuple[float, Style, bool]], least: tuple[float, float]) -> None:
    """Write names right of the axes, each at the height of its line's end, pushed apart where they are near.

    `ends`: name -> height, style, and whether it is bold; `least`: range of heights in the data.
    """
    axes.set_ylim(*least)
    size, wide = font(axes.figure), is_wide(axes)  # type: ignore[arg-type]
    names = {name: name if wide else wrapped(name) for name in ends}
    height_px = axes.get_position().height * 72 * axes.figure.get_size_inches()[1]  # type: ignore[union-attr]
    x = axes.get_xlim()[1]
    low, high = (axes.transData.transform((x, end))[1] for end in least)
    shares = [float((axes.transData.transform((x, y))[1] - low) / (high - low)) for y, *_ in ends.values()]
    lines = max((name.count("\n") + 1 for name in names.values()), default=1)
    placed = spread(shares, 1.22 * size * lines / height_px) if shares else []
    for (name, (_, style, bold)), share in zip(ends.items(), placed, strict=True):
        axes.text(
            1.0, share, names[name], transform=axes.transAxes + offset(axes, 8, 0), va="center", ha="left",
            color=style.ink, fontsize=size, fontweight="bold" if bold else "normal",
        )  # fmt: skip


def offset(axes: Axes, x_px: float, y_px: float) -> Any:
    """Return a move by some px."""
    from matplotlib.transforms import ScaledTranslation  # noqa: PLC0415  (slow to import)

    return ScaledTranslation(x_px / 72, y_px / 72, axes.figure.dpi_scale_trans)


def spread(heights: Sequence[float], least: float) -> list[float]:
    """Return heights moved as little as needed to be some distance apart, within 0 and 1 where there is room."""
    order = np.argsort(heights, kind="stable")
    wanted = np.clip(np.asarray(heights, dtype=float)[order], 0.0, 1.0)
    groups: list[tuple[float, int]] = []  # middle and number of neighbors that touch
    for height in wanted:
        groups.append((float(height), 1))
        while len(groups) > 1 and groups[-1][0] - groups[-2][0] < least * (groups[-1][1] + groups[-2][1]) / 2:
            (upper, n), (lower, m) = groups.pop(), groups.pop()
            groups.append(((upper * n + lower * m) / (n + m), n + m))
    placed = np.concatenate([middle + least * (np.arange(n) - (n - 1) / 2) for middle, n in groups])
    placed -= max(0.0, placed[-1] - 1.0)
    placed += max(0.0, -placed[0])
    result = np.empty_like(placed)
    result[order] = placed
    return [float(height) for height in result]


def log_axis(axes: Axes, which: str, low: float, high: float) -> None:
    """Make an axis logarithmic, with at most five numbers."""
    from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator  # noqa: PLC0415  (slow to import)

    getattr(axes, f"set_{which}scale")("log")
    decades = np.arange(np.floor(np.log10(low)), np.ceil(np.log10(high)) + 1)
    steps = (1, 2, 5) if high / low < 80 else (1,)
    numbers = np.array([step * 10.0**decade for decade in decades for step in steps])
    numbers = numbers[(numbers >= low * 0.999) & (numbers <= high * 1.001)]
    numbers = numbers[:: max(1, -(-len(numbers) // 6))]
    axis = axes.xaxis if which == "x" else axes.yaxis
    axis.set_major_locator(FixedLocator(numbers.tolist()))
    axis.set_minor_locator(NullLocator())
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,.10g}"))


def svg_of(figure: Figure, name: str, label: str) -> str:
    """Return a figure as SVG for a page, where no other has its name; equal figures give equal text."""
    saved = _saved(figure, format="svg", dpi=72, metadata=dict.fromkeys(("Date", "Creator", "Format", "Type")))
    numbers: dict[bytes, bytes] = {}  # names of clip paths hash the last bits of a layout, which may differ
    content = _CLIP_PATH.sub(lambda found: numbers.setdefault(found[0], f"{name}-{len(numbers)}".encode()), saved)
    text = content[content.index(b"<svg") :].decode("utf-8")
    text = re.sub(r"<metadata>.*?</metadata>\s*", "", text, flags=re.DOTALL)
    width, height = (72 * size for size in figure.get_size_inches())
    spaces = 'xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink"'
    head = f'<svg role="img" aria-label="{escape(label)}" viewBox="0 0 {width:g} {height:g}" {spaces}>'
    return head + re.sub(r"<[^>]+>", lambda tag: _DIGITS.sub(r"\1", tag[0]), text[text.index(">") + 1 :])


def png_of(figure: Figure) -> bytes:
    """Return a figure as a PNG of twice its size, for slides."""
    return _saved(figure, format="png", dpi=144, metadata={"Software": None})


def _saved(figure: Figure, **how: Any) -> bytes:
    """Return a figure as a file; a name in a script that the font lacks is no warning, and none is a formula."""
    import matplotlib as mpl  # noqa: PLC0415  (slow to import)

    for text in figure.texts:
        text.set_parse_math(False)
    for axes in figure.axes:  # numbers along a logarithmic axis are formulas
        legend = axes.get_legend()
        texts = [axes.title, axes.xaxis.label, axes.yaxis.label, *axes.texts, *(legend.get_texts() if legend else ())]
        for text in texts:
            text.set_parse_math(False)
    buffer = io.BytesIO()
    with mpl.rc_context({"svg.hashsalt": "cfa-sweep", "svg.fonttype": "none"}), warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph")
        figure.savefig(buffer, **how)
    return buffer.getvalue()
