"""Numbers in words of people, and what a table makes of them."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some

from sweep.report.numbers import amount, change, digits, inward, ranges
from sweep.report.panels import spread
from sweep.report.run import Series
from sweep.report.tables import Axis, Column, Marks, Table


@given(some.floats(1e-4, 1e9))
def test_three_digits_are_within_half_of_the_last(value: float) -> None:
    assert float(digits(value).replace(",", "")) == pytest.approx(value, rel=0.0051)


@given(some.floats(1e-6, 1e9), some.integers(2, 3))
def test_what_is_promised_holds(value: float, most: int) -> None:
    assert inward(value, most, up=False) <= value * (1 + 1e-11)
    assert inward(value, most, up=True) >= value * (1 - 1e-11)
    assert inward(value, most, up=True) == pytest.approx(value, rel=0.11)


@given(some.lists(some.floats(0, 300), min_size=1, max_size=9))
def test_names_are_apart_in_the_order_of_their_lines(heights: list[float]) -> None:
    placed = spread(sorted(heights), 17.0, 300.0)
    for low, high in pairwise(placed):
        assert high - low >= 17.0 - 0.5


@pytest.mark.parametrize(
    ("spans", "said"),
    [
        ([], "nowhere"),
        ([(-np.inf, np.inf)], "any of 20 to 300 m"),
        ([(-np.inf, 284.6)], "up to 280 m"),  # inward, of two digits
        ([(131.2, np.inf)], "from 140 m"),
        ([(88.1, 101.0), (130.0, 171.0)], "89 to 100 m, 130 to 170 m"),
        ([(100.2, 100.4)], "near 110 m"),
    ],
)
def test_ranges_are_rounded_inward_and_an_end_of_the_list_is_no_end(
    spans: list[tuple[float, float]], said: str
) -> None:
    assert ranges(spans, "m", (20.0, 300.0), 2).replace("\u00a0", " ") == said


def test_differences_below_what_is_shown_are_equal() -> None:
    column = Column("separation", "DN", "more")
    table = Table.of({"goal": (column, {"RGGB": 140.0, "same": 140.4, "more": 150.0, "less": 130.0})}, reference="RGGB")
    assert [table.cell(name, "goal").kind for name in table.rows] == ["", "", "gain", "loss"]
    assert [change(value, 140.0).split("\u00a0")[0] for value in (140.02, 140.4, 234, 500)] == [
        "±0",
        "+0.3",
        "+67",
        "\u00d7",
    ]


def test_a_table_is_text_markdown_and_a_frame() -> None:
    columns = {
        "goal": (Column("separation", "DN", "more", "what it is"), {"RGGB": 139.66, "mine": 234.1}),
        "least": (Column("least", "DN", promise=True), {"RGGB": 60.69, "mine": 55.0}),
        "none": (Column("empty"), {"RGGB": float("nan"), "mine": None}),
        "track": (Column("ahead", axis=Axis("distance", "m", 0, 100)), {"RGGB": Marks(), "mine": Marks([(0, 50)], (), "up to 50 m")}),
    }  # fmt: skip
    table = Table.of(columns, reference="RGGB", hero="mine")
    assert list(table.columns) == ["goal", "least", "track"]
    assert table.cell("mine", "track").track == ((0.0, 50.0),)
    assert table.cell("RGGB", "least").text == "60.6\u00a0DN"  # rounded down
    assert table.quoted("goal", " of 4,095") == "**234\u00a0DN** of 4,095 (RGGB 140\u00a0DN)"
    assert table.markdown.splitlines()[-1] == "| mine | 234 DN ▲ | 55.0 DN | up to 50 m |"
    assert table.lines[1].split() == ["RGGB", "140", "DN", "60.6", "DN"]
    assert table.frame.attrs["goal"] == {"unit": "DN", "meaning": "what it is"}


@given(some.lists(some.floats(-5, 5), min_size=3, max_size=7), some.booleans())
def test_a_line_is_above_another_in_its_ranges_and_nowhere_else(gaps: list[float], log: bool) -> None:
    x = np.geomspace(1, 100, len(gaps)) if log else np.linspace(1, 3, len(gaps))
    one = Series("", "distance_m", {str(number): float(number) for number in x})
    spans = one.above(np.array(gaps), 0.0)
    for number, gap in zip(x, gaps, strict=True):
        inside = any(low <= number <= high for low, high in spans)
        assert (
            inside == (gap >= 0) or abs(gap) < 1e-9 or np.isclose(number, [end for span in spans for end in span]).any()
        )


@pytest.mark.parametrize(("value", "unit", "said"), [(0.00556, "s", "5.56 ms"), (0.591, "share", "59.1 %"), (1e-3, "error", "1 in 1,000"), (0.9987, "yield", "99.87 %")])  # fmt: skip
def test_amounts_have_units_of_people(value: float, unit: str, said: str) -> None:
    assert amount(value, unit).replace("\u00a0", " ") == said
