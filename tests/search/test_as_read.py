"""Answers of searches as the camera reads them out: feasible there, and no worse than those of dense sweeps."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from sweep.base.types import in_turn
from sweep.metrics.bound import Bound
from sweep.metrics.objective import Objective
from sweep.metrics.quantity import DN, Quantity
from sweep.runs.as_read import Reading, verdicts
from sweep.runs.rows import Rows, rows_of, rules_of
from sweep.runs.search import answer_rows, run_search
from sweep.study import Study, load_study

TEXT = """\
study: drawn
sensor: ar0820
lights: tl16
scenarios: {{scene: {scene}}}
pixel: {pixel}
cfas: [RGGB, RYNCy]
{more}
boxes:
  edges: {{cfa: RYNCy, channel: N, base: Y, to: G, box: {{left_nm: [600, 630], left_width_nm: [5, 15], right_nm: [635, 660], right_width_nm: [5, 15]}}}}
search: {{starts: 4, max_evaluations: 800}}
"""
SCENES = {
    "12 bits": ("{exposure: {kind: white_patch, level: 0.95}}", "{}", ""),
    "8 bits": ("{exposure: {kind: white_patch, level: 0.95}}", "{bits: 8}", ""),
    "clipped": ("{exposure: {kind: fixed, exposure_s: 0.03}}", "{bits: 10}", ""),
    "noise": (
        "{noise: true, exposure: {kind: white_patch, level: 0.05}}",
        "{read_noise_e: 10, offset_dn: 168}",
        "recognition: {states: [green, yellow, red]}",
    ),
}
CHANNELS = 4
GRID = (np.linspace(0, 1, 7), np.linspace(0, 1, 3), np.linspace(0, 1, 7), np.linspace(0, 1, 3))
"""Shares of the box at which each parameter is swept."""


def study_of(folder: Path, scene: str) -> Study:
    path = folder / "drawn.yaml"
    scenario, pixel, more = SCENES[scene]
    path.write_text(TEXT.format(scene=scenario, pixel=pixel, more=more))
    return load_study(path).with_plans()


def swept_rows(study: Study) -> pd.DataFrame:
    """Rows of a sweep of the box."""
    problem, rules = study.problem(study.search), rules_of(study)
    points = problem.from_unit(np.array(list(product(*GRID))))
    space = replace(study.search.space, axes=tuple(map(tuple, points.T)), listed=len(points))
    at = np.arange(len(points))
    return rows_of(Rows(space, "scene", at, at, at), study.setup(space, "scene"), rules, rules.wanted).to_pandas()


def pairs_of(
    scene: str, count: int, quantities: dict[str, Quantity], swept: pd.DataFrame
) -> list[tuple[str, str, Bound]]:
    """Objectives, and constraints with a bound between values of the sweep, drawn by chance."""
    rng = np.random.default_rng([count, *scene.encode()])
    known = {n: q for n, q in quantities.items() if not q.extreme and swept[n].notna().all() and swept[n].nunique() > 9}
    goals = [name for name, quantity in known.items() if quantity.goal and quantity.direction == "more"]
    bounded = [name for name, quantity in known.items() if quantity.constrained and quantity.ends]
    drawn = []
    while len(drawn) < count:
        goal, name = rng.choice(goals), rng.choice(bounded)
        end = rng.choice(known[name].ends)
        if goal != name:
            value = float(swept[name].quantile(rng.uniform(0.2, 0.95) if end == "min" else rng.uniform(0.05, 0.8)))
            drawn.append((goal, name, Bound(**{end: value})))
    return drawn


def test_a_verdict_is_the_worst_of_all_scenarios_and_misses_in_units_of_the_quantity(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    columns = [{"csd": np.array([5.0, 9.0]), "light": np.array([90.0, 70.0])}]
    columns.append({"csd": np.array([7.0, 8.0]), "light": np.array([60.0, 80.0])})
    rules = SimpleNamespace(constraints={"light": Bound(min=80)}, objective=SimpleNamespace(column="csd"))
    monkeypatch.setattr(Reading, "columns", lambda *_: iter(columns))
    reading = object.__new__(Reading)
    object.__setattr__(reading, "rules", rules)
    first, second = verdicts(reading, [np.zeros(1), np.ones(1)])
    assert (first.objective, second.objective) == (5.0, 8.0)
    assert (first.violation, second.violation) == (0.25, 0.125)
    assert (first.missed, second.missed) == ({"light": 20.0}, {"light": 10.0})


@pytest.mark.parametrize(
    ("scene", "count"), [("12 bits", 2), *(pytest.param(scene, 8, marks=pytest.mark.slow) for scene in SCENES)]
)
def test_the_answer_is_feasible_as_read_and_no_worse_than_a_dense_sweep(scene: str, count: int, tmp_path: Path) -> None:
    study = study_of(tmp_path, scene)
    swept = swept_rows(study)
    for goal, name, bound in pairs_of(scene, count, study.quantities, swept):
        asked = replace(study, objective=Objective(minimum={goal: 1.0}), constraints={name: bound})
        rules = rules_of(asked)
        answer = run_search(asked, asked.search, rules, in_turn, lambda *_: None)
        (row,) = answer_rows(asked, answer, rules, in_turn)[0].to_pylist()
        assert row["feasible"], (goal, name, bound)
        assert answer.best.feasible
        # Rounding takes at most a root of the channels from a distance in DN, or gives it.
        rounding = {one: CHANNELS**0.5 if study.quantities[one].unit == DN else 0.0 for one in (goal, name)}
        # The search takes Q(r) for errors, which of these pixels is up to 1.17 times the sum over digital numbers.
        share = 1 / 1.2 if study.quantities[name].scale == "log10" else 1.0
        inner = bound.model_copy(
            update={
                end: share * at + rounding[name] * (1 if end == "min" else -1) for end, at in bound if at is not None
            }
        )
        best = swept[goal][inner.violation(swept[name].to_numpy()) <= 0].max()
        if np.isfinite(best):
            assert row[goal] >= best * (1 - 1e-3) - rounding[goal], (goal, name, bound)
