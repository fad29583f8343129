"""The documentation's table of columns is the one that the registry prints, and it covers every column."""

from __future__ import annotations

from pathlib import Path

from sweep.results.dictionary import KEYS, columns_table
from sweep.results.tables import ROW_COLUMNS

README = Path(__file__).parent.parent.parent / "sweep" / "README.md"


def test_the_readme_has_the_table_of_columns() -> None:
    assert "\n".join(columns_table()) in README.read_text()


def test_every_column_of_a_row_is_told() -> None:
    assert {*ROW_COLUMNS} <= {*KEYS}
