from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sweep.base.errors import BrokenProofError
from sweep.commands.app import main
from sweep.designs.families.free_form import FreeForm
from sweep.metrics.bound import FEASIBLE, Bound, total_violation
from sweep.metrics.evaluate import designed_quantities
from sweep.metrics.objective import Objective
from sweep.metrics.separation import separation
from sweep.metrics.smooth import smooth_response
from sweep.run import search as searching
from sweep.search import trade_off
from sweep.search.gradients import Model
from sweep.search.limit import Limit, limit_of
from sweep.search.problem import Evaluation, Problem, SearchRun, best_feasible, starting_points
from sweep.search.solver import search_from
from sweep.study import Study, load_study

from ..build import stopband_study
from ..conftest import STUDIES


@pytest.fixture(scope="module")
def study() -> Study:
    return load_study(STUDIES / "stopband.yaml")


def test_search_beats_a_fine_grid_of_its_box(study: Study) -> None:
    assert study.search is not None
    problem = study.problem(study.search)
    rng = np.random.default_rng(7)
    x = problem.from_unit(rng.uniform(size=(20_000, problem.free.size)))
    curves = problem.family.curves(x)
    ok = (designed_quantities(problem.setup, curves)["sensitivity"] >= 0.90) & (problem.family.violation(x) <= 0).all(
        axis=1
    )
    members = problem.setup.members
    csd = separation(smooth_response(problem.setup, curves[ok])[:, 0], members["yellow"], members["red"])
    log = []
    for start, u in enumerate(starting_points(problem, 4, 1)):
        log += search_from(problem, start, u, "SLSQP", 125).log
    best = best_feasible(log)
    assert best is not None
    assert best.objective >= csd.max()


@pytest.mark.slow
def test_search_beats_a_million_designs_of_its_box(tmp_path: Path) -> None:
    text = (STUDIES / "stopband.yaml").read_text()
    for old, new in (
        ("630, count: 31", "630, count: 40"),
        ("700, count: 31", "700, count: 40"),
        ("count: 11", "count: 25"),
    ):
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / "million.yaml"
    path.write_text(text)
    study = load_study(path)
    assert study.search is not None
    space = study.search.space
    assert space.size == 1_000_000
    problem = study.problem(study.search)
    members = problem.setup.members
    best_swept = 0.0
    for start in range(0, space.size, 4000):
        x = space.points(start, start + 4000)
        curves = problem.family.curves(x)
        amounts = designed_quantities(problem.setup, curves)
        ok = total_violation(amounts, problem.constraints, space.violation(x)) <= FEASIBLE
        if ok.any():
            response = smooth_response(problem.setup, curves[ok])[:, 0]
            best_swept = max(best_swept, separation(response, members["yellow"], members["red"]).max())
    runs = [search_from(problem, i, u, "SLSQP", 125) for i, u in enumerate(starting_points(problem, 16, 1))]
    best = best_feasible([e for run in runs for e in run.log])
    assert sum(len(run.log) for run in runs) <= 2000
    assert best is not None
    assert best.objective >= best_swept > 200


def test_answer_is_feasible_when_checked_again(study: Study) -> None:
    assert study.search is not None
    problem = study.problem(study.search)
    run = search_from(problem, 0, starting_points(problem, 1, 1)[0], "SLSQP", 125)
    best = best_feasible(run.log)
    assert best is not None
    curve = problem.family.curves(best.x[None])[0, 0]
    assert curve.sum() / study.sensor.qe["Y"].sum() >= 0.90 * (1 - FEASIBLE)
    assert ((best.x >= problem.low) & (best.x <= problem.high)).all()
    assert (problem.family.violation(best.x[None]) <= FEASIBLE).all()


def test_budget_counts_simulations(study: Study) -> None:
    assert study.search is not None
    problem = study.problem(study.search)
    for budget in (1, 2, 7):
        run = search_from(problem, 0, np.full(problem.free.size, 0.3), "MMA", budget)
        assert len(run.log) == budget
        assert run.status == "maxeval_reached"


def test_settled_search_misses_nothing(study: Study, monkeypatch: pytest.MonkeyPatch) -> None:
    """What SLSQP would do after its evaluations lie in one place is rounding: the answer is the same to 1e-9."""
    assert study.search is not None
    problem = study.problem(study.search)
    starts = starting_points(problem, 4, 1)
    ended = [search_from(problem, i, u, "SLSQP", 125) for i, u in enumerate(starts)]
    assert "settled" in {run.status for run in ended}
    monkeypatch.setattr("sweep.search.gradients._SETTLED_EVALUATIONS", 1000)
    for i, u in enumerate(starts):
        whole, best = search_from(problem, i, u, "SLSQP", 125), best_feasible(ended[i].log)
        assert [e.objective for e in whole.log[: len(ended[i].log)]] == [e.objective for e in ended[i].log]
        more = best_feasible(whole.log)
        assert best is not None
        assert more is not None
        assert more.objective <= best.objective * (1 + 1e-9)


