"""Without a feature's folder and its name the package loads, a study runs to its page, and its command is unknown."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import product
from pathlib import Path

import pytest

from sweep.features import FEATURES

from ..build import STUDY
from ..conftest import ROOT

COMMANDS = {name: [name] for name in FEATURES}
"""Words after `sweep` that a package without the feature does not know."""
CORE = ["tests/test_layers.py", "tests/api/test_names.py", "tests/cli/test_json.py"]
"""Quick tests of the core that know a feature, or all of the package."""


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the package and its tests."""
    folder = tmp_path_factory.mktemp("copy")
    for part in ("sweep", "tests", "studies"):
        shutil.copytree(ROOT / part, folder / part, ignore=shutil.ignore_patterns("__pycache__"))
    for file in ("pyproject.toml", "README.md", "CHANGELOG.md", "Makefile"):
        shutil.copy(ROOT / file, folder)
    (folder / "outputs").mkdir()
    shutil.copy(ROOT / "outputs" / "README.md", folder / "outputs")
    return folder


@contextmanager
def without(folder: Path, *names: str) -> Iterator[None]:
    """The copy without some features, in their folders and in the list."""
    kept, listed = folder / "kept", folder / "sweep" / "features" / "__init__.py"
    text = before = listed.read_text()
    for name in names:
        text, found = re.subn(rf'    "{name}": .*\n', "", text)
        assert found == 1
        for root in ("sweep", "tests"):
            (kept / root).mkdir(parents=True, exist_ok=True)
            (folder / root / "features" / name).rename(kept / root / name)
    listed.write_text(text)
    yield
    listed.write_text(before)
    for name, root in product(names, ("sweep", "tests")):
        (kept / root / name).rename(folder / root / "features" / name)


def said(folder: Path, *words: str) -> tuple[int, str]:
    command, environment = [sys.executable, *words], os.environ | {"PYTHONPATH": str(folder)}
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    return done.returncode, done.stdout + done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("name", FEATURES)
def test_without_a_feature_the_rest_works(copy: Path, name: str) -> None:
    (copy / "small.yaml").write_text(STUDY.replace("COUNT", "3"))
    with without(copy, name):
        code, text = said(copy, "-m", "sweep", "run", "small.yaml", "--output", name, "--jobs", "1")
        assert code == 0, text
        assert [*copy.glob(f"{name}/*/report.html")]
        code, text = said(copy, "-m", "sweep", *COMMANDS[name])
    assert (code, "No such command" in text) == (2, True), text


@pytest.mark.slow
def test_without_features_the_tests_of_the_core_pass(copy: Path) -> None:
    with without(copy, *FEATURES):
        code, text = said(copy, "-m", "pytest", "-q", "-p", "no:cacheprovider", *CORE)
    assert code == 0, text[-3000:]
