"""The notebooks of the project run from top to bottom, anywhere."""

from __future__ import annotations

import os
import re
import subprocess
import sys
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
def test_a_notebook_runs(notebook: Path, tmp_path: Path) -> None:
    text = notebook.read_text()
    assert "format_name: percent" in text
    assert len(re.findall(r"^# %%$", text, re.MULTILINE)) >= 3
    assert len(re.findall(r"^# %% \[markdown\]$", text, re.MULTILINE)) >= 3
    environment = os.environ | {"MPLBACKEND": "agg", "TMPDIR": str(tmp_path), "OMP_NUM_THREADS": "1"}
    done = subprocess.run(
        [sys.executable, str(notebook)], cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert "csd_yellow_red" in done.stdout
    assert "Warning" not in done.stderr


def test_there_is_a_notebook_for_each_way_in() -> None:
    assert {path.stem for path in NOTEBOOKS} >= {"first_filter", "own_sensor_and_lights", "own_family"}
