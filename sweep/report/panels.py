"""Panels of a page: lines, points, curves over lamps, a map; each drawn once, in one size, as SVG or PNG; sections."""

from __future__ import annotations

import io
import re
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from ..base.types import Array, Float
from .numbers import NARROW, amount
from .tables import Axis, Table

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDTH, HEIGHT, FONT = 520, 300, 15
"""Of a figure, px, and the size of its letters."""
_LETTER, _BOLD, _MOST_LETTERS, _TITLE = 8.0, 10.5, 24, 58
"""Width of a letter, px, the longest name that is written whole, and the longest title of letters of full size."""
_APART = 17.0
"""Height of a line of words, px."""
INK, DIM, GRID, GAIN, LOSS = "#1d1d1f", "#5c6066", "#e7e8ea", "#065dcb", "#b3400e"
LAMPS = {"green": "#7cc4a4", "yellow": "#f0cf5b", "orange": "#f0a860", "red": "#e58a84"}
CHANNELS = {"R": "#c0392b", "Rx": "#8c2d04", "G": "#2e8b57", "B": "#2c6fbb", "Y": "#b07a00", "Cy": "#17a2a2"}
_BLUES = ("#eef4fc", "#9dc0ee", "#4f8add", "#065dcb", "#04408c")
_SWEPT = "#9dc0ee"
_EDGES, _FAR = ("right", "left"), 88.0
"""Sides of the words beside edges; from that percent of an axis on they stand left."""
Values = Float[Array, " _numbers"]
Pairs = tuple[Values, Values]


@dataclass(frozen=True)
class Style:
    """How a CFA or design is drawn on every page."""

    color: str
    dash: Any = "-"
    marker: str = "o"

    @property
    def ink(self) -> str:
        """The color, dark enough for words."""
        red, green, blue = (int(self.color[at : at + 2], 16) for at in (1, 3, 5))
        share = min(1.0, 0.45 * 255 / max(0.299 * red + 0.587 * green + 0.114 * blue, 1.0))
        return "#" + "".join(f"{int(share * part):02x}" for part in (red, green, blue))


_KNOWN = {
    "RGGB": Style("#1d1d1f", "-", "s"),
    "RCCB": Style("#767676", (0, (6, 3)), "^"),
    "RCCC": Style("#a6a6a6", (0, (1, 2)), "v"),
    "RYYCy": Style("#b07a00", (0, (6, 2, 1, 2)), "D"),
    "paper_N4": Style("#39b1e2", (0, (4, 2)), "o"),
    "best stopband": Style("#065dcb", "-", "*"),
    "best at f/2": Style("#088a40", (0, (8, 3)), "P"),
    "robust to lamps": Style("#540fcf", "-", "X"),
    "robust to angles": Style("#fc4686", "-", "h"),
}
_OTHERS = (
    *(_KNOWN[name] for name in ("best stopband", "best at f/2", "robust to lamps", "robust to angles", "paper_N4")),
    Style("#00857c", (0, (7, 2, 2, 2)), "p"),
    Style("#a0522d", (0, (3, 1)), "d"),
    Style("#b07a00", (0, (2, 2)), "D"),
    Style("#767676", (0, (6, 2, 1, 2)), "p"),
)


def styles_of(names: Iterable[str]) -> dict[str, Style]:
    """Return the style of each name: its own on every page, else one that no other has here."""
    names = list(dict.fromkeys(names))
    styles = {name: _KNOWN[name] for name in names if name in _KNOWN}
    used = {style.color for style in styles.values()}
    spare = [style for style in _OTHERS if style.color not in used] or list(_OTHERS)
    for at, name in enumerate(sorted(name for name in names if name not in styles)):
        styles[name] = spare[at % len(spare)]
    return styles


def axis_over(
    name: str,
    unit: str,
    values: Iterable[float],
    *,
    log: bool | None = None,
    zero: bool = True,
    level: float | None = None,
) -> Axis:
    """Return an axis that holds values and a level: logarithmic over more than a decade, unless `log` says otherwise."""
    known = np.array([*values, *([] if level is None else [level])], dtype=float)
    known = known[np.isfinite(known)]
    low, high = (float(known.min()), float(known.max())) if known.size else (0.0, 1.0)
    log = low > 0 and high / low > 15 if log is None else log
    if log:
        least = float(known[known > 0].min(initial=high or 1.0))
        return Axis(name, unit, min(least, high), high if high > least else 10 * least, True, level)
    room = 0.1 * (high - low)
    low = min(0.0, low) if zero else low - room
    return Axis(name, unit, low, high + room if high > low else low + 1.0, False, level)


