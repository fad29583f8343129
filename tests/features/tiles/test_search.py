"""Search over tiles against a search in every tile, and bounds where the modified channel sets the exposure."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from sweep.camera.exposure import may_be_brightest
from sweep.features.tiles.tiles import EXCLUDED, SEARCHED, Tiles, search_tiles
from sweep.metrics.bound import Bound
from sweep.metrics.objective import Objective
from sweep.runs import run_study
from sweep.search.problem import Problem, starting_points
from sweep.search.trade_off import Effort
from sweep.search.upper_bound import upper_bound_of
from sweep.study import Study, load_study

from ...build import load
from ...search.problems import best_of, csd_of

TILES = """\
study: t
sensor: ar0820
lights: tl16
cfas: {RGGB: , tiles: 2x2, of: [OF], modified: 1}
boxes: {stopband: {cfa: tiles, to: G, box: {left_width_nm: [5, 55], right_width_nm: [5, 55]}}}
objective: chromatic_csd_yellow_red
constraints: {cfa_sensitivity: {min: 0.4}, slope_per_nm: {max: 0.06}}
search: {starts: 8, max_evaluations: 640}
"""


def tiles_study(folder: Path, of: str, *changes: tuple[str, str]) -> Study:
    text = TILES.replace("[OF]", f"[{of}]")
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    return load(folder, text)


def problems_of(study: Study) -> list[Problem]:
    assert study.search is not None
    return [study.problem(replace(study.search, space=space, tiles=())) for space in study.search.tiles]


def found(study: Study, levels: tuple[float, ...] = ()) -> tuple[list[Problem], Tiles]:
    problems = problems_of(study)
    effort = Effort("SLSQP", starting_points(problems[0], 8, 1), 80, 1)
    return problems, search_tiles(
        problems, levels, effort, lambda calls: (f(*a, **k) for f, a, k in calls), lambda *_: None
    )


def brute_force(problem: Problem, starts: int = 8, evaluations: int = 80) -> float:
    """The best of a search in one tile, as a study of that tile alone makes it."""
    best = best_of(problem, starts, evaluations)
    return -np.inf if best is None else best.objective


def check_against_brute_force(problems: list[Problem], tiles: Tiles) -> None:
    best, limits = tiles.best(0), [tile.upper_bound for tile in tiles.at[0]]
    values = np.array([brute_force(problem) for problem in problems])
    assert best is not None
    assert best.objective >= values.max() * (1 - 1e-3)
    assert (values <= np.array(limits) * (1 + 1e-9) + 1e-9).all()
    for tile, value in zip(tiles.at[0], values, strict=True):
        if tile.status(best.objective) == EXCLUDED:
            assert value <= best.objective * (1 + 1e-3)
    assert sum(tile.status(best.objective) == SEARCHED for tile in tiles.at[0]) < len(problems)


@pytest.mark.parametrize("objective", ["csd_yellow_red", "chromatic_csd_yellow_red"])
def test_the_best_of_few_tiles_is_that_of_a_search_in_each(tmp_path: Path, objective: str) -> None:
    study = tiles_study(tmp_path, "R, G, Y", ("chromatic_csd_yellow_red", objective))
    check_against_brute_force(*found(study))


def test_levels_of_light_have_no_better_filter_at_more(tmp_path: Path) -> None:
    """And the filter of each level has its light, below its bound."""
    problems, tiles = found(tiles_study(tmp_path, "R, G, Y"), (0.45, 0.5, 0.55))
    best = [tiles.best(level) for level in range(4)]
    values = [one.objective for one in best if one is not None]
    assert len(values) == 4
    assert values == sorted(values, reverse=True)
    for level, one in enumerate(best):
        assert one is not None
        assert one.cfa_sensitivity >= (0.4, 0.45, 0.5, 0.55)[level] - 1e-8
        assert one.objective <= tiles.upper_bound(level) * (1 + 1e-9)
    assert len(problems) == 30


def test_of_equal_tiles_the_one_with_more_light_counts(tmp_path: Path) -> None:
    """G G Y and G Y Y beside a filter in Y separate equally; the second collects more light."""
    study = tiles_study(tmp_path, "G, Y", ("cfa_sensitivity: {min: 0.4}", "sensitivity: {min: 0.9}"))
    assert study.search is not None
    _, tiles = found(study)
    best, winner = tiles.best(0), tiles.winners[0]
    assert best is not None
    assert winner is not None
    equal = [
        i for i, tile in enumerate(tiles.at[0]) if tile.best is not None and tile.best.objective > best.objective - 1e-3
    ]
    assert len(equal) > 1
    light = {study.search.tiles[i].name: tiles.at[0][i].best.cfa_sensitivity for i in equal}  # type: ignore[union-attr]
    assert light[study.search.tiles[winner].name] == pytest.approx(max(light.values()), abs=1e-5)


@pytest.mark.parametrize("least", [0.0, 0.5, 0.9])
@pytest.mark.parametrize("name", ["csd_yellow_red", "chromatic_csd_yellow_red"])
def test_no_filter_exceeds_a_bound_where_it_sets_the_exposure(tmp_path: Path, name: str, least: float) -> None:
    """Searched filters in clear pixels beside red ones, at their own exposure."""
    study = tiles_study(tmp_path, "R, C", ("chromatic_csd_yellow_red", name), ("to: G", "to: 0.05"))
    problem = next(
        p for p, s in zip(problems_of(study), study.search.tiles, strict=True) if s.name == "stopband RRRN(C)"
    )  # type: ignore[union-attr]
    bounds = {"sensitivity": Bound(min=least)} if least else {}
    problem = replace(problem, constraints=bounds, objective=Objective(minimum={name: 1.0}))
    assert may_be_brightest(problem.setup)
    levels = (0.2, 0.6, 0.95)
    limit = upper_bound_of(problem, 0.05, 500, levels)
    assert 0 < limit.attained <= limit.proven
    assert brute_force(problem, 6, 60) <= limit.proven * (1 + 1e-9)
    for level, proven in zip(levels, limit.elsewhere, strict=True):
        assert proven <= limit.proven + 2e-4  # a tangent is told to 1e-4
        at_level = replace(problem, constraints={"sensitivity": Bound(min=max(level, least))})
        assert brute_force(at_level, 4, 60) <= proven * (1 + 1e-9)


def test_a_least_sensitivity_below_that_of_others_keeps_their_exposure(tmp_path: Path) -> None:
    """A filter that may not be the brightest counts at the exposure of the others, not at that of its base."""
    study = tiles_study(tmp_path, "R, G, Y", ("chromatic_csd_yellow_red", "csd_yellow_red"), ("to: G", "to: 0.05"))
    problem = next(
        p for p, s in zip(problems_of(study), study.search.tiles, strict=True) if s.name == "stopband RGGN(Y)"
    )  # type: ignore[union-attr]
    problem = replace(problem, constraints={"sensitivity": Bound(max=0.4)})
    limit = upper_bound_of(problem)
    assert brute_force(problem, 8, 100) <= limit.proven * (1 + 1e-9)
    assert limit.curve is not None
    assert csd_of(problem.setup, limit.curve[None, None])[0] == pytest.approx(limit.attained, rel=1e-9)


def test_a_run_over_tiles_has_its_tables_and_resumes_from_its_own_study(tmp_path: Path) -> None:
    study = tiles_study(
        tmp_path, "R, Y", ("max_evaluations: 640", "max_evaluations: 320, front: {min: 0.45, max: 0.55, count: 2}")
    )
    run_study(study, tmp_path / "out", 1, lambda *_: None)
    tiles = pd.read_parquet(tmp_path / "out" / "tiles.parquet")
    assert len(tiles) == 3 * 8
    best = tiles[tiles["best"]]
    assert len(best) == 3
    assert (best["objective"] <= best["upper_bound"] * (1 + 1e-9)).all()
    rows = pd.read_parquet(tmp_path / "out" / "results.parquet")
    answer = rows[rows["kind"] == "search"].iloc[0]
    assert answer["space"] == best["space"].iloc[0]
    assert answer["cfa_sensitivity"] >= 0.4 - 1e-8
    again = load_study(tmp_path / "out" / "study.resolved.yaml")
    run_study(again, tmp_path / "again", 2, lambda *_: None)
    pd.testing.assert_frame_equal(tiles, pd.read_parquet(tmp_path / "again" / "tiles.parquet"))


@pytest.mark.slow
def test_tiles_are_searched_under_a_color_error(tmp_path: Path) -> None:
    changes = (
        ("slope_per_nm: {max: 0.06}", "slope_per_nm: {max: 0.06}, color_delta_e_mean_d65: {max: 3}"),
        ("objective:", "tasks: [color]\nobjective:"),
    )
    study = tiles_study(tmp_path, "R, G, B, Y", *changes)
    run_study(study, tmp_path / "out", 2, lambda *_: None)
    rows = pd.read_parquet(tmp_path / "out" / "results.parquet")
    answer = rows[rows["kind"] == "search"].iloc[0]
    assert answer["feasible"]
    assert answer["color_delta_e_mean_d65"] <= 3 + 1e-6
