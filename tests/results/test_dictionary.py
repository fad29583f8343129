"""The documentation's table of columns is the one that the registry prints, and it covers every column."""

from __future__ import annotations

from sweep.results.dictionary import FILES, KEYS, columns_table, files_table
from sweep.results.tables import MADE_BY_RUN, ROW_COLUMNS

from ..conftest import ROOT

README = ROOT / "outputs" / "README.md"


def test_the_readme_has_the_table_of_columns() -> None:
    assert "\n".join(columns_table()) in README.read_text()


def test_the_readme_has_the_table_of_files() -> None:
    assert "\n".join(files_table()) in README.read_text()
    assert set(FILES) >= MADE_BY_RUN


def test_every_column_of_a_row_is_documented() -> None:
    assert {*ROW_COLUMNS} <= {*KEYS}
