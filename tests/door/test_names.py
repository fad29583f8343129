"""`import sweep`: which names it gives out, what they load, and examples of each that run."""

from __future__ import annotations

import ast
import doctest
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import sweep

from ..conftest import ROOT

NAMES = {
    *("load_study", "make_study", "read_run", "read_curves", "studies", "sensor", "lights", "evaluate"),
    *("LoadedStudy", "FinishedRun", "Quantity", "SweepError"),
    *("Pixel", "Optics", "Scene", "Target", "WavelengthGrid"),
    *("Stopband", "MultiStopband", "Dual", "FreeForm"),
}
"""What users rely on: a name that goes, or comes, is a decision."""
GUIDE = ROOT / "studies" / "README.md"


def test_the_names_are_these() -> None:
    assert set(sweep.__all__) == {*NAMES, "__version__"}
    assert dir(sweep) == sorted(sweep.__all__)
    for name in NAMES:
        assert getattr(sweep, name).__doc__


def test_an_unknown_name_is_no_attribute() -> None:
    with pytest.raises(AttributeError, match="no attribute 'load_studies'"):
        sweep.load_studies  # noqa: B018


def test_types_are_told_of_the_very_names() -> None:
    """The stub imports each name from where the package takes it."""
    stub = ast.parse((ROOT / "sweep" / "__init__.pyi").read_text())
    told = {
        alias.asname or alias.name: f"{node.module}:{alias.name}"
        for node in stub.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    assert told == sweep._HOMES


def test_nothing_is_loaded_before_a_name_is_used() -> None:
    code = "import sys, sweep; print(*(name for name in sys.modules if name.startswith('sweep.') or name == 'numpy'))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []


@pytest.mark.slow
def test_the_guide_runs_and_shows_every_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shown = re.findall(r"sweep\.([A-Za-z_]+)", "\n".join(re.findall(r"^(?:>>>|\.\.\.) .*", GUIDE.read_text(), re.M)))
    assert set(shown) >= NAMES
    (tmp_path / "my_filter.csv").write_text("wavelength_nm,mine\n400,0.9\n700,0.9\n")
    monkeypatch.chdir(tmp_path)
    ran = doctest.testfile(os.fspath(GUIDE), module_relative=False, optionflags=doctest.NORMALIZE_WHITESPACE)
    assert ran.attempted > 20
    assert ran.failed == 0


@pytest.mark.parametrize("name", ["objects", "opening", "given"])
def test_examples_in_the_code_run(name: str) -> None:
    module = __import__(f"sweep.door.{name}", fromlist=[name])
    assert doctest.testmod(module).failed == 0
