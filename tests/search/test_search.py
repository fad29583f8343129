"""The search: at a known optimum, within its bounds, deterministic, and stopped by an upper bound that it exceeds (bug)."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from sweep.base.errors import UpperBoundExceededError
from sweep.designs.families.free_form import FreeForm
from sweep.metrics.bound import FEASIBLE, Bound
from sweep.metrics.evaluate import designed_quantities
from sweep.report import read_output
from sweep.runs import search as searching
from sweep.search import trade_off
from sweep.search.gradients import Model
from sweep.search.problem import CONVERGED, Evaluation, Problem, SearchRun, best_feasible, starting_points
from sweep.search.solver import ALGORITHMS, ONE_START, search_from
from sweep.search.upper_bound import UpperBound, upper_bound_of

from ..build import load, ran, stopband_study
from ..commanded import commanded
from .problems import PROBLEM, STUDY, best_of

SETUP, FAMILY, N_FREE = PROBLEM.setup, PROBLEM.family, PROBLEM.free.size


def test_settled_search_misses_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Steps of SLSQP after its evaluations lie in one place are rounding: the answer is the same to 1e-9."""
    starts = starting_points(PROBLEM, 4, 1)
    ended = [search_from(PROBLEM, i, u, "SLSQP", 125) for i, u in enumerate(starts)]
    assert "settled" in {run.status for run in ended}
    monkeypatch.setattr("sweep.search.gradients._SETTLED_EVALUATIONS", 1000)
    for i, u in enumerate(starts):
        whole = search_from(PROBLEM, i, u, "SLSQP", 125)
        assert [e.objective for e in whole.log[: len(ended[i].log)]] == [e.objective for e in ended[i].log]
        assert best_feasible(whole.log).objective <= best_feasible(ended[i].log).objective * (1 + 1e-9)


def test_a_search_has_not_settled_while_its_objective_moves() -> None:
    """In a box a million times as wide as what matters in it."""
    wide = replace(PROBLEM, high=PROBLEM.high + np.array([0, 0, 0, 1e7, 0]))
    model = Model(wide, SearchRun(0), 1000)
    x = PROBLEM.from_unit(np.full(N_FREE, 0.4))
    for widths, settled in ((np.linspace(5, 9, 16), False), (9 + 1e-6 * np.arange(16), True)):
        for width in widths:
            x[3] = width
            model.at(wide.to_unit(x))
        assert model.settled == settled


def test_a_search_ends_where_its_algorithm_asks_for_no_number() -> None:
    """As SLSQP does where its own arithmetic fails, which depends on the machine: nothing is simulated there."""
    run = SearchRun(0)
    model, stopped = Model(PROBLEM, run, 10), list[bool]()
    model.stop = lambda: stopped.append(True)
    first = model.at(np.full(N_FREE, 0.5))
    assert model.at(np.array([0.5, np.nan, 0.5, 0.5])) is first
    assert model.lost
    assert stopped == [True]
    assert len(run.log) == 1


def test_same_seed_gives_the_same_log() -> None:
    u = starting_points(PROBLEM, 3, 5)
    np.testing.assert_array_equal(u, starting_points(PROBLEM, 3, 5))
    assert not np.array_equal(u, starting_points(PROBLEM, 3, 6))
    logs = [[e.objective for e in search_from(PROBLEM, 0, u[2], "SLSQP", 60).log] for _ in range(2)]
    assert logs[0] == logs[1]


def test_best_of_a_log() -> None:
    given = ((1, 0), (9, 1e-6), (5, 1e-10), (np.nan, 0), (5, 0))
    log = [Evaluation(np.zeros(1), csd, 1.0, 1.0, violation) for csd, violation in given]
    assert best_feasible(log) is log[2]
    assert best_feasible(log[1:2]) is None


@pytest.mark.parametrize(
    ("algorithm", "share"),
    [
        ("COBYLA", 0.95),
        pytest.param("ISRES", 0.5, marks=pytest.mark.slow),
    ],
)
def test_every_algorithm_finds_feasible_designs_within_its_budget(algorithm: str, share: float) -> None:
    """The gradient algorithms find the optimum; the others come near it in 400 simulations, as their kind does."""
    problem = replace(PROBLEM, constraints={"sensitivity": Bound(min=0.90)})
    optimum = best_of(problem, 8, 125).objective
    log = [
        e for i, u in enumerate(starting_points(problem, 2, 3)) for e in search_from(problem, i, u, algorithm, 200).log
    ]
    assert len(log) <= 400
    assert share * optimum <= best_feasible(log).objective <= optimum * (1 + 1e-6)


def test_a_filter_without_light_does_not_end_the_search() -> None:
    dark = replace(PROBLEM, setup=SETUP.with_camera(qe=SETUP.camera.qe * 0))
    run = search_from(dark, 0, np.full(N_FREE, 0.5), "SLSQP", 20)
    assert best_feasible(run.log) is None
    assert run.log


@pytest.mark.parametrize(
    ("name", "bound"),
    [("slope_per_nm", Bound(max=0.0)), ("min_transmission", Bound(min=1.0)), ("sensitivity", Bound(min=1.0))],
)
def test_a_constraint_at_the_end_of_a_quantity_is_met(name: str, bound: Bound) -> None:
    """Flat filters under a flat curve, or the flat curve alone: nothing lies inside such a bound."""
    qe = SETUP.camera.qe.copy()
    qe[SETUP.camera.modified[0]] = base = np.full(STUDY.grid.size, 0.3)
    family = FreeForm(STUDY.grid.nodes_nm, base, np.arange(400.0, 701.0, 20.0))
    ends, objective = (np.zeros(family.nodes_nm.size), np.ones(family.nodes_nm.size)), PROBLEM.objective
    problem = Problem(SETUP.with_camera(qe=qe), family, *ends, objective, {name: bound})
    best = best_of(problem, 4, 100)
    curves = family.curves(best.x[None])
    assert bound.violation(designed_quantities(problem.setup, curves)[name])[0] <= FEASIBLE
    assert np.ptp(curves) <= 1e-6  # 300 steps of what counts as no slope
    assert best.objective <= upper_bound_of(problem).proven


