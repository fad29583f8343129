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
from ..camera.setup import Setup
from ..designs.block import CurveBlock
from ..designs.space import Space
from ..metrics.columns.chromatic import CHROMATIC_CSD
from ..metrics.columns.color_separation import CSD
from ..metrics.metric import Metric
from ..metrics.objective import COMBINED
from ..metrics.places import oriented
from ..metrics.quantity import DN, Quantity
from ..metrics.registry import METRICS
from ..results.dataset import part_paths
from ..results.designs import row_space
from ..results.facts import CheckFacts
from ..results.tables import word_mask
from ..spectra.lights import class_pairs, pair_name
from ..study import Study
from .routes import Rules, Wanted, columns_of_points, text_of
from .rows import rules_of
from .workers import Workers

_AT_ONCE = 64
"""Designs that are computed again in one block."""
_MOST_ROWS, _ENOUGH_ROWS = 200, 5000
"""Rows of a check at the end of a run, at most; parts are read until they have so many to choose from."""

_SHARE, _SAME = 1e-2, 1e-6
"""Difference of a column that is allowed, relative: of one that is not in DN, and of one that no light determines."""
_CHROMATIC_SHARE = 1e-3
"""The same of distances of lamps of any brightness, beside the tolerance."""

Row = Mapping[str, Any]


def compared_rows(study: Study, rows: Sequence[Row]) -> Iterator[list[dict[str, Any]]]:
    """Compare rows of the result table with the reference, one block of designs of a space and scene at a time.

    Returns `design_id`, `filter_id`, `scenario`, `plan`; `quantity`, `realized_dn`, `allowed_dn`: of columns in DN, the
    one whose difference is the largest part of what is allowed, infinite if only one is a number; `other`,
    `realized_share`, `allowed_share`: the same of other columns, relative, of errors of the d' that stands for them;
    `own_s`, `reference_s`: time of the block as the study computes it, and at the reference.
    """
    groups: dict[tuple[int, str], tuple[Space, list[Row]]] = {}
    for row in rows:
        space = row_space(study, row)
        groups.setdefault((id(space), row["scenario"]), (space, []))[1].append(row)
    rules = rules_of(study)
    for (_, scenario), (space, group) in groups.items():
        for start in range(0, len(group), _AT_ONCE):
            yield _compared(study, rules, space, scenario, group[start : start + _AT_ONCE])


def _compared(study: Study, rules: Rules, space: Space, scenario: str, rows: Sequence[Row]) -> list[dict[str, Any]]:
    points = np.array([[row[name] for name in space.parameters] for row in rows], dtype=float)
    setup = study.setup(space, scenario)
    reference = replace(setup.with_all_effects, accuracy=REFERENCE)
    owner = {name: metric for metric in METRICS for name in (q.name for q in metric.quantities(rules.requested))}
    slow = {name for name, feature in study.features.items() if feature.slow}
    named = {name: of for name, of in rules.at(scenario, rules.wanted).quantities.items() if name in rows[0]}
    images = {name for name, of in named.items() if (own := owner.get(of.of or name)) is not None and own.needs in slow}
    if images & set(study.objective.weights):
        images.add(COMBINED)
    computed = {name: of for name, of in named.items() if name not in images}
    compared = {name: of for name, of in computed.items() if of.needs != "own"}
    wanted = Wanted.of(computed, rules.requested, rules.schema)
    block = CurveBlock(space.curves(points, study.grid.size))
    times = [time.perf_counter()]
    for each in (setup, reference):
        exact = columns_of_points(space, points, block, each, rules, wanted)
        times.append(time.perf_counter())
    tolerance_dn = study.plans[scenario].tolerance_dn if study.plans else study.section.tolerance_dn
    allowed_dn = _allowed_dn(setup, tolerance_dn)
    own_s, reference_s = np.diff(times).tolist()
    result = [{key: row[key] for key in ("design_id", "filter_id", "scenario", "simulation_key")} for row in rows]
    result = [row | {"own_s": own_s, "reference_s": reference_s} for row in result]
    in_dn = {name for name, of in compared.items() if of.unit == DN and of.pair is not None}
    for (what, realized, allowed), names in (
        (("quantity", "realized_dn", "allowed_dn"), in_dn & exact.keys()),
        (("other", "realized_share", "allowed_share"), (compared.keys() - in_dn) & exact.keys()),
    ):
        for index, row in enumerate(rows):
            differences = []
            for name in sorted(names):
                pair = row[name], float(exact[name][index])
                if name in in_dn:
                    more = _CHROMATIC_SHARE * abs(pair[1]) * ("chromatic" in name)
                    differences.append((_difference(*pair), allowed_dn + more, name))
                else:
                    bound = _allowed_share(compared[name], owner, row, allowed_dn)
                    differences.append((_share(compared[name], *pair), bound, name))
            worst = max(differences, key=lambda of: of[0] / of[1], default=(0.0, 1.0, ""))
            result[index] |= dict(zip((realized, allowed, what), worst, strict=True))
    return result


