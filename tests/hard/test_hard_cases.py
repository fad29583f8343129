"""Every numerically hard case stays within the error that its derivation allows."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

from . import (
    cases_chain,  # noqa: F401
    cases_confusion,  # noqa: F401
    cases_curves,  # noqa: F401
    cases_metrics,  # noqa: F401
    cases_noise,  # noqa: F401
    cases_optics,  # noqa: F401
    cases_search,  # noqa: F401
    cases_simulation,  # noqa: F401
)
from .registry import CASES, HardCase, Result, hard_case, worst, write_table

LEAST = 40


def json_number(value: float) -> float | str:
    """A number as JSON knows it, or the word for one that it does not."""
    return value if math.isfinite(value) else str(value)


@pytest.mark.parametrize(
    "case", [pytest.param(case, id=case.name, marks=[pytest.mark.slow] if case.slow else []) for case in CASES]
)
def test_hard_case(case: HardCase, hard_case_rows: list[dict[str, object]]) -> None:
    row = {"case": case.name, "oracle": case.oracle, "error": "raised", "allowed": 0.0, "why": case.why}
    hard_case_rows.append(row)
    found = case.run()
    row |= {"error": json_number(float(found.error)), "allowed": json_number(float(found.allowed))}
    assert found.good, f"{case.name}: {found.error:.3g}, allowed {found.allowed:.3g} ({case.why})"


def test_cases_are_many_and_say_what_they_are_compared_with() -> None:
    assert len(CASES) >= LEAST
    names = [case.name for case in CASES]
    assert len(set(names)) == len(names)
    assert all(case.oracle and case.why for case in CASES)


def test_nan_and_infinity_are_failures() -> None:
    assert not Result(math.nan, 1.0).good
    assert not Result(math.inf, 1e300).good
    assert not Result(1.0, math.nan).good
    assert not worst([(0.0, 1.0), (math.nan, 1.0), (0.5, 1.0)]).good
    assert worst([(0.0, 0.0), (0.5, 1.0), (0.1, 1.0)]) == Result(0.5, 1.0)
    with pytest.raises(TypeError):
        hard_case("no derivation", oracle="none")  # type: ignore[call-arg]


def test_table_is_written_whole(tmp_path: Path) -> None:
    path = tmp_path / "new" / "table.json"
    for rows in ([{"case": "a", "error": json_number(math.inf)}], [{"case": "b", "error": json_number(0.5)}]):
        write_table(path, rows)
        assert json.loads(path.read_text()) == rows
    assert [item.name for item in path.parent.iterdir()] == ["table.json"]
