"""Numbers and names in words of people."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as some

from sweep.report.look import spread, styles_of
from sweep.report.series import Numbers, scene_in_words
from sweep.report.words import amount, change, digits, inward, lamp, number, one_in


@pytest.mark.parametrize(
    ("value", "said"),
    [(234.1, "234"), (31.05, "31.1"), (7.874, "7.87"), (0.37772, "0.378"), (124764.0, "125,000"), (999.9, "1,000"), (0.0, "0"),
     (-5.2, "−5.20"), (math.nan, "unknown"), (2.3e-6, "2.3e-06")],
)  # fmt: skip
def test_a_number_has_three_digits(value: float, said: str) -> None:
    assert digits(value) == said


@given(some.floats(1e-4, 1e9))
def test_three_digits_are_within_half_of_the_last(value: float) -> None:
    shown = float(digits(value).replace(",", ""))
    assert shown == pytest.approx(value, rel=0.0051)


@given(some.floats(1e-6, 1e9))
def test_ends_are_rounded_to_their_side(value: float) -> None:
    assert inward(value, up=False) <= value * (1 + 1e-11)
    assert inward(value, up=True) >= value * (1 - 1e-11)
    assert inward(value, up=True) == pytest.approx(value, rel=0.011)


def test_units_are_those_of_people() -> None:
    assert amount(0.00849, "s") == "8.49\u00a0ms"
    assert amount(0.591, "share") == "59.1\u00a0%"
    assert number(300.0) == "300"
    assert number(0.8) == "0.8"
    assert one_in(1e-3) == "1 in 1,000"
    assert one_in(0) == "fewer than 1 in a trillion"
    assert (change(234.0, 139.0), change(748.0, 199.0), change(4.37, 8.49)) == ("+68\u00a0%", "× 3.76", "−49\u00a0%")
    assert change(1.001, 1.0) == "±0 %"


def test_lamps_and_scenes_have_names() -> None:
    assert lamp("germany_05_yellow") == "a German yellow (lamp 5)"
    assert lamp("us_11_red") == "a US red (lamp 11)"
    assert lamp("amber_592") == "amber_592"
    assert scene_in_words("pulsed exposure_s=0.001") == "pulsed at 1\u00a0ms"
    assert scene_in_words("f/1.6 cra_deg=30") == "f/1.6 at 30\u00a0degrees"
    assert scene_in_words("lamp intensity_cd=139.123456") == "lamp at 139\u00a0cd"
    assert Numbers("a", "duty", (0.05, 1.0)).at(0) == "5\u00a0%"


@given(some.lists(some.floats(0, 1), min_size=1, max_size=9), some.floats(0.01, 0.1))
def test_labels_are_apart_in_the_order_of_their_lines(heights: list[float], least: float) -> None:
    placed = spread(heights, least)
    pairs = sorted(zip(heights, placed, strict=True))
    for (low, first), (high, second) in pairwise(pairs):
        assert abs(second - first) >= least * (1 - 1e-9)
        assert high == low or second > first


def test_names_look_alike_on_every_page_and_no_two_on_one() -> None:
    names = ["RGGB", "RYYCy", "best stopband", "mine", "yours"]
    styles = styles_of(names)
    assert styles["RGGB"] == styles_of(["RGGB"])["RGGB"]
    assert len({style.color for style in styles.values()}) == len(names)
