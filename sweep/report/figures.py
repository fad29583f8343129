"""Figures of files, of comparisons and of accuracy: canvas, axes, and files of a drawing (PNG and SVG)."""

from __future__ import annotations

import io
import re
import warnings
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

CURVE_COLORS = {
    "R": "#d62728",
    "Rx": "#8c2d04",
    "G": "#2ca02c",
    "B": "#1f77b4",
    "Y": "#c9a800",
    "Cy": "#17a2a2",
    "C": "#555555",
    "W": "#999999",
}
TYPE_COLORS = {"green": "#009e73", "yellow": "#c9a800", "orange": "#e66100", "red": "#b2182b"}
CURVE_CYCLE = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000")
DASHES = ("-", (0, (6, 2)), (0, (1, 1.5)), (0, (6, 2, 1, 2)))
"""Dashes of lines, by which equal ones are both seen."""
_DPI = 160
_COMPRESSION = 3
"""Compression level of a PNG: at its usual 6 a file is a tenth smaller and takes twice as long."""
_CLIP_PATH = re.compile(rb"\bp[0-9a-f]{10}\b")
Drawing = Callable[[], "Figure"]
"""A delayed drawing: a process that draws nothing does not load matplotlib."""


def legend_beside(axes: Axes, title: str | None = None) -> None:
    """Put a legend to the right of the axes, if there is anything in it."""
    if axes.get_legend_handles_labels()[0]:
        place: dict[str, Any] = {"loc": "upper left", "bbox_to_anchor": (1.01, 1.0), "borderaxespad": 0}
        axes.legend(title=title, fontsize=8, title_fontsize=8, frameon=False, **place)


def canvas(width_in: float, height_in: float) -> tuple[Figure, Axes]:
    """Return an empty figure with one pair of axes."""
    figure, (axes,) = canvas_grid(1, 1, width_in, height_in)
    return figure, axes


def canvas_grid(rows: int, columns: int, width_in: float, height_in: float) -> tuple[Figure, list[Axes]]:
    """Return an empty figure with a grid of axes, row by row."""
    figure = empty_figure(width_in, height_in)
    panels = [figure.add_subplot(rows, columns, at + 1) for at in range(rows * columns)]
    for axes in panels:
        decorate(axes)
    return figure, panels


def panel_grid(
    count: int, most_columns: int, panel_in: tuple[float, float], around_in: tuple[float, float]
) -> tuple[Figure, list[Axes]]:
    """Return an empty figure with undecorated axes, row by row.

    `count`, `most_columns`: number of panels, and of columns at most.
    """
    columns = min(most_columns, count)
    rows = -(-count // columns)
    figure = empty_figure(panel_in[0] * columns + around_in[0], panel_in[1] * rows + around_in[1])
    return figure, [figure.add_subplot(rows, columns, at + 1) for at in range(count)]


def empty_figure(width_in: float, height_in: float) -> Figure:
    """Return a figure without axes."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg  # noqa: PLC0415  (slow to import)
    from matplotlib.figure import Figure  # noqa: PLC0415

    figure = Figure(figsize=(width_in, height_in), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def decorate(axes: Axes) -> None:
    """Add grid and open frame to axes."""
    axes.grid(visible=True, color="#e4e4e4", linewidth=0.6)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def pictures_of(draw: Drawing, kinds: Sequence[str]) -> dict[str, bytes]:
    """Draw a figure and return it as files."""
    figure = draw()
    return {kind: rendered(figure, kind) for kind in kinds}


def rendered(figure: Figure, kind: str) -> bytes:
    """Return a drawn figure as a file; equal figures give equal bytes."""
    import matplotlib as mpl  # noqa: PLC0415  (slow to import)

    for axes in figure.axes:  # a name is no formula; numbers along a logarithmic axis are
        legend = axes.get_legend()
        texts = [axes.title, axes.xaxis.label, axes.yaxis.label, *axes.texts, *(legend.get_texts() if legend else ())]
        for text in texts:
            text.set_parse_math(False)
    for text in figure.texts:
        text.set_parse_math(False)
    buffer = io.BytesIO()
    options: dict[str, Any] = {"metadata": {"Date" if kind == "svg" else "Software": None}}
    if kind == "png":
        options["pil_kwargs"] = {"compress_level": _COMPRESSION}
    with mpl.rc_context({"svg.hashsalt": "cfa-sweep", "svg.fonttype": "path"}), warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph")  # a name in a script that the font lacks
        figure.savefig(buffer, format=kind, dpi=_DPI, **options)
    figure.set_layout_engine("none")  # the layout holds for the other kind, too
    if kind != "svg":
        return buffer.getvalue()
    numbers: dict[bytes, bytes] = {}  # names of clip paths hash the last bits of a layout, which may differ
    return _CLIP_PATH.sub(lambda name: numbers.setdefault(name[0], b"clip%d" % len(numbers)), buffer.getvalue())
