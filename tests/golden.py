"""What named designs and plain CFAs of the project's studies have: `python -m tests.golden` keeps it, and says what changed."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd

from sweep.results.tables import NAMED, REFERENCE
from sweep.runs.rows import Rows, rows_of, rules_of
from sweep.study import Study, load_study, sensor_studies_in

ROOT = Path(__file__).parent.parent
FILE = ROOT / "tests" / "data" / "golden.parquet"
LEFT_OUT = ("accuracy", "vision")
"""Studies without rows of their own, and with rows that are drawn."""
NAMES = sorted({path.stem for path in (ROOT / "studies").glob("*.yaml")} - {*LEFT_OUT})
DEAR = ("angle", "distance", "dye", "exposure", "flicker", "fog", "night", "pixel", "uncertain")
"""Those that take more than a second."""
_MOST_MEMBERS = 2
_KEYS = ("study", "scenario", "name", "column")
_TEXTS = ("kind", "space", "cfa", "family", "scenario", "simulation_key", "series", "key", "status", "name")
_NUMBERS = ("design_id", "filter_id", "pareto", "feasible")


def golden_rows(name: str) -> pd.DataFrame:
    """Every number of every named design and plain CFA of a study in its first scenario, a row each.

    Of a study of several sensors the first members.
    """
    path, parts = ROOT / "studies" / f"{name}.yaml", []
    several = sensor_studies_in(path, {})
    for member in (None,) if several is None else several.members[:_MOST_MEMBERS]:
        study = load_study(path, member=member)
        parts.append(numbers_of(study, [next(iter(study.scenarios))]))
    return pd.concat(parts, ignore_index=True).assign(file=name)


def numbers_of(study: Study, scenarios: Iterable[str] = ()) -> pd.DataFrame:
    """Every number of every named design and plain CFA of a study, a row each; in all scenarios where none is named."""
    planned, parts = study.with_plans(), []
    rules = rules_of(planned)
    for scenario, space in product(tuple(scenarios) or study.scenarios, study.spaces):
        if space.kind in (REFERENCE, NAMED):
            one = np.zeros(1, dtype=np.intp)
            rows = rows_of(Rows(space, scenario, one, one, one), planned.setup(space, scenario), rules, rules.wanted)
            numbers = rows.drop([n for n in (*_TEXTS, *_NUMBERS) if n in rows.column_names]).to_pandas().iloc[0]
            known = numbers.dropna().astype(float).rename_axis("column").rename("value").reset_index()
            parts.append(known.assign(study=study.name, scenario=scenario, name=f"{space.kind} {space.name}"))
    return pd.concat(parts, ignore_index=True)[[*_KEYS, "value"]]


def changes(kept: pd.DataFrame, found: pd.DataFrame, share: float = 1e-6) -> pd.DataFrame:
    """Numbers that differ by more than a share of the larger one (or of 1), or are in one table alone."""
    both = kept.merge(found, on=["file", *_KEYS], how="outer", suffixes=("_kept", "_found"))
    a, b = both["value_kept"], both["value_found"]
    same = (a - b).abs() <= share * np.maximum(1.0, np.maximum(a.abs(), b.abs()))
    return both[~(same | (a == b))]


if __name__ == "__main__":
    found = pd.concat(map(golden_rows, NAMES), ignore_index=True)
    if FILE.is_file():
        changed = changes(pd.read_parquet(FILE), found)
        summary = changed.groupby(["study", "column"])[["value_kept", "value_found"]].first()
        print(f"{len(changed)} of {len(found)} numbers changed; of each study and column the first:")
        print(summary.to_string() if len(summary) else "")
    found.to_parquet(FILE, index=False, compression="zstd")
