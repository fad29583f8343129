"""Whether a change of the code changed any result of the project's studies.

    python tests/same_results.py save FOLDER            # runs every study and its plan into FOLDER, audits distance
    python tests/same_results.py compare BEFORE AFTER   # two such folders, cell by cell; exit code 1 where they differ

Plans with their promises and the audit are compared word by word. Numbers count as equal within 1e-12 of the largest
finite one of their column; the summary says where they are equal bit for bit.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq

STUDIES = Path(__file__).parent.parent / "studies"
RELATIVE = 1e-12
TABLES = ("results", "search", "front", "recognition", "curves", "points")


def sweep(*arguments: str, said: Path) -> None:
    """Run the command; what it says goes to a file."""
    done = subprocess.run([sys.executable, "-m", "sweep", *arguments], capture_output=True, text=True, check=False)
    said.write_text(done.stdout)
    if done.returncode:
        sys.exit(f"{' '.join(arguments)}: {done.stderr}")


def save(folder: Path) -> None:
    """Results, search logs, fronts, plans with their promises, and an audit."""
    folder.mkdir(parents=True)
    for study in sorted(STUDIES.glob("*.yaml")):
        sweep("plan", str(study), "--explain", said=folder / f"{study.stem}.plan.txt")
        sweep("run", str(study), "--output", str(folder / "runs"), said=folder / f"{study.stem}.said.txt")
        print(f"{study.stem}: saved")
    sweep("audit", str(folder / "runs" / "distance"), said=folder / "distance.audit.txt")


def differences(before: Path, after: Path) -> tuple[str, bool]:
    """What differs between two tables, in words, and whether that is too much."""
    old, new = (pq.read_table(path) for path in (before, after))
    if {*old.column_names} != {*new.column_names} or len(old) != len(new):
        return f"columns or rows differ: {len(old)} and {len(new)} rows", True
    new = new.select(old.column_names)
    if old.equals(new):
        return "equal bit for bit", False
    worst, where = 0.0, ""
    for name in old.column_names:
        a, b = old[name].to_pandas(), new[name].to_pandas()
        if a.dtype.kind != "f":
            if a.astype(object).where(a.notna(), None).tolist() != b.astype(object).where(b.notna(), None).tolist():
                return f"{name} differs", True
            continue
        one, other = a.to_numpy(), b.to_numpy()
        if not np.array_equal(np.isnan(one), np.isnan(other)):
            return f"{name}: other cells are empty", True
        infinite = np.isinf(one) | np.isinf(other)
        if not np.array_equal(one[infinite], other[infinite]):
            return f"{name}: other cells are infinite", True
        one, other = one[~infinite], other[~infinite]
        size = np.nanmax(np.abs(one), initial=0.0)
        off = float(np.nanmax(np.abs(one - other), initial=0.0)) / size if size else float(np.nansum(np.abs(other)))
        if off > worst:
            worst, where = off, name
    return f"largest difference {worst:.1e} of the largest value ({where})", worst > RELATIVE


def compare(before: Path, after: Path) -> bool:
    """Print what differs; whether anything does by too much."""
    broken = False
    for said in sorted(before.glob("*.plan.txt")) + sorted(before.glob("*.audit.txt")):
        same = said.read_text() == (after / said.name).read_text()
        print(f"{said.stem}: {'the same words' if same else 'OTHER WORDS'}")
        broken |= not same
    for run in sorted((before / "runs").iterdir()):
        for name in TABLES:
            table = run / f"{name}.parquet"
            if not table.exists() and not (after / "runs" / run.name / table.name).exists():
                continue
            said, wrong = differences(table, after / "runs" / run.name / table.name)
            print(f"{run.name}/{name}: {said}{'  DIFFERS' if wrong else ''}")
            broken |= wrong
    return broken


def main() -> None:
    """See the head of this file."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    verbs = parser.add_subparsers(dest="verb", required=True)
    saving = verbs.add_parser("save")
    saving.add_argument("folder", type=Path)
    comparing = verbs.add_parser("compare")
    comparing.add_argument("before", type=Path)
    comparing.add_argument("after", type=Path)
    given = parser.parse_args()
    if given.verb == "save":
        save(given.folder)
    elif compare(given.before, given.after):
        sys.exit(1)


if __name__ == "__main__":
    main()
