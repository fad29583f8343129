"""`import sweep`: which names it gives out, what they load, and examples of each that run."""

from __future__ import annotations

import ast
import doctest
import subprocess
import sys

import pytest

import sweep

from ..conftest import ROOT

NAMES = {
    *("load_study", "make_study", "read_run", "read_curves", "studies", "sensor", "lights", "evaluate"),
    *(
        "check",
        "plan",
        "new_study",
        "list_studies",
        "run",
        "status",
        "show",
        "audit",
        "compare",
        "export",
        "export_images",
        "score",
    ),
    *("describe", "Answer", "LoadedStudy", "FinishedRun", "Quantity", "SweepError"),
    *("Pixel", "Optics", "Scene", "Target", "WavelengthGrid"),
    *("Stopband", "MultiStopband", "Dual", "FreeForm"),
}
"""What users rely on: a name that goes, or comes, is a decision."""


def test_the_names_are_these() -> None:
    assert set(sweep.__all__) == {*NAMES, "__version__"}
    assert dir(sweep) == sorted(sweep.__all__)
    for name in NAMES:
        assert getattr(sweep, name).__doc__


def test_an_unknown_name_is_no_attribute() -> None:
    with pytest.raises(AttributeError, match="no attribute 'load_studies'"):
        sweep.load_studies  # noqa: B018


def test_stub_file_types_the_public_names() -> None:
    """The stub imports each name from where the package takes it."""
    stub = ast.parse((ROOT / "sweep" / "__init__.pyi").read_text())
    told = {
        alias.asname or alias.name: f"{node.module}:{alias.name}"
        for node in stub.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    assert told == sweep._LOCATIONS


def test_nothing_is_loaded_before_a_name_is_used() -> None:
    code = "import sys, sweep; print(*(name for name in sys.modules if name.startswith('sweep.') or name == 'numpy'))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []


@pytest.mark.parametrize("name", ["objects", "loading", "inline_curves", "evaluate"])
def test_examples_in_the_code_run(name: str) -> None:
    module = __import__(f"sweep.api.{name}", fromlist=[name])
    assert doctest.testmod(module).failed == 0
