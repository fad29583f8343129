"""Names of any length: figures that cut them, and axes that stay."""

from __future__ import annotations

import numpy as np
import pytest

from sweep.report.panels import Line, Lines, Panel, Picture
from sweep.report.point_panels import Dots, Point, Scatter
from sweep.report.row_panels import Ratio, Ratios, Row, Rows

LONG = "a_name_of_" + 11 * "letters_ab"
TWO = np.array([1.0, 2.0])
PANELS: list[Panel] = [
    Lines("title", "x", {LONG: Line(TWO, TWO), "short": Line(TWO, 2 * TWO)}),
    Scatter("title", "x", (Point(LONG, 1.0, 2.0, f"{LONG} 2 DN"), Point("short", 2.0, 1.0, "short"))),
    Dots("title", "x", {LONG: (TWO, TWO)}),
    Rows("title", "x", (Row(LONG, 1.0, text="1 DN"), Row("short", 2.0, text=LONG))),
    Ratios("title", "x", (Ratio(LONG, LONG, 1.2), Ratio("short", "short", 0.8))),
]


@pytest.mark.parametrize("wide", [True, False])
@pytest.mark.parametrize("panel", PANELS, ids=lambda panel: type(panel).__name__)
def test_the_longest_names_leave_room_for_the_axes(panel: Panel, wide: bool) -> None:
    figure = Picture((panel,), "names").figure(wide=wide)
    (axes,) = figure.axes
    assert axes.get_position().width > 0.2
