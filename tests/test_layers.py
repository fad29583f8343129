"""Data flows one way: a file imports only from lower levels."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parent.parent / "sweep"

# From the bottom. A unit is a module or a folder of the package.
LEVELS = [
    {"errors", "arrays", "completion"},
    {"schema"},
    {"kernels", "noise_kernels", "spectra", "mosaics", "pareto", "constraints", "objectives", "edges", "progress"},
    {"metrics", "confusion_kernels", "curve_files", "surrogate", "sensor", "chromaticity"},
    {"datasets", "filters", "filter_files", "scenes", "families", "discrimination", "signals"},
    {"spaces", "setup"},
    {"blocks"},
    {"effects"},
    {"promises", "noisy_readout"},
    {"plan", "imaging", "confusion"},
    {"evaluate", "recognition"},
    {"store", "problem", "figures"},
    {"series", "journal", "describing"},
    {"smooth", "limit"},
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
    "typer": "cli",
    "sklearn": "recognition",
    "numba": "kernels noise_kernels confusion_kernels",
}


def level(unit: str) -> int:
    return next(i for i, units in enumerate(LEVELS) if unit in units)


def unit_of(path: Path, root: Path) -> str:
    return path.relative_to(root).parts[0].removesuffix(".py")


def imported(path: Path, root: Path) -> list[tuple[int, str, str]]:
    """(line, top-level name, unit or '') of every import, wherever in the file it stands."""
    package = path.relative_to(root).parts[:-1]
    found = []
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            found += [(node.lineno, alias.name.split(".")[0], "") for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            found.append((node.lineno, (node.module or "").split(".")[0], ""))
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - (node.level - 1)]
            target = (*base, *(node.module.split(".") if node.module else ()))
            names = [target[0]] if target else [alias.name for alias in node.names]
            found += [(node.lineno, "", name) for name in names]
    return found


def breaches(root: Path) -> list[str]:
    found = []
    for path in sorted(root.rglob("*.py")):
        unit = unit_of(path, root)
        if unit == "__init__":
            continue
        where = path.relative_to(root)
        for line, library, other in imported(path, root):
            if library == "sweep":
                found.append(f"{where}:{line} imports the package by its name")
            elif library in ONLY_USER and unit not in ONLY_USER[library].split():
                found.append(f"{where}:{line} imports {library}, which only {ONLY_USER[library]} may")
            elif other and other != unit and level(other) >= level(unit):
                found.append(f"{where}:{line} ({unit}) imports {other}, which is not below it")
    return found


def test_every_unit_has_a_level() -> None:
    units = {unit_of(path, PACKAGE) for path in PACKAGE.rglob("*.py")} - {"__init__"}
    assert units == set().union(*LEVELS)


def test_imports_point_downward() -> None:
    assert breaches(PACKAGE) == []


@pytest.mark.parametrize(
    ("file", "text"),
    [
        ("metrics.py", "from .study import load_study"),
        ("sensor.py", "def late():\n    from .cli import main"),
        ("spectra.py", "from . import report"),
        ("study/load.py", "from ..runner.run import run_study"),
        ("errors.py", "import sweep.cli"),
        ("evaluate.py", "import nlopt"),
    ],
)
def test_a_breach_is_found(tmp_path: Path, file: str, text: str) -> None:
    path = tmp_path / file
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    assert len(breaches(tmp_path)) == 1


def test_no_cycle_inside_a_folder() -> None:
    for folder in (path for path in PACKAGE.iterdir() if path.is_dir() and (path / "__init__.py").exists()):
        uses = {}
        for path in folder.glob("*.py"):
            tree = ast.walk(ast.parse(path.read_text()))
            siblings = [n.module for n in tree if isinstance(n, ast.ImportFrom) and n.level == 1 and n.module]
            uses[path.stem] = {name.split(".")[0] for name in siblings}
        while uses:
            free = {name for name, needs in uses.items() if not needs & set(uses)}
            assert free, f"{folder.name}: {sorted(uses)} import one another"
            uses = {name: needs for name, needs in uses.items() if name not in free}
