"""The smooth model: its rows are the quantities of the result table, its derivatives are exact."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sweep.designs.tolerance import NONE, Tolerance
from sweep.metrics.bound import Bound
from sweep.metrics.objective import Objective
from sweep.metrics.smooth import Rows
from sweep.search.problem import Problem, starting_points

from .problems import PROBLEM, best_of, csd_of, problem_of, rows_at

EVERYTHING = {
    "sensitivity": Bound(min=0.9, max=0.99),
    "cfa_sensitivity": Bound(min=0.5),
    "worst_sensitivity": Bound(min=0.85),
    "slope_per_nm": Bound(max=0.06),
    "min_transmission": Bound(min=0.1),
    "edge_width_nm": Bound(min=8.0),
    "band_width_nm": Bound(min=10.0),
    "csd_orange_red": Bound(min=50.0),
    "worst_csd_green_red": Bound(min=50.0),
}
OBJECTIVES = (
    Objective(minimum={"csd_yellow_red": 1.0}),
    Objective(minimum={"worst_csd_yellow_red": 1.0, "csd_orange_red": 3.0, "sensitivity": 200.0}),
    Objective(sum={"worst_csd_yellow_red": 0.5, "csd_green_red": 0.1, "cfa_sensitivity": 100.0}),
)


def test_roots_of_rows_have_half_the_slope_over_the_root() -> None:
    rows = Rows(np.array([9.0, 0.0]), np.array([[12.0, -6.0], [1.0, 1.0]])).roots()
    assert rows.values.tolist() == [3.0, 0.0]
    assert rows.by_u.tolist() == [[2.0, -1.0], [0.0, 0.0]]


def check_derivatives(problem: Problem, u: np.ndarray, parameters: range) -> None:
    """Compare with central differences: the responses are analytic between the kinks of the edge's curve, so these err by
    O(h^2), here < 1e-5.
    """
    _, by_u = rows_at(problem, u)
    scale, step = np.abs(by_u).max(axis=1) + 1e-9, 1e-5
    for k in parameters:
        ends = [rows_at(problem, u + sign * step * np.eye(u.size)[k])[0] for sign in (1, -1)]
        np.testing.assert_allclose(by_u[:, k] / scale, (ends[0] - ends[1]) / (2 * step) / scale, atol=1e-5)


@pytest.mark.parametrize("objective", OBJECTIVES, ids=str)
@pytest.mark.parametrize("name", ["stopband", "freeform"])
def test_derivatives_agree_with_differences(name: str, objective: Objective) -> None:
    problem = problem_of(name)
    own = {n: b for n, b in EVERYTHING.items() if n not in ("edge_width_nm", "band_width_nm") or name != "freeform"}
    problem = replace(problem, objective=objective, constraints=own, tolerance=Tolerance(2.0))
    u = np.clip(starting_points(problem, 3, 4)[2], 0.05, 0.95)
    check_derivatives(problem, u, range(0, u.size, 7 if name == "freeform" else 1))


def test_worst_case_is_the_smallest_over_the_shifts() -> None:
    problem = replace(PROBLEM, tolerance=Tolerance(4.0), objective=Objective(minimum={"worst_csd_yellow_red": 1.0}))
    problem = replace(problem, constraints={"worst_sensitivity": Bound(min=0.9)})
    best = best_of(problem, 1, 100)
    moved = np.repeat(best.x[None], 401, axis=0)
    moved[:, [0, 2]] += np.linspace(-4, 4, 401)[:, None]
    csd = csd_of(problem.setup, problem.family.curves(moved))
    assert best.objective == pytest.approx(csd[::100].min(), rel=1e-12)
    # Between the five shifts that are computed, nothing is much worse.
    assert csd.min() >= best.objective * 0.99
    assert best_of(replace(problem, tolerance=NONE), 1, 100).objective > best.objective