def test_a_search_whose_budget_is_spent_says_so(study: Study) -> None:
    """Where it lies in one place just then, too; algorithms without gradients never end for that."""
    assert study.search is not None
    problem, start = study.problem(study.search), starting_points(study.problem(study.search), 1, 1)[0]
    whole = search_from(problem, 0, start, "COBYLA", 2000)
    assert whole.status == "xtol_reached"
    budget = len(whole.log) - 1
    latest = [problem.to_unit(each.x) for each in whole.log[budget - 16 : budget]]
    assert np.ptp(latest, axis=0).max() <= 1e-6
    run = search_from(problem, 0, start, "COBYLA", budget)
    assert len(run.log) == budget
    assert run.status == "maxeval_reached"


def test_a_search_has_not_settled_while_its_objective_moves(study: Study) -> None:
    """Of a box a million times as wide as what matters in it."""
    assert study.search is not None
    plain = study.problem(study.search)
    wide = replace(plain, high=plain.high + np.array([0, 0, 0, 1e7, 0]))
    model = Model(wide, SearchRun(0), 1000)
    x = plain.from_unit(np.full(plain.free.size, 0.4))
    for width in np.linspace(5, 9, 16):
        x[3] = width
        model.at(wide.to_unit(x))
    assert not model.settled
    for step in range(16):
        x[3] = 9 + 1e-6 * step
        model.at(wide.to_unit(x))
    assert model.settled


def test_same_seed_same_log(study: Study) -> None:
    assert study.search is not None
    problem = study.problem(study.search)
    u = starting_points(problem, 3, 5)
    np.testing.assert_array_equal(u, starting_points(problem, 3, 5))
    assert not np.array_equal(u, starting_points(problem, 3, 6))
    logs = [[e.objective for e in search_from(problem, 0, u[2], "SLSQP", 60).log] for _ in range(2)]
    assert logs[0] == logs[1]


def test_best_of_a_log() -> None:
    def made(csd: float, violation: float) -> Evaluation:
        return Evaluation(np.zeros(1), csd, 1.0, 1.0, violation)

    log = [made(1, 0), made(9, 1e-6), made(5, 1e-10), made(np.nan, 0), made(5, 0)]
    assert best_feasible(log) is log[2]
    assert best_feasible(log[1:2]) is None


def test_constraint_on_another_pair_is_met(tmp_path: Path) -> None:
    text = (STUDIES / "stopband.yaml").read_text().replace("{min: 0.90}", "{min: 0.85}\n  csd_orange_red: {min: 100}")
    (tmp_path / "s.yaml").write_text(text)
    study = load_study(tmp_path / "s.yaml")
    assert study.search is not None
    problem = study.problem(study.search)
    log = [
        e for i, u in enumerate(starting_points(problem, 4, 1)) for e in search_from(problem, i, u, "SLSQP", 125).log
    ]
    best = best_feasible(log)
    assert best is not None
    members = problem.setup.members
    response = smooth_response(problem.setup, problem.family.curves(best.x[None]))[:, 0]
    assert separation(response, members["orange"], members["red"])[0] >= 100 * (1 - FEASIBLE)


@pytest.mark.parametrize(
    ("algorithm", "share"),
    [
        ("COBYLA", 0.95),
        *(
            pytest.param(*own, marks=pytest.mark.slow)
            for own in (("MMA", 0.99), ("ISRES", 0.5), ("ORIG_DIRECT_L", 0.6), ("AGS", 0.5))
        ),
    ],
)
def test_every_algorithm_finds_feasible_designs_within_its_budget(study: Study, algorithm: str, share: float) -> None:
    """The gradient algorithms find the optimum; the others come near it in 400 simulations, as their kind does."""
    assert study.search is not None
    problem = replace(study.problem(study.search), constraints={"sensitivity": Bound(min=0.90)})
    best_known = best_feasible(
        [e for i, u in enumerate(starting_points(problem, 8, 1)) for e in search_from(problem, i, u, "SLSQP", 125).log]
    )
    log = [
        e for i, u in enumerate(starting_points(problem, 2, 3)) for e in search_from(problem, i, u, algorithm, 200).log
    ]
    best = best_feasible(log)
    assert len(log) <= 400
    assert best is not None
    assert best_known is not None
    assert share * best_known.objective <= best.objective <= best_known.objective * (1 + 1e-6)


@pytest.mark.parametrize("algorithm", ["ISRES", "COBYLA"])
def test_direct_algorithms_repeat(study: Study, algorithm: str) -> None:
    assert study.search is not None
    problem = study.problem(study.search)
    u = starting_points(problem, 1, 5)[0]
    logs = [[e.objective for e in search_from(problem, 3, u, algorithm, 60, seed=9).log] for _ in range(2)]
    assert logs[0] == logs[1]


