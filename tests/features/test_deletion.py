"""Without a feature's folder and its name the package loads, a study runs to its page, and its command is unknown."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from sweep.features import FEATURES

from ..build import STUDY
from ..conftest import ROOT

COMMANDS = {name: [name] for name in FEATURES}
"""Words after `sweep` that a package without the feature does not know."""
CORE = ["tests/test_layers.py", "tests/api", "tests/results", "tests/cli/test_json.py"]
"""Quick tests of the core that know a feature, or all of the package."""


def without(folder: Path, *names: str) -> dict[str, str]:
    """Copy the package without some features; the environment in which Python takes it."""
    ignored = shutil.ignore_patterns("*.pyc")
    for part in ("sweep", "tests", "studies"):
        shutil.copytree(ROOT / part, folder / part, ignore=ignored)
    for file in ("pyproject.toml", "README.md", "CHANGELOG.md", "Makefile"):
        shutil.copy(ROOT / file, folder)
    (folder / "outputs").mkdir()
    shutil.copy(ROOT / "outputs" / "README.md", folder / "outputs")
    of_features = folder / "sweep" / "features" / "__init__.py"
    text = of_features.read_text()
    for name in names:
        shutil.rmtree(of_features.parent / name)
        shutil.rmtree(folder / "tests" / "features" / name)
        text, found = re.subn(rf'    "{name}": .*\n', "", text)
        assert found == 1
    of_features.write_text(text)
    return os.environ | {"PYTHONPATH": str(folder)}


def said(folder: Path, environment: dict[str, str], *words: str) -> tuple[int, str]:
    done = subprocess.run(
        [sys.executable, *words], cwd=folder, env=environment, capture_output=True, text=True, check=False
    )
    return done.returncode, done.stdout + done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("name", FEATURES)
def test_without_a_feature_the_rest_works(tmp_path: Path, name: str) -> None:
    environment = without(tmp_path, name)
    (tmp_path / "small.yaml").write_text(STUDY.replace("COUNT", "3"))
    code, text = said(tmp_path, environment, "-m", "sweep", "run", "small.yaml", "--output", "out", "--jobs", "1")
    assert code == 0, text
    assert [*tmp_path.glob("out/*/report.html")]
    code, text = said(tmp_path, environment, "-m", "sweep", *COMMANDS[name])
    assert (code, "No such command" in text) == (2, True), text


@pytest.mark.slow
def test_without_features_the_tests_of_the_core_pass(tmp_path: Path) -> None:
    environment = without(tmp_path, *FEATURES)
    code, text = said(tmp_path, environment, "-m", "pytest", "-q", "-p", "no:cacheprovider", *CORE)
    assert code == 0, text[-3000:]
