"""Data flows one way: a file imports only from lower levels."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parent.parent / "sweep"

# From the bottom. A unit is a module or a folder of the package.
LEVELS = [
    {"errors", "arrays", "cache", "completion", "records", "disk"},
    {"schema", "inputs", "endings", "options"},
    {
        "kernels",
        "spectra",
        "mosaics",
        "pareto",
        "constraints",
        "objectives",
        "edges",
        "progress",
        "mat_files",
        "noise_kernels",
        "bound_kernels",
    },
    {"metrics", "confusion_kernels", "curve_files", "surrogate", "sensor", "chromaticity"},
    {"datasets", "filters", "filter_files", "scenes", "families", "discrimination", "signals"},
    {"spaces", "setup"},
    {"blocks"},
    {"effects"},
    {"promises", "places", "noisy_readout", "electrons"},
    {"readout"},
    {"plan", "imaging", "confusion"},
    {"evaluate", "recognition"},
    {"store", "problem", "figures"},
    {"series", "journal", "describing", "run_files"},
    {"inventory", "lock"},
    {"smooth", "filter_program"},
    {"sides"},
    {"limit"},
    {"search"},
    {"study"},
    {"runner"},
    {"report", "calibration"},
    {"audit", "knobs", "exporting", "comparing", "newstudy", "listing"},
    {"accuracy"},
    {"cli"},
    {"__main__"},
]
ONLY_USER = {
    "nlopt": "search",
    "joblib": "runner calibration",
    "moocore": "pareto",
    "plotly": "report",
    "jinja2": "report",
    "typer": "cli endings options",
    "sklearn": "recognition",
    "numba": "kernels noise_kernels confusion_kernels bound_kernels",
}


def level(unit: str) -> int | None:
    return next((i for i, units in enumerate(LEVELS) if unit in units), None)


def unit_of(path: Path, root: Path) -> str:
    return path.relative_to(root).parts[0].removesuffix(".py")


def imported(path: Path, root: Path) -> list[tuple[int, str, tuple[str, ...]]]:
    """(line, library or '', parts of the module's name inside the package) of every import, wherever it stands.

    `from . import x` imports the module x of the folder, where there is one; else the folder itself.
    """
    package = path.relative_to(root).parts[:-1]
    found: list[tuple[int, str, tuple[str, ...]]] = []
    for node in ast.walk(ast.parse(path.read_text())):
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
            elif library in ONLY_USER and unit not in ONLY_USER[library].split():
                found.append(f"{where}:{line} imports {library}, which only {ONLY_USER[library]} may")
            elif other and other != unit and under is None:
                found.append(f"{where}:{line} ({unit}) imports {other}, which is in no level")
            elif other and other != unit and under is not None and under >= own:
                found.append(f"{where}:{line} ({unit}) imports {other}, which is not below it")
    return found


def circles(root: Path) -> list[str]:
    """Folders whose files import one another in a circle."""
    found = []
    for folder in sorted(path for path in root.iterdir() if (path / "__init__.py").exists()):
        uses = {}
        for path in folder.glob("*.py"):
            targets = [target for *_, target in imported(path, root) if target[:1] == (folder.name,)]
            uses[path.stem] = {(*target, "__init__")[1] for target in targets}
        while uses:
            free = {name for name, needs in uses.items() if not needs & set(uses)}
            if not free:
                found.append(f"{folder.name}: {sorted(uses)} import one another")
                break
            uses = {name: needs for name, needs in uses.items() if name not in free}
    return found


def plant(root: Path, files: dict[str, str]) -> None:
    for file, text in files.items():
        path = root / file
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
        if path.parent != root:
            (path.parent / "__init__.py").touch()


def test_every_unit_has_a_level() -> None:
    units = {unit_of(path, PACKAGE) for path in PACKAGE.rglob("*.py")} - {"__init__"}
    assert units == set().union(*LEVELS)
    assert sum(map(len, LEVELS)) == len(units)


def test_imports_point_downward() -> None:
    assert breaches(PACKAGE) == []


@pytest.mark.parametrize(
    ("file", "text"),
    [
        ("metrics.py", "from .study import load_study"),
        ("sensor.py", "def late():\n    from .cli import main"),
        ("spectra.py", "from . import report"),
        ("metrics.py", "from . import sensor"),
        ("study/load.py", "from ..runner.run import run_study"),
        ("study/load.py", "from .. import runner"),
        ("study/load.py", "from .. import errors, runner"),
        ("study/load.py", "from . import model\nfrom .. import cli as command"),
        ("errors.py", "import sweep.cli"),
        ("errors.py", "from sweep import cli"),
        ("evaluate.py", "import nlopt"),
        ("stray.py", ""),
        ("stray/inner.py", "x = 1"),
        ("cli.py", "from . import stray"),
        ("__init__.py", "from .cli import main"),
        ("__init__.py", "from . import errors"),
    ],
)
def test_a_breach_is_found(tmp_path: Path, file: str, text: str) -> None:
    (tmp_path / file).parent.mkdir(parents=True, exist_ok=True)
    (tmp_path / file).write_text(text)
    assert len(breaches(tmp_path)) == 1


def test_imports_of_lower_units_are_no_breach(tmp_path: Path) -> None:
    text = "import numpy\nfrom .. import errors\nfrom ..metrics import csd\nfrom . import model\nfrom .model import x\n"
    plant(
        tmp_path, {"study/load.py": text, "study/model.py": "", "metrics.py": "from . import errors", "errors.py": ""}
    )
    assert breaches(tmp_path) == []
    assert circles(tmp_path) == []


def test_no_circle_inside_a_folder() -> None:
    assert circles(PACKAGE) == []


@pytest.mark.parametrize(
    "there", ["from .b import x", "from . import b", "from .. import effects", "from ..effects import b"]
)
@pytest.mark.parametrize(
    "back", ["from .a import x", "from . import a", "from ..effects import a", "def f():\n    from . import a"]
)
def test_a_circle_is_found(tmp_path: Path, there: str, back: str) -> None:
    plant(tmp_path, {"effects/a.py": there, "effects/b.py": back, "effects/c.py": "from . import a\nfrom .b import y"})
    (tmp_path / "effects" / "__init__.py").write_text("from .b import x")
    assert len(circles(tmp_path)) == 1
