"""Kept answers: bit for bit what they were, and nothing but data of their types."""

from __future__ import annotations

import math
import struct
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sweep.results.records import from_json, to_json
from sweep.search.problem import Evaluation, SearchRun
from sweep.search.upper_bound import UpperBound

from ..tampering import hostile

numbers = st.floats(allow_nan=True, allow_infinity=True, allow_subnormal=True)


def bits(value: float) -> bytes:
    """NaN is one value, whatever its payload."""
    return b"nan" if math.isnan(value) else struct.pack("<d", value)


@settings(max_examples=60, deadline=None)
@given(
    st.integers(0, 99),
    st.text(),
    st.lists(st.tuples(st.lists(numbers, max_size=4), numbers, numbers, numbers, numbers)),
)
def test_a_search_comes_back_bit_for_bit(start: int, status: str, logged: list[tuple[list[float], ...]]) -> None:
    run = SearchRun(start, status, [Evaluation(np.array(x, dtype=float), *rest) for x, *rest in logged])
    again = from_json(SearchRun, to_json(run))
    assert (again.start, again.status, len(again.log)) == (start, status, len(logged))
    for made, read in zip(run.log, again.log, strict=True):
        assert read.x.dtype == np.float64
        assert [bits(v) for v in read.x] == [bits(v) for v in made.x]
        for name in ("objective", "sensitivity", "cfa_sensitivity", "violation"):
            assert bits(getattr(read, name)) == bits(getattr(made, name))


def test_a_limit_comes_back_whatever_its_fields() -> None:
    curve = np.array([0.1, -0.0, np.inf, np.nan, 5e-324])
    limit = UpperBound(-0.1, np.inf, curve, ('\u2028 \0 "',), 2**70, 1, (0.3,), True)
    again = from_json(UpperBound, to_json(limit))
    assert again.curve is not None
    assert again.curve.tobytes() == curve.tobytes()
    assert replace(again, curve=None) == replace(limit, curve=None)
    assert from_json(UpperBound, to_json(UpperBound(-np.inf, np.inf, None))).curve is None


@pytest.mark.parametrize("value", [object(), np.array([object()]), {3}, b"bytes", lambda: None])
def test_objects_other_than_data_are_not_kept(value: object) -> None:
    with pytest.raises(TypeError, match="cannot be kept"):
        to_json(value)


@pytest.mark.parametrize("content", hostile())
def test_a_text_that_is_no_answer_is_refused(content: bytes) -> None:
    with pytest.raises(ValueError, match=r"^no <class"):
        from_json(SearchRun, content)
