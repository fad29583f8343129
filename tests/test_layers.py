"""Data flows one way: a file imports only from lower levels."""

from __future__ import annotations

import ast
import re
import tomllib
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from sweep.run.provenance import _PACKAGES

PACKAGE = Path(__file__).parent.parent / "sweep"

# From the bottom.
LEVELS = [
    "base",
    "curves",
    "designs",
    "camera",
    "vision",
    "metrics",
    "search",
    "study",
    "results",
    "run",
    "report",
    "door",
    "commands",
    "__main__",
]
"""The rooms from the lowest to the highest: folders of the package, and the file that starts it."""
ONLY_USER = {
    "nlopt": ["search/solver"],
    "joblib": ["run/"],
    "moocore": ["metrics/pareto"],
    "jinja2": ["report/"],
    "typer": ["commands/"],
    "jax": ["vision/network"],
    "optax": ["vision/network"],
    "numba": ["base/machine_code", "designs/vectorized"],
}
"""Who alone may import a library: files, or all of a folder."""


@cache
def parsed(text: str) -> ast.Module:
    """The tree of a file's text, made once for all that look at it."""
    return ast.parse(text)


@cache
def nodes(text: str) -> list[ast.AST]:
    """All nodes of a file's tree that the tests ask for: imports and functions, which stand among statements alone."""
    return [n for n in statements(parsed(text).body) if isinstance(n, ast.Import | ast.ImportFrom | ast.FunctionDef)]


def statements(body: list[ast.stmt]) -> Iterator[ast.stmt]:
    """All statements, and those within them."""
    for one in body:
        yield one
        for part in (one, *getattr(one, "handlers", ()), *getattr(one, "cases", ())):
            for inner in ("body", "orelse", "finalbody"):
                yield from statements(getattr(part, inner, []))


@pytest.fixture(scope="module", autouse=True)
def forgotten() -> Iterator[None]:
    """Half a million nodes are of no use to other tests."""
    yield
    parsed.cache_clear()
    nodes.cache_clear()


def level(unit: str) -> int | None:
    return LEVELS.index(unit) if unit in LEVELS else None


def unit_of(path: Path, root: Path) -> str:
    return path.relative_to(root).parts[0].removesuffix(".py")


