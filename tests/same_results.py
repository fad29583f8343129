"""Compare the results of the project's studies before and after a change of the code.

    python tests/same_results.py save FOLDER            # runs every study and its plan into FOLDER
    python tests/same_results.py compare BEFORE AFTER   # two such folders, cell by cell; exit code 1 where they differ

Plans are compared word by word. Numbers count as equal within 1e-12 of the largest finite one of their column.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd

STUDIES = Path(__file__).parent.parent / "studies"
TABLES = ("results", "search", "front", "recognition", "curves", "points")


def sweep(*arguments: str) -> str:
    """The output of a command."""
    done = subprocess.run([sys.executable, "-m", "sweep", *arguments], capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(f"{' '.join(arguments)}: {done.stderr}")
    return done.stdout


def save(folder: Path) -> None:
    for study in sorted(STUDIES.glob("*.yaml")):
        sweep("run", str(study), "--output", str(folder / "runs"))
        (folder / f"{study.stem}.plan.txt").write_text(sweep("plan", str(study), "--explain"))
        print(f"{study.stem}: saved")


def different_columns(before: pd.DataFrame, after: pd.DataFrame) -> list[str]:
    """Columns that differ; all of them where others, or another number of rows, are there."""
    if {*before} != {*after} or len(before) != len(after):
        return [*before]
    names = []
    for name, values in before.items():
        if values.dtype.kind != "f":
            same = values.astype(str).equals(after[name].astype(str))
        else:
            largest = np.abs(values[np.isfinite(values)]).max() if np.isfinite(values).any() else 0.0
            same = np.allclose(values, after[name], rtol=0, atol=1e-12 * largest, equal_nan=True)
        names += [] if same else [str(name)]
    return names


def compare(before: Path, after: Path) -> bool:
    """Print tables and plans with their differences; return whether there are any."""
    patterns = ("*.plan.txt", *(f"runs/*/{name}.parquet" for name in TABLES))
    files = {path.relative_to(folder) for folder in (before, after) for kind in patterns for path in folder.glob(kind)}
    differences: dict[str, object] = {} if files else {"results": "there are none"}
    for file in files:
        one, other = before / file, after / file
        if not (one.exists() and other.exists()):
            differences[str(file)] = "only in one of the folders"
        elif file.suffix == ".txt":
            differences[str(file)] = "other words" if one.read_text() != other.read_text() else ""
        else:
            differences[str(file)] = different_columns(pd.read_parquet(one), pd.read_parquet(other))
    for name, found in sorted(differences.items()):
        print(f"{name}: {found or 'equal'}")
    return any(differences.values())


if __name__ == "__main__":
    verb, *folders = sys.argv[1:]
    sys.exit(compare(*map(Path, folders)) if verb == "compare" else save(*map(Path, folders)))