@dataclass(frozen=True)
class Panel:
    """Title and axes; `bold`: the name that answers."""

    title: str
    x: Axis
    y: Axis
    bold: str = ""

    @property
    def room(self) -> float:
        """Width on the right for words, px."""
        return 14.0

    @property
    def y_ticks(self) -> Sequence[tuple[float, str]]:
        """Numbers on the left."""
        return self.y.ticks

    def draw(self, axes: Axes) -> None:
        """Draw it."""
        raise NotImplementedError


@dataclass(frozen=True)
class Lines(Panel):
    """A line for each name, or a band down to a `floor`; `zone`: a forbidden range of heights, in words."""

    lines: Mapping[str, Pairs] = field(default_factory=dict)
    floors: Mapping[str, Values] = field(default_factory=dict)
    zone: tuple[float, float, str] | None = None
    ticks: Sequence[tuple[float, str]] = ()

    @property
    def room(self) -> float:
        """Width of the names at the ends."""
        letters = {name: min(len(name), _MOST_LETTERS) for name in self.lines}
        return 12 + max((n * (_BOLD if name == self.bold else _LETTER) for name, n in letters.items()), default=0.0)

    @property
    def y_ticks(self) -> Sequence[tuple[float, str]]:
        """Numbers on the left."""
        return self.ticks or self.y.ticks

    def draw(self, axes: Axes) -> None:
        """Draw lines with names at their ends."""
        styles, ends = styles_of(self.lines), {}
        for name, (x, y) in self.lines.items():
            style, bold, known = styles[name], name == self.bold, np.isfinite(y)
            if not known.any():
                continue
            width, order = 3.2 if bold else 1.7, 4 if bold else 3
            marker = style.marker if len(x) < 40 else ""
            axes.plot(
                x[known], y[known], color=style.color, linewidth=width, linestyle=style.dash, marker=marker, markersize=4.5,
                zorder=order, gid=_gid(name),
            )  # fmt: skip
            if name in self.floors:
                axes.fill_between(
                    x[known], self.floors[name][known], y[known], color=style.color, alpha=0.13, linewidth=0
                )
            ends[name] = float(y[known][-1]), style, bold
        if self.zone is not None:
            low, high, words = self.zone
            axes.axhspan(low, high, color="#fbeee8", linewidth=0, zorder=0)
            middle = np.sqrt(low * high) if self.y.log else (low + high) / 2
            axes.text(
                0.02, middle, words, transform=axes.get_yaxis_transform(), color=LOSS, va="center", fontsize=FONT - 1
            )
        _name_ends(axes, ends)


