"""Canvas and colors of figures that are files: of curves, and of accuracy."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

TYPE_COLORS = {"green": "#009e73", "yellow": "#c9a800", "orange": "#e66100", "red": "#b2182b"}
CURVE_CYCLE = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000")


def panel_grid(count: int, columns: int, width_in: float, height_in: float) -> tuple[Figure, list[Axes]]:
    """Return an empty figure with `count` panels, row by row, with grids and open frames."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg  # noqa: PLC0415  (slow to import)
    from matplotlib.figure import Figure  # noqa: PLC0415

    figure = Figure(figsize=(width_in, height_in), layout="constrained")
    FigureCanvasAgg(figure)
    panels = [figure.add_subplot(-(-count // columns), columns, at + 1) for at in range(count)]
    for axes in panels:
        axes.grid(visible=True, color="#e4e4e4", linewidth=0.6)
        axes.set_axisbelow(True)
        for side in ("top", "right"):
            axes.spines[side].set_visible(False)
    return figure, panels