def test_bounds_on_dimensions_are_met() -> None:
    limits = {"edge_width_nm": Bound(min=25.0), "band_width_nm": Bound(min=40.0), "sensitivity": Bound(min=0.8)}
    left, left_width, right, right_width, _ = best_of(replace(PROBLEM, constraints=limits), 4, 125).x
    assert min(left_width, right_width) >= 25 * (1 - 1e-9)
    assert right - left >= 40 * (1 - 1e-9)


@pytest.mark.parametrize("bound", [0.0, 1e-6, 300.0])
def test_rounding_is_no_violation_of_any_bound(bound: float) -> None:
    """A slope of 1e-16 is one of a flat filter; what misses a bound by a thousandth, or by 1e-6, does violate it."""
    for kind in (Bound(max=bound), Bound(min=bound)):
        sign = 1.0 if kind.max is not None else -1.0
        assert kind.violation(np.array([bound + sign * (1e-16 + 1e-15 * bound)]))[0] <= FEASIBLE
        assert kind.violation(np.array([bound + sign * max(1e-6, 1e-3 * bound)]))[0] > FEASIBLE


TINY = stopband_study(
    "tiny",
    "{left_nm: {min: 590, max: 690, count: 5}, left_width_nm: [5], right_nm: {min: 640, max: 690, count: 5}, "
    "right_width_nm: [5]}",
    after="constraints: {sensitivity: {min: 0.9}}\n"
    "search: {starts: 2, max_evaluations: 60, front: {min: 0.85, max: 0.95, count: 3}}\n",
    cfas="[RYNCy]",
)


def test_an_upper_bound_below_the_search_result_stops_the_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One line, an exit code of its own, no results; and what was searched is not searched again."""
    (tmp_path / "tiny.yaml").write_text(TINY)
    searched: list[int] = []

    def counted(problem: Problem, start: int, *rest: object) -> SearchRun:
        searched.append(start)
        return search_from(problem, start, *rest)

    def planted(problem: Problem, tolerance: float = 1e-3, *rest: int) -> UpperBound:
        found = upper_bound_of(problem, tolerance, *rest)
        return replace(found, proven=0.5 * found.proven) if tolerance == 0.02 else found

    def ended() -> tuple[int, str, str]:
        return commanded("run", tmp_path / "tiny.yaml", "--output", tmp_path, "--jobs", 1)

    for module in (searching, trade_off):
        monkeypatch.setattr(module, "search_from", counted)
    with monkeypatch.context() as wrong:
        for module in (searching, trade_off):
            wrong.setattr(module, "upper_bound_of", planted)
        code, _, err = ended()
        assert code == UpperBoundExceededError.exit_code == 5
        (said,) = err.splitlines()
        assert "upper bound exceeded (bug) at a sensitivity" in said
        first = len(searched)
        assert ended()[0] == 5
        assert len(searched) == first
    assert not (tmp_path / "tiny" / "results.parquet").exists()
    assert ended()[0] == 0  # the wrong limit was not kept, and what was searched was
    assert (tmp_path / "tiny" / "results.parquet").exists()
    assert searched[first:].count(0) == 0


CASE = """\
study: case
sensor: ar0820
lights: tl16
cfas: [RGGB, RYNCy]
boxes:
  y: {cfa: RYNCy, channel: N, base: Y, to: G, box: {left_nm: [560, 640], left_width_nm: [4, 30], right_nm: [625, 700], right_width_nm: [4, 30]}}
constraints: {sensitivity: {min: 0.9}, slope_per_nm: {max: 0.06}, csd_green_yellow: {min: 600}}
search: {algorithm: ORIG_DIRECT_L, starts: 4, max_evaluations: 100, front: {min: 0.9, max: 0.95, count: 2}}
"""


def test_a_global_search_takes_one_start_and_ends_at_the_optimum_of_gradients(tmp_path: Path) -> None:
    """Of SLSQP, MMA and differential evolution, 234.2 DN; the global search alone finds 178 DN in 2,000 evaluations."""
    study = load(tmp_path, CASE)
    assert study.search is not None
    ran(study, tmp_path / "out", 1)
    facts, log = read_output(tmp_path / "out").provenance.search, pd.read_parquet(tmp_path / "out" / "search.parquet")
    assert facts is not None
    assert facts.best_smooth_objective == pytest.approx(234.2, abs=0.1)
    assert facts.endings[0] == "maxeval_reached"
    assert facts.endings[1] in CONVERGED
    at_levels = log["sensitivity_min"].notna()
    assert facts.evaluations == (~at_levels).sum() > 100
    assert facts.front_evaluations == at_levels.sum()
    front = pd.read_parquet(tmp_path / "out" / "search_front.parquet").set_index("sensitivity_min")
    assert front.loc[0.9, "objective"] == pytest.approx(facts.best_smooth_objective, rel=1e-6)


@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_the_algorithms_of_one_start_are_those_whose_start_does_not_matter(algorithm: str) -> None:
    logs = [search_from(PROBLEM, i, u, algorithm, 40).log for i, u in enumerate(starting_points(PROBLEM, 2, 1))]
    after_start = [[e.objective for e in log[1:]] for log in logs]
    assert (after_start[0] == after_start[1]) == (algorithm in ONE_START)
