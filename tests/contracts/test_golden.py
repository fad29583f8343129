"""The numbers of the project's studies are those that are kept, of every column."""

from __future__ import annotations

import pandas as pd
import pytest

from ..golden import DEAR, FILE, NAMES, changes, golden_rows


@pytest.mark.parametrize("name", [pytest.param(n, marks=pytest.mark.slow) if n in DEAR else n for n in NAMES])
def test_numbers_are_those_that_are_kept(name: str) -> None:
    """After a change on purpose, `python -m tests.golden` keeps them anew, and says which changed."""
    kept = pd.read_parquet(FILE, filters=[("file", "==", name)])
    assert len(kept) > 20
    changed = changes(kept, golden_rows(name))
    assert changed.empty, changed.to_string(max_rows=10)


def test_a_number_that_changes_is_seen() -> None:
    kept = pd.read_parquet(FILE, filters=[("file", "==", "paper")])
    found = kept.assign(value=kept["value"].where(kept["column"] != "csd_yellow_red", kept["value"] * (1 + 3e-6)))
    assert changes(kept, kept).empty
    assert set(changes(kept, found)["column"]) == {"csd_yellow_red"}
    assert len(changes(kept, kept.iloc[1:])) == 1
