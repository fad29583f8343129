"""Check of a run's rows against the reference settings: all effects, and the finest accuracy."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from ..base.types import delayed
from ..camera.accuracy import REFERENCE
from ..camera.model import SceneModel
from ..camera.setup import Setup
from ..designs.space import Space
from ..metrics.columns.chromatic import CHROMATIC_CSD, ChromaticSeparation
from ..metrics.evaluate import evaluate
from ..metrics.quantity import WORST_CASE
from ..results.dataset import part_paths
from ..results.designs import row_space
from ..results.facts import CheckFacts
from ..results.tables import word_mask
from ..study import Study
from .routes import text_of, worst_cases
from .workers import Workers

_AT_ONCE = 64
"""Designs that are computed again in one block."""
_MOST_ROWS, _ENOUGH_ROWS = 200, 5000
"""Rows of a check at the end of a run, at most; parts are read until they have so many to choose from."""

Row = Mapping[str, Any]


def compared_rows(study: Study, rows: Sequence[Row]) -> Iterator[list[dict[str, Any]]]:
    """Compare rows of the result table with the reference, one block of designs of a space and scene at a time.

    Returns `design_id`, `filter_id`, `scenario`, `plan`, `allowed_dn`, `realized_dn` (largest difference of any CSD,
    infinite if only one is a number), and its `quantity`.
    """
    groups: dict[tuple[int, str], tuple[Space, list[Row]]] = {}
    for row in rows:
        space = row_space(study, row)
        groups.setdefault((id(space), row["scenario"]), (space, []))[1].append(row)
    for (_, scenario), (space, group) in groups.items():
        for start in range(0, len(group), _AT_ONCE):
            yield _compared(study, space, scenario, group[start : start + _AT_ONCE])


def _compared(study: Study, space: Space, scenario: str, rows: Sequence[Row]) -> list[dict[str, Any]]:
    points = np.array([[row[name] for name in space.parameters] for row in rows], dtype=float)
    setup = study.setup(space, scenario)
    model = SceneModel(replace(setup.with_all_effects, accuracy=REFERENCE))
    # Chromatic distances are the worst of the lattice alone, which differs between settings.
    of_lattice = setup.all_phases or setup.all_heights or setup.scene.drive is not None
    compared = [of for of in study.quantities.values() if of.metric == CHROMATIC_CSD and not of_lattice]
    compared += [quantity for quantity in study.quantities.values() if quantity.has_error_bound]
    csds = [quantity for quantity in compared if quantity.name in rows[0]]
    chromatic = [of.pair for of in csds if of.metric == CHROMATIC_CSD and of.pair is not None]
    nominal = evaluate(
        model, space.curves(points, study.grid.size), metrics=[ChromaticSeparation()], chromatic=chromatic
    )
    worst = [quantity for quantity in csds if quantity.extreme == WORST_CASE]
    exact = {quantity.name: nominal[quantity.name] for quantity in csds if quantity not in worst}
    if worst:
        exact |= worst_cases(space, model, points, nominal, worst, study.tolerance)
    differences = []
    for name, values in exact.items():
        stored = np.array([row[name] for row in rows], dtype=float)
        # A column that the scene does not have is missing in both; one that is missing in one of them is an issue.
        both_missing = np.isnan(stored) & np.isnan(values)
        differences.append(np.nan_to_num(np.where(both_missing, 0.0, np.abs(values - stored)), nan=np.inf))
    realized, names = np.stack(differences), list(exact)
    allowed = _allowed_dn(setup, study.plans[scenario].tolerance_dn if study.plans else study.section.tolerance_dn)
    return [
        {key: row[key] for key in ("design_id", "filter_id", "scenario", "plan")}
        | {"allowed_dn": allowed, "realized_dn": float(realized[at, index]), "quantity": names[at]}
        for index, (row, at) in enumerate(zip(rows, realized.argmax(axis=0), strict=True))
    ]


def _allowed_dn(setup: Setup, tolerance_dn: float) -> float:
    """Return the difference of a CSD from the reference that is no issue, DN.

    That is the tolerance. A readout in whole numbers without noise steps by up to sqrt(channels) DN between
    neighboring samples: with images of a light, moments of a pulse or all field positions, that is added.
    """
    scene, steps = setup.scene, setup.scene.noise is None and setup.computes("quantization")
    sampled = scene.target is not None or scene.drive is not None or setup.all_heights
    return tolerance_dn + (math.sqrt(len(setup.camera.mosaic.channels)) if steps and sampled else 0.0)


def check_run(study: Study, folder: Path, seconds: float, pool: Workers) -> tuple[CheckFacts | None, list[str]]:
    """Compare a seeded sample of a run's rows with the reference within a time, at least one row.

    `seconds`: time, s; each worker takes a part of it. Returns `check`: None if no row could be compared.
    """
    sample = _sampled(study, folder)
    parts = [sample[at :: pool.count] for at in range(pool.count)]
    rows: list[dict[str, Any]] = []
    warnings: list[str] = []
    calls = (delayed(_checked, study, part, seconds / pool.count) for part in parts if part)
    for compared, issues in pool(calls, killed=lambda _: ([], ["a worker was killed in the check of the run"])):
        rows += compared
        warnings += issues
    if not rows:
        return None, warnings
    shown = max(rows, key=lambda row: (row["realized_dn"] > row["allowed_dn"], row["realized_dn"]))
    keys = {key: shown[key] for key in ("design_id", "scenario", "quantity", "allowed_dn")}
    return CheckFacts(rows=len(rows), largest_dn=shown["realized_dn"], **keys), warnings


def _checked(study: Study, rows: Sequence[Row], seconds: float) -> tuple[list[dict[str, Any]], list[str]]:
    """Compare some rows until the time is over; return results and warnings."""
    ended = time.monotonic() + seconds
    result: list[dict[str, Any]] = []
    warnings: list[str] = []
    for row in rows:
        try:
            for compared in compared_rows(study, [row]):
                result += compared
        except Exception as error:  # a finished run must not be lost to its check
            warnings.append(f"design {row['design_id']} cannot be computed at the reference settings: {text_of(error)}")
        if time.monotonic() > ended:
            break
    return result, warnings


def _sampled(study: Study, folder: Path) -> list[Row]:
    """Return rows in a random order by the study's seed, without those that failed."""
    rng = np.random.default_rng([study.section.seed, 5])
    paths, tables = part_paths(folder), list[pa.Table]()
    for at in rng.permutation(len(paths)):
        tables.append(pq.read_table(paths[at]))
        if sum(table.num_rows for table in tables) >= _ENOUGH_ROWS:
            break
    part = pa.concat_tables(tables).unify_dictionaries()
    part = part.filter(word_mask(part, "status", "ok"))
    chosen = rng.choice(part.num_rows, size=min(part.num_rows, _MOST_ROWS), replace=False)
    rows = part.take(chosen).to_pylist()
    return [{name: math.nan if value is None else value for name, value in row.items()} for row in rows]
