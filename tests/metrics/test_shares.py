"""Shares as people read them."""

from __future__ import annotations

from hypothesis import example, given
from hypothesis import strategies as some

from sweep.metrics.share import format_share


def test_a_share_below_one_is_not_printed_as_100_percent() -> None:
    told = [format_share(share) for share in (0.9998, 0.99997, 0.977, 0.9996, 1.0, 0.0, 0.0004, 1 - 1e-16)]
    assert told == ["99.98%", "99.997%", "97.7%", "99.96%", "100%", "0%", "0.04%", "100%"]


@example(share=5e-9, digits=0)
@given(share=some.floats(1e-9, 1 - 1e-9), digits=some.integers(0, 3))
def test_a_formatted_share_is_near_its_value(share: float, digits: int) -> None:
    told = float(format_share(share, digits).removesuffix("%"))
    assert 0 < told < 100
    assert abs(told - 100 * share) <= 0.500001 * 10.0**-digits
