"""The commands as a user runs them."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from ..build import study_file
from ..commanded import commanded, sweep
from ..conftest import FinishedFolder


@pytest.mark.slow
@pytest.mark.long
def test_report_command_makes_it_again(finished: FinishedFolder) -> None:
    folder = finished("stopband")
    page = folder / "report.html"
    before, made_ns = page.read_bytes(), page.stat().st_mtime_ns
    done = sweep("report", str(folder))
    assert done.returncode == 0
    before_s, after_s = (
        re.sub("Took .*\n", "", said) for said in (folder.with_name("stopband.said.txt").read_text(), done.stdout)
    )
    assert after_s == before_s
    assert page.stat().st_mtime_ns > made_ns
    assert page.read_bytes() == before


def test_an_infeasible_study_names_the_constraint_and_writes_nothing(tmp_path: Path) -> None:
    text = study_file(tmp_path).read_text().replace("{min: 0.9}", "{min: 1.01}")
    (tmp_path / "infeasible.yaml").write_text(text)
    code, _, said = commanded("run", tmp_path / "infeasible.yaml", "--output", tmp_path / "out", "--jobs", "1")
    assert (code, "constraints.sensitivity: out of reach" in said) == (3, True)
    assert not list((tmp_path / "out").iterdir())
