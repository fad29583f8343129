"""Every numerically hard case stays within the error that its derivation allows."""

from __future__ import annotations

import math
from importlib import import_module

import pytest

from .registry import CASES, HardCase, Result, hard_case, worst

for topic in ("chain", "confusion", "curves", "metrics", "noise", "optics", "search"):
    import_module(f".cases_{topic}", __package__)


def json_number(value: float) -> float | str:
    """A number as JSON knows it, or the word for one that it does not."""
    return value if math.isfinite(value) else str(value)


@pytest.mark.parametrize(
    "case", [pytest.param(case, id=case.name, marks=[pytest.mark.slow] if case.slow else []) for case in CASES]
)
def test_hard_case(case: HardCase, hard_case_rows: list[dict[str, object]]) -> None:
    row = {
        "case": case.name,
        "kind": case.kind,
        "oracle": case.oracle,
        "error": "raised",
        "allowed": 0.0,
        "why": case.why,
    }
    hard_case_rows.append(row)
    result = case.run()
    row |= {"error": json_number(float(result.error)), "allowed": json_number(float(result.allowed))}
    assert result.good, f"{case.name}: {result.error:.3g}, allowed {result.allowed:.3g} ({case.why})"


def test_each_case_has_a_name_of_its_own() -> None:
    assert len(CASES) >= 79
    assert len({case.name for case in CASES}) == len(CASES)


def test_nan_infinity_and_a_missing_derivation_are_failures() -> None:
    assert not Result(math.nan, 1.0).good
    assert not Result(math.inf, 1e300).good
    assert not Result(1.0, math.nan).good
    assert not worst([(0.0, 1.0), (math.nan, 1.0), (0.5, 1.0)]).good
    assert worst([(0.0, 0.0), (0.5, 1.0), (0.1, 1.0)]) == Result(0.5, 1.0)
    with pytest.raises(TypeError, match="derive the allowed error"):
        hard_case("no derivation")(lambda: Result(0.0, 0.0))
