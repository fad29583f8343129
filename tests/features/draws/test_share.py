"""The CSD that a share of random lamps and cameras has: as a column, an objective, a constraint."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.stats import binom

from sweep.features.draws.robustness import Candidate, drawn_dn
from sweep.metrics.bound import Bound
from sweep.metrics.drawn import rank_below
from sweep.metrics.drawn_sensors import searched_sample
from sweep.metrics.objective import Objective
from sweep.metrics.share import share_interval
from sweep.results.tables import RESULTS
from sweep.runs.rows import parts_of
from sweep.search.gradients import Model
from sweep.search.problem import Problem, SearchRun, starting_points
from sweep.search.upper_bound import upper_bound_of
from sweep.study import Search, Study, load_study

from ...build import load, one_line, ran
from ...conftest import STUDIES
from ...mischief import assert_same_tables

TEXT = """\
study: share
sensor: ar0820
lights: tl16
columns: all
cfas: [RGGB, RYNCy]
population: {temperature_c: [-40, 85], self_heating_k: 20, binning_nm: 2, wanted_yield: 0.99, draws: 4000}
production: {edge_shift_nm: 2}
sweeps:
  edges:
    {cfa: RYNCy, channel: N, base: Y, to: G, grid: {left_nm: [612, 620], left_width_nm: 6, right_nm: [650, 658], right_width_nm: 6}}
objective: sensitivity
constraints: {yield_csd_yellow_red: {min: 190}}
search: {starts: 2, max_evaluations: 120}
"""
YELLOW_RED = ("yellow", "red")


def study(folder: Path) -> Study:
    return load(folder, TEXT)


@cache
def lamps() -> tuple[Study, Search]:
    """The stopbands of `stopband.yaml`, for random lamps and cameras."""
    changes = {
        "population": "{temperature_c: [-40, 85], self_heating_k: 20, binning_nm: 2, wanted_yield: 0.99, draws: 4000}",
        "production": "{edge_shift_nm: 2}",
        "objective": "yield_csd_yellow_red",
    }
    loaded = load_study(STUDIES / "stopband.yaml", changes=changes)
    assert loaded.search is not None
    return loaded, loaded.search


def problem(objective: str = "yield_csd_yellow_red") -> Problem:
    loaded, search = lamps()
    return replace(loaded.problem(search), objective=Objective(minimum={objective: 1.0}))


@pytest.mark.parametrize(
    ("draws", "share"), [(1000, 0.99), (4000, 0.99), (20, 0.5), (100_000, 0.99), (10_000_000, 0.5)]
)
def test_yield_exceeds_the_true_value_in_at_most_a_twentieth_of_cases(draws: int, share: float) -> None:
    """The draw of that rank is above what the share has where fewer draws than its rank are below that."""
    rank = rank_below(draws, share)
    assert rank >= 5
    chances = [float(binom.cdf(below - 1, draws, 1 - share)) for below in (rank, rank + 1)]
    assert chances[0] <= 0.05 < chances[1]


def test_jobs_are_small_where_each_design_sees_many_draws(tmp_path: Path) -> None:
    given = study(tmp_path)
    assert max(job.size for part in parts_of(given) for job in part.jobs) <= 32


def test_the_value_is_what_the_share_of_other_draws_has() -> None:
    """Within the 95 % interval of the share of 200,000 other lamps and cameras, and not far below it."""
    study, search = lamps()
    setup, draws = study.setup(search.space, search.scenario), 200_000
    assert setup.lights.population is not None
    many = replace(setup.lights, population=setup.lights.population.model_copy(update={"draws": draws}))
    requested = problem()
    found = Model(requested, SearchRun(0), 1000).at(starting_points(requested, 2, 1)[0]).evaluation
    design = Candidate(replace(setup, lights=many), search.space, found.x[None], study.tolerance)
    kept = int((drawn_dn(design, YELLOW_RED, 77) >= found.objective).sum())
    low, high = share_interval(kept, draws)
    assert high >= 0.99
    assert low <= 0.995


@pytest.mark.slow
def test_as_column_and_constraint_any_number_of_workers_gives_the_same(tmp_path: Path) -> None:
    given = study(tmp_path)
    for jobs in (1, 2):
        ran(given, tmp_path / f"out{jobs}", jobs)
    assert_same_tables(tmp_path / "out1", tmp_path / "out2")
    rows = pd.read_parquet(tmp_path / "out1" / RESULTS)
    assert (rows["yield_csd_yellow_red"] > rows["worst_csd_yellow_red"]).all()
    filters = rows[rows["cfa"] == "RYNCy"]
    assert (filters["feasible"] == (filters["violation"] <= 1e-6)).all()
    assert 0 < filters["feasible"].sum() < len(filters)
    answer = filters[filters["kind"] == "search"].iloc[0]
    assert answer["feasible"]
    assert answer["yield_csd_yellow_red"] == pytest.approx(190.0, rel=1e-4)  # it binds: more light costs yield


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("wanted_yield: 0.99, ", "", "yield_csd_yellow_red needs `wanted_yield`"),
        ("draws: 4000", "draws: 500", "needs at least 1,000 `draws`"),
        ("draws: 4000", "draws: 1000001", "takes at most 1,000,000 `draws`"),
    ],
)
def test_inconsistent_population_is_refused(tmp_path: Path, old: str, new: str, told: str) -> None:
    with one_line(told):
        load(tmp_path, TEXT.replace(old, new))


def test_the_limit_leaves_a_constraint_on_it_out_and_says_so() -> None:
    """Few lamps are the nearest: what 99 % have says nothing of the smallest CSD, by which filters must not be bound."""
    plain = replace(problem("csd_yellow_red"), constraints={"sensitivity": Bound(min=0.9)})
    requested = replace(plain, constraints=plain.constraints | {"yield_csd_yellow_red": Bound(min=400)})
    without, found = upper_bound_of(plain), upper_bound_of(requested)
    assert found.left_out == ("yield_csd_yellow_red",)
    assert found.proven == without.proven > 0


def test_many_designs_have_the_yields_of_each_alone() -> None:
    loaded, search = lamps()
    points, size = search.space.points(0, 7), loaded.grid.size
    sample = searched_sample(problem().setup, loaded.tolerance, 1)
    found = sample.columns(lambda off, some: search.space.curves(points[some], size, off), len(points), [YELLOW_RED])
    for at in range(7):
        alone = [search.space.curves(points[at : at + 1], size, off) for off in sample.production_errors]
        distances = sample.distances(np.concatenate(alone), [YELLOW_RED])[YELLOW_RED]
        assert found["csd_yellow_red"][at] == pytest.approx(sample.of_share(distances)[0], rel=1e-9)