def imported(path: Path, root: Path) -> list[tuple[int, str, tuple[str, ...]]]:
    """(line, library or '', parts of the module's name inside the package) of every import, wherever it stands.

    `from . import x` imports the module x of the folder, where there is one; else the folder itself.
    """
    package = path.relative_to(root).parts[:-1]
    found: list[tuple[int, str, tuple[str, ...]]] = []
    for node in nodes(path.read_text()):
        if isinstance(node, ast.Import):
            found += [(node.lineno, alias.name.split(".")[0], ()) for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            found.append((node.lineno, (node.module or "").split(".")[0], ()))
        elif isinstance(node, ast.ImportFrom):
            base = (*package[: len(package) - (node.level - 1)], *(node.module or "").split("."))
            folder = tuple(part for part in base if part)
            for alias in node.names:
                inner = root.joinpath(*folder, alias.name)
                module = inner.with_suffix(".py").is_file() or inner.is_dir()
                # Of the package itself nothing but modules is imported.
                found.append((node.lineno, "", (*folder, alias.name) if module or not folder else folder))
    return found


def breaches(root: Path) -> list[str]:
    found = []
    for path in sorted(root.rglob("*.py")):
        unit, where = unit_of(path, root), path.relative_to(root)
        own = -1 if unit == "__init__" else level(unit)  # the package itself imports none of its units
        if own is None:
            found.append(f"{where} is in no level")
            continue
        for line, library, target in imported(path, root):
            other = target[0] if target else ""
            under = level(other)
            if library == "sweep":
                found.append(f"{where}:{line} imports the package by its name")
            elif library in ONLY_USER and not where.as_posix().startswith(tuple(ONLY_USER[library])):
                found.append(f"{where}:{line} imports {library}, which only {ONLY_USER[library]} may")
            elif other and other != unit and under is None:
                found.append(f"{where}:{line} ({unit}) imports {other}, which is in no level")
            elif other and other != unit and under is not None and under >= own:
                found.append(f"{where}:{line} ({unit}) imports {other}, which is not below it")
    return found


def circles(root: Path) -> list[str]:
    """Files that import one another in a circle, or need some that do."""
    uses = {}
    for path in root.rglob("*.py"):
        needs = set()
        for _, library, target in imported(path, root):
            inner = root.joinpath(*target)
            if not library and target:
                needs.add(inner.with_suffix(".py") if inner.with_suffix(".py").is_file() else inner / "__init__.py")
        uses[path] = needs - {path}
    while free := {path for path, needs in uses.items() if not needs & set(uses)}:
        uses = {path: needs for path, needs in uses.items() if path not in free}
    return [f"{sorted(path.relative_to(root).as_posix() for path in uses)} import one another"] if uses else []


def plant(root: Path, files: dict[str, str]) -> None:
    for file, text in files.items():
        path = root / file
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
        if path.parent != root:
            (path.parent / "__init__.py").touch()


def test_every_file_is_in_a_room() -> None:
    units = {unit_of(path, PACKAGE) for path in PACKAGE.rglob("*.py")} - {"__init__"}
    assert sorted(units) == sorted(LEVELS)


def test_imports_point_downward() -> None:
    assert breaches(PACKAGE) == []


def test_no_test_module_imports_another() -> None:
    """What several of them need has a module of its own."""
    root, found = Path(__file__).parent, []
    for path in root.rglob("*.py"):
        for line in re.findall(
            r"^ *(?:from|import) (?:[^\n(]*\([^)]*\)|[^\n]*)", path.read_text("utf-8"), re.MULTILINE
        ):
            if re.search(r"\btest_", line):
                found.append(f"{path.relative_to(root)}: {line}")
    assert found == []


@pytest.mark.parametrize(
    ("file", "text"),
    [
        ("metrics/separation.py", "from ..study import load_study"),
        ("camera/pixel.py", "def late():\n    from ..commands.app import main"),
        ("curves/spectrum.py", "from .. import report"),
        ("curves/builtin/led.py", "from ...designs import family"),
        ("camera/effects/blur.py", "from ... import metrics"),
        ("study/load.py", "from ..run.runner import run_study"),
        ("study/load.py", "from .. import run"),
        ("study/load.py", "from .. import base, run"),
        ("study/load.py", "from . import model\nfrom .. import commands as verbs"),
        ("base/errors.py", "import sweep.commands.app"),
        ("base/errors.py", "from sweep import commands"),
        ("base/types.py", "from ..curves import spectrum"),
        ("metrics/evaluate.py", "import nlopt"),
        ("search/limit.py", "import nlopt"),
        ("stray.py", ""),
        ("stray/inner.py", "x = 1"),
        ("commands/app.py", "from .. import stray"),
        ("__init__.py", "from .commands.app import main"),
        ("__init__.py", "from . import base"),
        ("errors.py", ""),
    ],
)
def test_a_breach_is_found(tmp_path: Path, file: str, text: str) -> None:
    (tmp_path / file).parent.mkdir(parents=True, exist_ok=True)
    (tmp_path / file).write_text(text)
    assert len(breaches(tmp_path)) == 1


def test_imports_of_lower_units_are_no_breach(tmp_path: Path) -> None:
    text = "import numpy\nfrom ..base import errors\nfrom ..metrics import csd\nfrom . import model\nfrom .model import x\n"
    plant(
        tmp_path,
        {
            "study/load.py": text,
            "study/model.py": "",
            "metrics/csd.py": "from ..base import errors",
            "base/errors.py": "",
        },
    )
    assert breaches(tmp_path) == []
    assert circles(tmp_path) == []


def test_no_circle() -> None:
    assert circles(PACKAGE) == []


@pytest.mark.parametrize(
    "there", ["from .b import x", "from . import b", "from ... import camera", "from ...camera.effects import b"]
)
@pytest.mark.parametrize(
    "back", ["from .a import x", "from . import a", "from ..effects import a", "def f():\n    from . import a"]
)
def test_a_circle_is_found(tmp_path: Path, there: str, back: str) -> None:
    folder = "camera/effects"
    plant(tmp_path, {f"{folder}/a.py": there, f"{folder}/b.py": back, f"{folder}/c.py": "from . import a\n"})
    (tmp_path / folder / "__init__.py").write_text("from .b import x")
    (tmp_path / "camera" / "__init__.py").write_text("from .effects.b import x")
    assert len(circles(tmp_path)) == 1


def test_packages_whose_versions_a_run_keeps_are_installed_with_the_package() -> None:
    project = tomllib.loads((PACKAGE.parent / "pyproject.toml").read_text())["project"]
    required = {re.split(r"[<>=\[]", text)[0] for text in project["dependencies"]}
    assert {*_PACKAGES} <= required | {project["name"]}
