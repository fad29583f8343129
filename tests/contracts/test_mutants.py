"""Faults that `make mutants` plants have their places, wherever modules and tests move."""

from __future__ import annotations

from ..mutants import misplaced


def test_every_mutant_has_its_text_and_its_tests() -> None:
    assert not misplaced()
