"""What the shell completes: study files and folders of runs, two levels down from what was typed."""

from __future__ import annotations

import os
from glob import escape
from pathlib import Path

_STUDIES = ("*.yaml", "*.yml", "*/*.yaml", "*/*.yml")
_RUNS = ("*/run.json", "*/provenance.json", "*/*/run.json", "*/*/provenance.json")


def study_files(incomplete: str) -> list[str]:
    """Study files whose path begins with what was typed; none leaves the completion to the shell."""
    return _matches(incomplete, _STUDIES)


def run_folders(incomplete: str) -> list[str]:
    """Folders that hold a run, by what was typed."""
    return sorted({str(Path(found).parent) for found in _matches(incomplete, _RUNS)})


def _matches(incomplete: str, patterns: tuple[str, ...]) -> list[str]:
    """What begins as typed: globbing from the last whole folder keeps a path as its user writes it."""
    folder, typed = os.path.split(incomplete)
    found = {path for pattern in patterns for path in Path(folder).glob(escape(typed) + pattern)}
    return sorted(str(path) for path in found)
