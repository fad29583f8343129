"""Data flows one way: a file imports only from lower levels."""

from __future__ import annotations

import ast
import re
import tomllib
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

from sweep.features import FEATURES
from sweep.runs.provenance import _PACKAGES

from .conftest import DEAR, ROOT

PACKAGE = Path(__file__).parent.parent / "sweep"
LEVELS = [
    "base",
    "spectra",
    "designs",
    "camera",
    "metrics",
    "search",
    "study",
    "results",
    "runs",
    "report",
    "api",
    "cli",
    "features",
    "__main__",
]
"""Subpackages from the lowest to the highest, and the file that starts the program."""
ONLY_USER = {
    "nlopt": ["search/solver"],
    "joblib": ["runs/"],
    "moocore": ["metrics/pareto"],
    "jinja2": ["report/"],
    "typer": ["cli/", "features/"],
    "pycocotools": ["features/vision/"],
    "numba": ["base/machine_code", "base/lane_kernels"],
}
"""The files, or all of a folder, that alone may import a library."""


def unit_of(path: Path, root: Path) -> str:
    return path.relative_to(root).parts[0].removesuffix(".py")


@cache
def imported(path: Path, root: Path) -> list[tuple[int, str, tuple[str, ...]]]:
    """(line, library or '', parts of the module's name inside the package) of every import, wherever it stands.

    `from . import x` imports the module x of the folder, where there is one; else the folder itself.
    """
    package = path.relative_to(root).parts[:-1]
    imports: list[tuple[int, str, tuple[str, ...]]] = []
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            imports += [(node.lineno, alias.name.split(".")[0], ()) for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            imports.append((node.lineno, (node.module or "").split(".")[0], ()))
        elif isinstance(node, ast.ImportFrom):
            base = (*package[: len(package) - (node.level - 1)], *(node.module or "").split("."))
            folder = tuple(part for part in base if part)
            for alias in node.names:
                inner = root.joinpath(*folder, alias.name)
                module = inner.with_suffix(".py").is_file() or inner.is_dir()
                # Of the package itself nothing but modules is imported.
                imports.append((node.lineno, "", (*folder, alias.name) if module or not folder else folder))
    return imports


def needs_of(root: Path, feature: str) -> tuple[str, ...]:
    """The features that a feature says it needs."""
    said = root / "features" / feature / "__init__.py"
    named = re.search(r"^NEEDS = (.*)$", said.read_text() if said.is_file() else "", re.MULTILINE)
    return () if named is None else ast.literal_eval(named[1])


def breaches(root: Path) -> list[str]:
    lines = []
    for path in sorted(root.rglob("*.py")):
        unit, where = unit_of(path, root), path.relative_to(root)
        if unit not in (*LEVELS, "__init__"):
            lines.append(f"{where} is in no level")
            continue
        lower = [] if unit == "__init__" else LEVELS[: LEVELS.index(unit)]  # the package itself imports no subpackage
        for line, library, target in imported(path, root):
            if library == "sweep":
                lines.append(f"{where}:{line} imports the package by its name")
            elif library in ONLY_USER and not where.as_posix().startswith(tuple(ONLY_USER[library])):
                lines.append(f"{where}:{line} imports {library}, which only {ONLY_USER[library]} may")
            elif target == ("features",):
                continue  # the list of features, which every level may ask
            elif target[:1] == ("features",) == (unit,) and target[1] not in (
                where.parts[1],
                *needs_of(root, where.parts[1]),
            ):
                lines.append(f"{where}:{line} imports the feature {target[1]}")
            elif target and target[0] not in (unit, *lower):
                lines.append(f"{where}:{line} ({unit}) imports {target[0]}, which is not below it")
    return lines


def circle(root: Path) -> list[Path]:
    """Files that import one another in a circle, one circle if there are several."""
    uses = {}
    for path in root.rglob("*.py"):
        inner = [root.joinpath(*target) for _, library, target in imported(path, root) if target and not library]
        files = {
            file.with_suffix(".py") if file.with_suffix(".py").is_file() else file / "__init__.py" for file in inner
        }
        uses[path] = files - {path}
    try:
        TopologicalSorter(uses).prepare()
    except CycleError as error:
        return error.args[1]
    return []


def test_every_file_is_in_a_level_and_imports_point_downward() -> None:
    units = {unit_of(path, PACKAGE) for path in PACKAGE.rglob("*.py")} - {"__init__"}
    assert sorted(units) == sorted(LEVELS)
    assert breaches(PACKAGE) == []
    assert circle(PACKAGE) == []


@pytest.mark.parametrize(
    ("file", "text"),
    [
        ("camera/pixel.py", "def late():\n    from ..cli.app import main"),
        ("study/load.py", "from . import model\nfrom .. import cli as verbs"),
        ("base/errors.py", "import sweep.cli.app"),
        ("search/limit.py", "import nlopt"),
        ("stray/inner.py", "x = 1"),
        ("__init__.py", "from .cli.app import main"),
        ("cli/app.py", "from ..features.compare import compare"),
        ("features/compare/compare.py", "from ..describe import describe"),
    ],
)
def test_a_breach_is_found(tmp_path: Path, file: str, text: str) -> None:
    (tmp_path / file).parent.mkdir(parents=True, exist_ok=True)
    (tmp_path / file).write_text(text)
    assert len(breaches(tmp_path)) == 1


def test_packages_whose_versions_a_run_keeps_are_installed_with_the_package() -> None:
    project = tomllib.loads((PACKAGE.parent / "pyproject.toml").read_text())["project"]
    required = {re.split(r"[<>=\[]", text)[0] for text in project["dependencies"]}
    assert {*_PACKAGES} <= required | {project["name"]}


def test_a_wheel_has_every_file_of_the_package() -> None:
    """What is no code and no text for readers is named in pyproject.toml."""
    root = Path(__file__).parents[1]
    named = tomllib.loads((root / "pyproject.toml").read_text())["tool"]["setuptools"]["package-data"]["sweep"]
    shipped = {path for pattern in named for path in (root / "sweep").glob(pattern)}
    files = [path for path in (root / "sweep").rglob("*") if path.is_file() and "__pycache__" not in path.parts]
    assert not [path for path in files if path not in shipped and path.suffix not in (".py", ".md")]


def test_every_dear_test_exists() -> None:
    for line in sorted(DEAR):
        file, _, name = line.partition("::")
        if file.startswith("tests/features/") and file.split("/")[2] not in FEATURES:
            continue
        function = name.partition("[")[0].rpartition("::")[2]
        assert f"def {function}(" in (ROOT / file).read_text(encoding="utf-8"), line
