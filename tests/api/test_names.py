"""`import sweep`: which names it gives out, what they load, and examples of each that run."""

from __future__ import annotations

import ast
import doctest
import subprocess
import sys

import pytest

import sweep
from sweep.study.editors import study_schema

from ..conftest import ROOT


def test_every_name_is_there_and_documented() -> None:
    assert dir(sweep) == sorted(sweep.__all__)
    for name in sweep.__all__:
        assert getattr(sweep, name).__doc__


def test_stub_file_types_the_public_names() -> None:
    """The stub imports each name from where the package takes it."""
    stub = ast.parse((ROOT / "sweep" / "__init__.pyi").read_text())
    told = {
        alias.asname or alias.name: f"{node.module}:{alias.name}"
        for node in stub.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    assert sweep._LOCATIONS.items() <= told.items()


def test_nothing_is_loaded_before_a_name_is_used() -> None:
    code = "import sys, sweep; print(*(name for name in sys.modules if name.startswith('sweep.') or name == 'numpy'))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert all(name.startswith("sweep.features") and name.count(".") <= 2 for name in done.stdout.split())


@pytest.mark.parametrize("name", ["objects", "loading", "inline_curves", "evaluate"])
def test_examples_in_the_code_run(name: str) -> None:
    module = __import__(f"sweep.api.{name}", fromlist=[name])
    assert doctest.testmod(module).failed == 0


def test_help_of_a_section_says_its_keys() -> None:
    assert sweep.Target.__doc__ is not None
    assert "distance_m\n    Distance, m." in sweep.Target.__doc__
    assert "Parameters" not in study_schema()["$defs"]["Target"]["description"]
