"""The notebooks of the project run from top to bottom, anywhere."""

from __future__ import annotations

import runpy
import tempfile
from pathlib import Path

import pytest

from ..conftest import STUDIES

NOTEBOOKS = sorted((STUDIES / "notebooks").glob("*.py"))


@pytest.mark.parametrize(
    "notebook",
    [
        pytest.param(path, marks=[] if path.stem == "first_filter" else pytest.mark.slow, id=path.stem)
        for path in NOTEBOOKS
    ],
)
def test_a_notebook_runs(
    notebook: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """In this process, where a warning is an error."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.argv", [str(notebook)])
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    runpy.run_path(str(notebook), run_name="__main__")
    assert "csd_yellow_red" in capsys.readouterr().out