@dataclass(frozen=True)
class Points(Panel):
    """A point for each name, groups of dots, a cloud of designs, a front, and a bound."""

    points: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    groups: Mapping[str, Pairs] = field(default_factory=dict)
    cloud: Pairs | None = None
    front: Pairs | None = None
    bound: Pairs | None = None

    def draw(self, axes: Axes) -> None:
        """Draw points, each with its name where no other stands."""
        styles = styles_of([*self.points, *self.groups])
        if self.cloud is not None:
            axes.plot(*self.cloud, ".", color=_SWEPT, markersize=5, zorder=2)
        if self.front is not None:
            color = styles[self.bold].color if self.bold in styles else GAIN
            axes.plot(*self.front, color=color, linewidth=1.7, zorder=3)
        if self.bound is not None:
            axes.plot(*self.bound, color=DIM, linestyle=(0, (4, 3)), linewidth=1.2, zorder=2)
            at = len(self.bound[0]) // 2
            place = float(self.bound[0][at]), float(self.bound[1][at])
            axes.annotate("proven", place, (0, 5), textcoords="offset points", color=DIM, fontsize=FONT - 1)
        shown = {name: (float(np.clip(x, self.x.low, self.x.high)), y) for name, (x, y) in self.points.items()}
        used = [(x - 7, x + 7, y) for x, y in axes.transData.transform([*shown.values()] or np.empty((0, 2)))]
        for name, (x, y) in self.groups.items():
            style = Style(LAMPS[name]) if name in LAMPS else styles[name]
            axes.plot(x, y, "o", color=style.color, markersize=5, alpha=0.85, markeredgewidth=0, gid=_gid(name))
            self._name(axes, _cut(name), float(np.median(x)), float(np.median(y)), style, used)
        if self.cloud is not None:
            at = int(np.argmax(self.cloud[0]))
            place = float(self.cloud[0][at]), float(self.cloud[1][at])
            self._name(axes, "swept", *place, Style(_SWEPT), used)
        for name, (across, height) in self.points.items():
            drawn, bold = shown[name][0], name == self.bold
            axes.plot(
                drawn, height, styles[name].marker, color=styles[name].color, markersize=13 if bold else 8, zorder=5,
                markeredgecolor="white", gid=_gid(name), clip_on=False,
            )  # fmt: skip
            beyond = f" ({'◂' if across < drawn else '▸'} {amount(across, self.x.unit)})" if across != drawn else ""
            words = f"{_cut(name)} {amount(height, self.y.unit)}{beyond}"
            self._name(axes, words, drawn, height, styles[name], used, bold=bold)

    @staticmethod
    def _name(
        axes: Axes,
        words: str,
        x: float,
        y: float,
        style: Style,
        used: list[tuple[float, float, float]],
        *,
        bold: bool = False,
    ) -> None:
        """Write words beside a point, at the nearest height where they meet neither a point nor other words."""
        across, up = axes.transData.transform((x, y))
        left = across > axes.bbox.x0 + 0.6 * axes.bbox.width
        begin = across - 9 - _LETTER * len(words) if left else across + 9
        end = begin + _LETTER * len(words)
        known = [height for first, last, height in used if first < end and last > begin]
        moves = sorted(range(-120, 121, 3), key=lambda move: (abs(move), move))
        inside = [move for move in moves if axes.bbox.y0 < up + move < axes.bbox.y1] or [0]
        free = (move for move in inside if all(abs(up + move - height) >= _APART for height in known))
        move = next(free, inside[0])
        used.append((begin, end, up + move))
        line = {"arrowstyle": "-", "color": "#9a9ea4", "linewidth": 0.8, "shrinkB": 4}
        axes.annotate(
            words.replace(NARROW, " "), (x, y), (-9 if left else 9, move), textcoords="offset pixels",
            ha="right" if left else "left", va="center", color=style.ink, fontsize=FONT,
            fontweight="bold" if bold else "normal", zorder=6, arrowprops=line if abs(move) > _APART else None,
        )  # fmt: skip


