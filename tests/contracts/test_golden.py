"""The numbers of the project's studies are those that are kept, of every column."""

from __future__ import annotations

import pandas as pd
import pytest

from ..conftest import STUDIES
from ..golden import DEAR, FILE, NAMES, changes, golden_rows


@pytest.mark.parametrize("name", [pytest.param(n, marks=pytest.mark.slow) if n in DEAR else n for n in NAMES])
def test_numbers_are_those_that_are_kept(name: str) -> None:
    """After a change on purpose, `python -m tests.golden` keeps them anew, and says which changed."""
    kept = pd.read_parquet(FILE, filters=[("file", "==", name)])
    assert len(kept) > 20
    changed = changes(kept, golden_rows(name))
    assert changed.empty, changed.to_string(max_rows=10)


@pytest.mark.parametrize(
    ("study", "head", "column"),
    [
        ("robust", "| worst case: temperature, bins, edges |", "worst_csd_yellow_red"),
        ("angle", "| worst over CRA 0 to 20 degrees, f/1.6 |", "csd_yellow_red"),
    ],
)
def test_a_table_of_the_guide_has_the_numbers_that_are_kept(study: str, head: str, column: str) -> None:
    text = (STUDIES / "guide" / "06-lamps-angles-tolerances.md").read_text(encoding="utf-8")
    printed = text.split(head)[1].split("\n\n")[0].splitlines()
    kept = pd.read_parquet(FILE, filters=[("file", "==", study), ("column", "==", column)])
    assert len(kept) >= 4
    for name, value in zip(kept["name"], kept["value"], strict=True):
        (row,) = [line for line in printed if line.startswith(f"| {name.split(' ', 1)[1]} |")]
        assert row.endswith(f"| {value:.0f} |")
