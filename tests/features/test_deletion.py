"""Without a feature's folder and its name the package loads, a study runs to its page, its keys and command are unknown."""

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

from sweep.features import FEATURES, parts

from ..build import STUDY
from ..conftest import ROOT

STATED = {
    "StudySection": "{key}: {{}}\n",
    "SearchSection": "search: {{{key}: {{}}}}\n",
    "CfaSection": "cfas: {{RGGB: {{{key}: {{}}}}, RYYCy: {{}}, RYNCy: {{}}}}\n",
}
"""A key of a feature as a study states it."""
CORE = ["base", "designs", "metrics", "results/test_records.py", "test_layers.py", "api/test_names.py"]
"""Quick tests of the core that are run without any feature."""


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the package and its tests, whose studies state no key of a feature."""
    folder = tmp_path_factory.mktemp("copy")
    for part in ("sweep", "tests", "studies"):
        shutil.copytree(ROOT / part, folder / part, ignore=shutil.ignore_patterns("__pycache__"))
    for file in ("pyproject.toml", "README.md", "CHANGELOG.md", "Makefile"):
        shutil.copy(ROOT / file, folder)
    (folder / "outputs").mkdir()
    shutil.copy(ROOT / "outputs" / "README.md", folder / "outputs")
    keys = "|".join(key for name in FEATURES for at, key in keys_of(name) if at == "StudySection")
    for study in folder.glob("studies/*.yaml"):
        text = re.sub(r"only: \[.*?\]", "", study.read_text())
        study.write_text(re.sub(rf"^({keys}):.*\n(?: .*\n)*", "", text, flags=re.MULTILINE))
    return folder


def keys_of(name: str) -> list[tuple[str, str]]:
    """The keys that a feature adds, with the sections that have them."""
    added = getattr(parts("section").get(name), "KEYS", {})
    return [(at, field.alias or key) for at, keys in added.items() for key, field in keys.model_fields.items()]


def with_dependents(name: str) -> list[str]:
    """A feature, and those that need it."""
    return [name, *(other for other, module in parts().items() if name in getattr(module, "NEEDS", ()))]


@contextmanager
def without(folder: Path, *names: str) -> Iterator[None]:
    """The copy without some features, in their folders and in the list."""
    kept, listed = folder / "kept", folder / "sweep" / "features" / "__init__.py"
    text = before = listed.read_text()
    for name in names:
        text, found = re.subn(rf'    "{name}",\n', "", text)
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
    commands = (
        [command.replace("_", "-") for command in vars(parts("commands").get(name)) or ()]
        if name in parts("commands")
        else []
    )
    (copy / "small.yaml").write_text(STUDY.replace("COUNT", "3"))
    with without(copy, *with_dependents(name)):
        code, text = said(copy, "-m", "sweep", "run", "small.yaml", "--output", name, "--jobs", "1")
        assert code == 0, text
        assert [*copy.glob(f"{name}/*/report.html")]
        for at, key in keys_of(name):
            line, text = STATED[at].format(key=key), STUDY.replace("COUNT", "3").partition("search:")[0]
            before = re.sub(rf"^{line.partition(':')[0]}:.*\n", "", text, flags=re.MULTILINE)
            (copy / "key.yaml").write_text(before + line)
            code, text = said(copy, "-m", "sweep", "check", "key.yaml")
            assert (code, f"{key}: unknown key" in text) == (2, True), text
        if name in commands:
            code, text = said(copy, "-m", "sweep", name)
            assert (code, "No such command" in text) == (2, True), text


@pytest.mark.slow
def test_without_features_the_tests_of_the_core_pass(copy: Path) -> None:
    with without(copy, *FEATURES):
        code, text = said(copy, "-m", "pytest", "-q", "-p", "no:cacheprovider", *(f"tests/{part}" for part in CORE))
        assert code == 0, text[-3000:]
        code, text = said(copy, "-m", "sweep", "run", "stopband", "--output", "core", "--jobs", "1")
    assert code == 0, text
    assert (copy / "core" / "stopband" / "report.html").is_file()