def _difference(stored: float, exact: float) -> float:
    """Return the difference of two values; a column that the scene does not have is missing in both."""
    if stored == exact or (math.isnan(stored) and math.isnan(exact)):
        return 0.0
    difference = abs(stored - exact)
    return math.inf if math.isnan(difference) else difference


def _share(quantity: Quantity, stored: float, exact: float) -> float:
    """Return the relative difference of two values, of errors that of the d' which stands for them."""
    if quantity.scale == "log10" and not math.isnan(stored + exact):
        stored, exact = oriented(quantity, np.array([stored, exact])).tolist()
    difference = _difference(stored, exact)
    size = max(abs(stored), abs(exact))
    return difference / size if 0 < difference < math.inf else difference


def _allowed_share(quantity: Quantity, owner: Mapping[str, Metric], row: Row, allowed_dn: float) -> float:
    """Return the relative difference of a column that is no issue.

    Of a figure of one pair under noise also that of its distance in DN which the tolerance allows.
    """
    computed_by = owner.get(quantity.of or quantity.name)
    if computed_by is not None and not computed_by.of_scene:
        return _SAME
    pairs = [quantity.pair] if quantity.pair is not None else class_pairs(quantity.states)
    metric = CHROMATIC_CSD if "chromatic" in quantity.name else CSD
    known = [row.get(pair_name(metric, pair), math.nan) for pair in pairs if quantity.states]
    least = min((distance for distance in known if distance > 0), default=math.inf)
    return _SHARE + allowed_dn / least


def _allowed_dn(setup: Setup, tolerance_dn: float) -> float:
    """Return the difference of a separation from the reference that is no issue, DN.

    That is the tolerance. A readout in whole numbers without noise steps by up to sqrt(channels) DN between
    neighboring samples, and by 2 DN with every pixel counted: with images of a light, moments of a pulse or all field
    positions, the larger one is added.
    """
    scene, steps = setup.scene, setup.scene.noise is None and setup.computes("quantization")
    sampled = scene.target is not None or scene.drive is not None or setup.all_heights
    channels = len(setup.camera.mosaic.channels)
    return tolerance_dn + (max(math.sqrt(channels), 2.0) if steps and sampled else 0.0)


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
    of_dn = max(rows, key=lambda row: (row["realized_dn"] > row["allowed_dn"], row["realized_dn"]))
    of_share = max(rows, key=lambda row: row["realized_share"] / row["allowed_share"])
    keys = {key: of_dn[key] for key in ("design_id", "scenario", "quantity", "allowed_dn")}
    keys |= {key: of_share[key] for key in ("other", "allowed_share")}
    largest = {"largest_dn": of_dn["realized_dn"], "largest_share": of_share["realized_share"]}
    # Of each scene the first row in each worker also takes what is computed once.
    warm = [row for row in rows if not row["first"]] or rows
    slower = sum(row["reference_s"] for row in warm) / sum(row["own_s"] for row in warm)
    return CheckFacts(rows=len(rows), slower=slower, **largest, **keys), warnings


def _checked(study: Study, rows: Sequence[Row], seconds: float) -> tuple[list[dict[str, Any]], list[str]]:
    """Compare some rows until the time is over; return results and warnings."""
    ended = time.monotonic() + seconds
    result: list[dict[str, Any]] = []
    warnings: list[str] = []
    seen = set[str]()
    for row in rows:
        try:
            for compared in compared_rows(study, [row]):
                result += [checked | {"first": row["scenario"] not in seen} for checked in compared]
                seen.add(row["scenario"])
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