@dataclass(frozen=True)
class Curves(Panel):
    """Curves over wavelength before the spectra of the lamps; `edges` are marked, nm."""

    nm: Values = field(default_factory=lambda: np.empty(0))
    curves: Mapping[str, Values] = field(default_factory=dict)
    lamps: Mapping[str, Values] = field(default_factory=dict)
    edges: Sequence[float] = ()
    color: str = GAIN
    dashed: Sequence[str] = ()

    def draw(self, axes: Axes) -> None:
        """Draw lamps, curves, and their names where other curves are far."""
        for kind, lamp in self.lamps.items():
            axes.fill_between(
                self.nm, 0.96 * self.y.high * lamp, color=LAMPS.get(kind, "#bbbbbb"), alpha=0.45, linewidth=0
            )
        for name, curve in self.curves.items():
            bold = name == self.bold
            color = self.color if bold else CHANNELS.get(name, DIM)
            dash = (0, (5, 2)) if name in self.dashed else "-"
            axes.plot(
                self.nm, curve, color=color, linewidth=3.2 if bold else 1.7, linestyle=dash, zorder=4 if bold else 3
            )
            others = [other for key, other in self.curves.items() if key != name]
            free = np.min([np.abs(curve - other) for other in others], axis=0) if others else curve
            inner = slice(len(curve) // 20, len(curve) - len(curve) // 20)
            at = inner.start + int(np.argmax(np.where(curve > 0.25 * curve.max(), free, -1.0)[inner]))
            weight = "bold" if bold else "normal"
            axes.text(
                self.nm[at],
                curve[at],
                _cut(name),
                color=color,
                ha="center",
                va="bottom",
                fontsize=FONT,
                fontweight=weight,
            )
        for at, edge in enumerate(edge for edge in self.edges if self.x.low <= edge <= self.x.high):
            axes.axvline(edge, color=self.color, linestyle=(0, (2, 2)), linewidth=1.2)
            axes.text(
                edge,
                self.y.high,
                f" {edge:.0f} nm ",
                ha="right" if self.x.percent(edge) > _FAR else _EDGES[at % 2],
                va="top",
                color=self.color,
                fontsize=FONT,
                fontweight="bold",
            )


@dataclass(frozen=True)
class Map(Panel):
    """Heights over two numbers, with a level and a marked place."""

    across: Values = field(default_factory=lambda: np.empty(0))
    up: Values = field(default_factory=lambda: np.empty(0))
    heights: Float[Array, "up across"] = field(default_factory=lambda: np.empty((0, 0)))
    level: tuple[float, str] | None = None
    mark: tuple[float, float] | None = None
    most: float | None = None

    def draw(self, axes: Axes) -> None:
        """Draw heights, level and mark; where there is none it is gray."""
        from matplotlib.colors import LinearSegmentedColormap  # noqa: PLC0415  (slow to import)

        axes.set_facecolor("#eeeeee")
        axes.grid(visible=False)
        colors = LinearSegmentedColormap.from_list("heights", list(_BLUES))
        axes.pcolormesh(
            self.across, self.up, self.heights, cmap=colors, vmin=0, vmax=self.most, shading="nearest", rasterized=True
        )
        if self.level is not None and np.nanmin(self.heights) < self.level[0] < np.nanmax(self.heights):
            drawn = axes.contour(self.across, self.up, self.heights, levels=[self.level[0]], colors=INK, linewidths=1.4)
            axes.clabel(drawn, fmt=self.level[1], fontsize=FONT - 1)
        if self.mark is not None:
            axes.plot(*self.mark, "*", color="white", markersize=15, markeredgecolor=INK)


def _gid(name: str) -> str:
    return f"design:{name}"


def _cut(name: str) -> str:
    return name if len(name) <= _MOST_LETTERS else f"{name[: _MOST_LETTERS - 1]}…"


def _name_ends(axes: Axes, ends: Mapping[str, tuple[float, Style, bool]]) -> None:
    """Write names right of the axes at the heights of their lines' ends, pushed apart."""
    order, right = sorted(ends, key=lambda name: ends[name][0]), axes.get_xlim()[1]
    low, height = axes.bbox.y0, axes.bbox.height
    heights = [float(np.clip(axes.transData.transform((right, ends[name][0]))[1] - low, 0, height)) for name in order]
    for name, at in zip(order, spread(heights, _APART, height), strict=True):
        _, style, bold = ends[name]
        axes.annotate(
            _cut(name), (1, at / height), (8, 0), xycoords="axes fraction", textcoords="offset points", va="center",
            color=style.ink, fontsize=FONT, fontweight="bold" if bold else "normal", annotation_clip=False,
        )  # fmt: skip


def spread(heights: Sequence[float], least: float, most: float) -> list[float]:
    """Return rising heights moved as little as needed to be apart, from 0 to `most` where there is room."""
    placed = list(heights)
    for _ in range(400):
        near = [at for at in range(len(placed) - 1) if placed[at + 1] - placed[at] < least - 0.01]
        if not near:
            break
        for at in near:
            push = (least - placed[at + 1] + placed[at]) / 2
            placed[at], placed[at + 1] = placed[at] - push, placed[at + 1] + push
        placed = [min(max(at, 0.0), most) for at in placed]
    return placed


def figure_of(panel: Panel) -> Figure:
    """Draw a panel."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg  # noqa: PLC0415  (slow to import)
    from matplotlib.figure import Figure  # noqa: PLC0415
    from matplotlib.ticker import FixedFormatter, FixedLocator, NullLocator  # noqa: PLC0415

    figure = Figure(figsize=(WIDTH / 72, HEIGHT / 72), dpi=72)
    FigureCanvasAgg(figure)
    ticks = panel.y_ticks
    left = 16 + 8.2 * max((len(words) for _, words in ticks), default=3)
    bounds = left / WIDTH, 52 / HEIGHT, (WIDTH - left - panel.room) / WIDTH, (HEIGHT - 90) / HEIGHT
    axes = figure.add_axes(bounds)
    axes.grid(visible=True, color=GRID, linewidth=0.8)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color("#9a9ea4")
    axes.set(xscale="log" if panel.x.log else "linear", yscale="log" if panel.y.log else "linear")
    axes.set(xlim=(panel.x.low, panel.x.high), ylim=(panel.y.low, panel.y.high))
    if panel.y.level is not None:
        axes.axhline(panel.y.level, color=INK, linestyle=(0, (1, 2)), linewidth=1.2, zorder=1)
    panel.draw(axes)
    for axis, known in ((axes.xaxis, panel.x.ticks), (axes.yaxis, ticks)):
        axis.set_major_locator(FixedLocator([at for at, _ in known]))
        axis.set_major_formatter(FixedFormatter([words for _, words in known]))
        axis.set_minor_locator(NullLocator())
    axes.tick_params(colors=DIM, labelsize=FONT - 1, length=0, pad=5)
    axes.set_xlabel(panel.x.label, fontsize=FONT, color=INK)
    size = FONT * min(1.0, _TITLE / max(1, len(panel.title)))
    figure.text(0.004, 0.985, panel.title, va="top", fontsize=size, fontweight="bold", color=INK)
    return figure


def svg(panel: Panel, name: str) -> str:
    """Return a panel as SVG; equal panels give equal texts."""
    import matplotlib as mpl  # noqa: PLC0415  (slow to import)

    buffer = io.StringIO()
    settings: Any = {
        "svg.hashsalt": name,
        "svg.fonttype": "none",
        "font.family": "sans-serif",
        "text.parse_math": False,
    }
    with mpl.rc_context(settings), _without_warnings():
        figure_of(panel).savefig(buffer, format="svg", dpi=72, metadata={"Date": None})
    text = buffer.getvalue()
    text = re.sub(r"<metadata>.*?</metadata>\s*|<!--.*?-->", "", text[text.index("<svg") :], flags=re.DOTALL)
    text = re.sub(r"(\d+\.\d{2})\d+", r"\1", text)
    text = re.sub(r'(id="|url\(#|href="#)(?!design:)', rf"\g<1>{name}-", text)
    names = 'xmlns:xlink="http://www.w3.org/1999/xlink"'
    head = f'<svg role="img" aria-label="{escape(panel.title)}" viewBox="0 0 {WIDTH} {HEIGHT}" {names}>'
    return re.sub(r"<svg [^>]*>", lambda _: head, text, count=1)


def png(panels: Sequence[Panel], columns: int = 2) -> bytes:
    """Return panels beside each other as one PNG, of twice their size."""
    import matplotlib as mpl  # noqa: PLC0415  (slow to import)
    from PIL import Image  # noqa: PLC0415

    images = []
    for panel in panels:
        buffer = io.BytesIO()
        with mpl.rc_context({"text.parse_math": False}), _without_warnings():
            figure_of(panel).savefig(buffer, format="png", dpi=144)
        images.append(Image.open(buffer).convert("RGB"))
    columns = min(columns, len(images))
    sheet = Image.new("RGB", (2 * WIDTH * columns, 2 * HEIGHT * -(-len(images) // columns)), "white")
    for at, image in enumerate(images):
        sheet.paste(image, (2 * WIDTH * (at % columns), 2 * HEIGHT * (at // columns)))
    buffer = io.BytesIO()
    sheet.quantize(256, dither=Image.Dither.NONE).save(buffer, format="png", optimize=True)
    return buffer.getvalue()


def _without_warnings() -> warnings.catch_warnings[None]:
    """Let Matplotlib say nothing of letters that a font lacks, or of an axis of one value."""
    return warnings.catch_warnings(action="ignore")


@dataclass(frozen=True)
class Section:
    """One question: panels, a table, a note."""

    title: str
    table: Table | None = None
    panels: tuple[Panel, ...] = ()
    note: str = ""


@dataclass(frozen=True)
class Answer:
    """A kind of answer with what its sentence needs beside the table of its section, and further sections.

    `of_all`: its sentence needs no row of the design that answers.
    """

    kind: str
    section: Section
    facts: Mapping[str, Any]
    more: Sequence[Section] = ()
    of_all: bool = False
