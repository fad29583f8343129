"""Numbers and names in words of people."""

from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as some

from sweep.report.look import spread
from sweep.report.words import digits, inward


@given(some.floats(1e-4, 1e9))
def test_three_digits_are_within_half_of_the_last(value: float) -> None:
    shown = float(digits(value).replace(",", ""))
    assert shown == pytest.approx(value, rel=0.0051)


@given(some.floats(1e-6, 1e9))
def test_ends_are_rounded_to_their_side(value: float) -> None:
    assert inward(value, up=False) <= value * (1 + 1e-11)
    assert inward(value, up=True) >= value * (1 - 1e-11)
    assert inward(value, up=True) == pytest.approx(value, rel=0.011)


@given(some.lists(some.floats(0, 1), min_size=1, max_size=9), some.floats(0.01, 0.1))
def test_labels_are_apart_in_the_order_of_their_lines(heights: list[float], least: float) -> None:
    placed = spread(heights, least)
    pairs = sorted(zip(heights, placed, strict=True))
    for (low, first), (high, second) in pairwise(pairs):
        assert abs(second - first) >= least * (1 - 1e-9)
        assert high == low or second > first