def test_a_filter_without_light_does_not_end_the_search(study: Study) -> None:
    assert study.search is not None
    problem = study.problem(study.search)
    dark = problem.setup.with_camera(qe=problem.setup.camera.qe * 0)
    run = search_from(replace(problem, setup=dark), 0, np.full(problem.free.size, 0.5), "SLSQP", 20)
    assert best_feasible(run.log) is None
    assert run.log


@pytest.mark.parametrize(
    "constraints",
    [{"slope_per_nm": Bound(max=0.0)}, {"min_transmission": Bound(min=1.0)}, {"sensitivity": Bound(min=1.0)}],
    ids=lambda constraints: next(iter(constraints)),
)
def test_a_bound_at_the_end_of_what_can_be_is_met(study: Study, constraints: dict[str, Bound]) -> None:
    """Flat filters under a flat curve, or the flat curve alone: nothing lies inside such a bound."""
    assert study.search is not None
    found = study.problem(study.search)
    wave, base = study.grid.nodes_nm, np.full(study.grid.size, 0.3)
    qe = found.setup.camera.qe.copy()
    qe[found.setup.camera.modified[0]] = base
    family = FreeForm(wave, base, np.arange(400.0, 701.0, 20.0))
    ends = np.zeros(family.nodes_nm.size), np.ones(family.nodes_nm.size)
    problem = Problem(
        found.setup.with_camera(qe=qe), family, *ends, Objective(minimum={"csd_yellow_red": 1.0}), constraints
    )
    log = [
        e for i, u in enumerate(starting_points(problem, 4, 1)) for e in search_from(problem, i, u, "SLSQP", 100).log
    ]
    best = best_feasible(log)
    assert best is not None
    name, bound = next(iter(constraints.items()))
    curves = family.curves(best.x[None])
    assert bound.violation(designed_quantities(problem.setup, curves)[name])[0] <= FEASIBLE
    assert np.ptp(curves) <= 1e-6  # 300 steps of what counts as no slope
    assert best.objective <= limit_of(problem).proven


def test_an_edge_as_wide_as_the_box_allows_is_met(study: Study) -> None:
    assert study.search is not None
    found = study.problem(study.search)
    widest = {"edge_width_nm": Bound(min=float(found.high[1])), "sensitivity": Bound(min=0.9)}
    problem = replace(found, constraints=widest)
    log = [
        e for i, u in enumerate(starting_points(problem, 4, 1)) for e in search_from(problem, i, u, "SLSQP", 100).log
    ]
    best = best_feasible(log)
    assert best is not None
    assert best.x[[1, 3]] == pytest.approx(found.high[[1, 3]], rel=1e-8)


@pytest.mark.parametrize("bound", [0.0, 1e-12, 1e-6, 0.06, 300.0])
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


@pytest.mark.parametrize(
    ("tolerance_dn", "where"),
    [pytest.param(1e-3, "broken proof: ", marks=pytest.mark.slow), (0.02, "broken proof at a sensitivity")],
)
def test_a_limit_below_what_the_search_found_stops_the_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tolerance_dn: float, where: str
) -> None:
    """One line, an exit code of its own, no results; and what was searched is not searched again."""
    (tmp_path / "tiny.yaml").write_text(TINY)
    searched: list[int] = []

    def counted(problem: Problem, start: int, *rest: object) -> SearchRun:
        searched.append(start)
        return search_from(problem, start, *rest)

    def planted(problem: Problem, tolerance: float = 1e-3, *rest: int) -> Limit:
        found = limit_of(problem, tolerance, *rest)
        return replace(found, proven=0.5 * found.proven) if tolerance == tolerance_dn else found

    def ended() -> object:
        command = ["sweep", "run", str(tmp_path / "tiny.yaml"), "--output", str(tmp_path), "--jobs", "1"]
        monkeypatch.setattr(sys, "argv", command)
        with pytest.raises(SystemExit) as stopped:
            main()
        return stopped.value.code

    for module in (searching, trade_off):
        monkeypatch.setattr(module, "search_from", counted)
    with monkeypatch.context() as wrong:
        for module in (searching, trade_off):
            wrong.setattr(module, "limit_of", planted)
        assert ended() == BrokenProofError.exit_code == 5
        said = capsys.readouterr().err.splitlines()
        assert len(said) == 1
        assert where in said[0]
        first = len(searched)
        assert first >= 2
        assert ended() == 5
        assert len(searched) == first
    assert not (tmp_path / "tiny" / "results.parquet").exists()
    assert ended() == 0  # the wrong limit was not kept, and what was searched was
    assert (tmp_path / "tiny" / "results.parquet").exists()
    assert searched[first:].count(0) == (3 if tolerance_dn == 1e-3 else 0), searched  # the levels of the front alone
