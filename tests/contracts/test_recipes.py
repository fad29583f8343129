"""What `sweep/README.md` says is enough to add a family or a command: one new file, and it works everywhere."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest

GRAY = '''\
"""A filter that takes the same share of all light."""

import numpy as np

from sweep.designs.family import Parameter
from sweep.types import Section


class Gray:
    kind = "gray"
    n_modified = 1
    needs_target = False
    Options = Section
    start_dimensions = None
    parameters = (Parameter("share", 0, 1),)
    dimensions = {}

    def __init__(self, base):
        self._base = base

    @classmethod
    def of_study(cls, wavelength_nm, base, target, options):
        return cls(base)

    def curves(self, x):
        return (self._base * x[:, :1])[:, None, :]

    def upper(self, low, high):
        return self.curves(high[None])[0]

    def lower(self, low, high):
        return self.curves(low[None])[0]

    def hull(self, low, high):
        return self.lower(low, high), self.upper(low, high)

    def gradient(self, x):
        return self._base[None, None, :].copy()

    def shifted(self, shift_nm):
        return self

    def start(self, points):
        return points

    def violation(self, x):
        return np.zeros((len(x), 1))

    def violation_gradient(self, x):
        return np.zeros((1, 1))
'''
STUDY = """\
study: gray
sensor: ar0820
lights: tl16
cfas: [RGGB, RYNCy]
sweeps:
  shares: {cfa: RYNCy, family: gray, channel: N, base: Y, grid: {share: {min: 0, max: 1, count: 21}}}
constraints: {sensitivity: {min: 0.6}}
search: {starts: 2, max_evaluations: 60}
"""
HELLO = '''\
"""Say hello."""

import typer

from sweep.commands.panels import TOOL

PANEL = TOOL


def hello(name: str) -> None:
    """Greet somebody."""
    typer.echo(f"Hello, {name}.")
'''


def with_file(package: str, file: Path, *arguments: object) -> subprocess.CompletedProcess[str]:
    """The command, with one more file in a package."""
    program = f"import sys, {package} as room; room.__path__.append(sys.argv.pop(1)); from sweep.commands.app import main; main()"
    command = [sys.executable, "-c", program, str(file.parent), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def test_a_family_is_one_new_file(tmp_path: Path) -> None:
    file, study = tmp_path / "more" / "gray.py", tmp_path / "gray.yaml"
    file.parent.mkdir()
    file.write_text(GRAY)
    study.write_text(STUDY)
    package = "sweep.designs.families"
    done = with_file(package, file, "run", study, "--output", tmp_path / "out", "--jobs", 1)
    assert done.returncode == 0, done.stderr
    rows = pd.read_parquet(tmp_path / "out" / "gray" / "results.parquet")
    swept = rows[rows["kind"] == "sweep"]
    assert set(rows["status"]) == {"ok"}
    assert swept["sensitivity"].tolist() == pytest.approx(swept["share"].tolist())
    # The best that is found is as good as the best that was swept, but for rounding.
    best, front = rows[rows["kind"] == "search"].iloc[0], swept[swept["feasible"]]
    assert best["family"] == "gray"
    assert best["csd_yellow_red"] >= front["csd_yellow_red"].max() - 1
    assert (tmp_path / "out" / "gray" / "report.html").is_file()
    without = subprocess.run(
        [sys.executable, "-m", "sweep", "check", study], capture_output=True, text=True, check=False
    )
    assert without.returncode == 2
    assert "unknown family (got 'gray')" in without.stderr


def test_a_command_is_one_new_file(tmp_path: Path) -> None:
    file = tmp_path / "hello.py"
    file.write_text(HELLO)
    done = with_file("sweep.commands.verbs", file, "hello", "world")
    assert (done.returncode, done.stdout, done.stderr) == (0, "Hello, world.\n", "")
    assert " hello " in with_file("sweep.commands.verbs", file, "--help").stdout
