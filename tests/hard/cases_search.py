"""Hard cases of search and limit: the optimum lies exactly on a constraint, or no design meets it."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from scipy.integrate import trapezoid
from scipy.optimize import brentq

from sweep.base.errors import InfeasibleError
from sweep.designs.families.stopband import Stopband
from sweep.metrics.bound import FEASIBLE, Bound
from sweep.metrics.objective import Objective
from sweep.runs.rows import rules_of
from sweep.runs.search import run_search
from sweep.search.gradients import BACK_OFF
from sweep.search.problem import Problem, starting_points
from sweep.search.solver import extreme_value
from sweep.search.upper_bound import upper_bound_of
from sweep.study import load_study

from ..build import stopband_study
from ..search.problems import best_of
from .cases_chain import FIXED, GRID, PAIR, RED, WAVE, YELLOW, N, electrons_per_s, lights_of, lines, made
from .registry import EPS, Result, hard_case, outcome, worst

GAIN = float(electrons_per_s(1.0)) * 2e-3 * 0.4095
"""DN of a signal per QE."""
STEPS = N - 1
"""Widths of the range in steps: its ends have half a bin each."""
OPEN = 12
"""Nodes inside the band from 602.5 to 662.5 nm."""
X_TOLERANCE = 1e-9
"""Where the solvers stop, in units of the box."""
CURVES = np.random.default_rng(31).uniform(0.2, 0.6, (4, N))
CURVES[2] = 0.5
FIXED_PART = float(np.sum((CURVES[[0, 1, 3], YELLOW] - CURVES[[0, 1, 3], RED]) ** 2))


def depth_problem(constraints: dict[str, Bound], objective: str = "csd_yellow_red") -> Problem:
    """A wall from 602.5 to 662.5 nm over a red line, of any depth, in a flat filter of QE 1/2."""
    setup = made(CURVES, lights_of(PAIR, lines(YELLOW, RED)), FIXED, cfa="RYNC")
    low, high = (np.array([602.5, 0.0, 662.5, 0.0, depth]) for depth in (0.0, 1.0))
    family = Stopband(WAVE, CURVES[2], np.zeros(N))
    return Problem(setup, family, low, high, Objective(minimum={objective: 1.0}), constraints)


def csd_of(depth: float) -> float:
    return GAIN * math.sqrt(FIXED_PART + (0.5 * depth) ** 2)


HAIR = BACK_OFF + FEASIBLE
"""How far, relative to the bound, an answer may lie from a constraint that it meets."""


@hard_case("the optimum lies on the least sensitivity", slow=True)
def on_the_sensitivity() -> Result:
    """Closed form: all the light that may be given up is taken from the red line. Allowed: the answer keeps 1e-8 of the
    bound inside (1e-9 outside is feasible), where the solver stops adds 1e-9 of the box.
    """
    results = []
    for least in (0.8085, 0.9, 0.99, 0.9999):
        depth = (1 - least) * STEPS / OPEN
        # Where next to nothing may be taken, depth 0 is stationary: there the conservative two may stay.
        for algorithm in ("SLSQP", "MMA", "CCSAQ") if least < 0.999 else ("SLSQP",):
            best = best_of(depth_problem({"sensitivity": Bound(min=least)}), 4, 300, algorithm)
            room = HAIR * STEPS / OPEN + X_TOLERANCE
            slope = GAIN * 0.25 * depth / math.sqrt(FIXED_PART + (0.5 * depth) ** 2)
            results.append(
                (abs(best.objective - csd_of(depth)), slope * room + 0.25 * GAIN * room**2 + 16 * EPS * GAIN)
            )
            results.append((max(0.0, least - (1 - best.x[4] * OPEN / STEPS)), FEASIBLE * least + 16 * EPS))
    return worst(results)


@hard_case("only the unchanged filter is sensitive enough")
def nothing_to_give() -> Result:
    """Closed form: depth 0. Allowed: a depth within what counts as feasible, 1e-9, moves the CSD by its square."""
    best = best_of(depth_problem({"sensitivity": Bound(min=1.0)}), 4, 300)
    depth = FEASIBLE * STEPS / OPEN
    return Result(abs(best.objective - csd_of(0.0)), csd_of(depth) - csd_of(0.0) + 16 * EPS * GAIN)


@hard_case("the most sensitive filter lies on the least separation")
def on_the_separation() -> Result:
    """Closed form: the depth at which the CSD is just enough. Allowed: 1e-8 of the bound inside, 1e-9 outside; the
    solver stops within 1e-9 of the box.
    """
    results = []
    for depth in (0.25, 0.5, 0.9):
        least = csd_of(depth)
        best = best_of(depth_problem({"csd_yellow_red": Bound(min=least)}, "sensitivity"), 4, 300)
        slope = GAIN * 0.25 * depth / math.sqrt(FIXED_PART + (0.5 * depth) ** 2)
        room = (HAIR * least / slope + X_TOLERANCE) * OPEN / STEPS
        results.append((abs(best.objective - (1 - depth * OPEN / STEPS)), 1.01 * room + 16 * EPS))
    return worst(results)


def rise(wave: np.ndarray, center: float, width: float) -> np.ndarray:
    """The families' edge, written out: 10 t^3 - 15 t^4 + 6 t^5 over 1 / (1 - 2 x 0.2466...) of its 10-90 % width."""
    tenth = brentq(lambda t: 10 * t**3 - 15 * t**4 + 6 * t**5 - 0.1, 0.2, 0.3, xtol=1e-16)
    t = np.clip((wave - center) * (1 - 2 * tenth) / width + 0.5, 0, 1)
    return t**3 * (10 - 15 * t + 6 * t**2)


@hard_case("an edge is as far left as the sensitivity allows")
def edge_on_the_constraint() -> Result:
    """2,001 edges by brute force, and the root of the sensitivity by bisection. Allowed: CSD per nm over sensitivity
    per nm, times 1.1e-8; 1e-9 of the box; rounding of sums of 61 terms.
    """
    led = np.exp(-0.5 * ((WAVE - np.array([[592.0], [637.0]])) / 9) ** 2)
    photons = led / led.sum(axis=1, keepdims=True) / GRID.step_nm
    setup = made(CURVES, lights_of(PAIR, photons), FIXED, cfa="RYNC")
    low, high = (np.array([left, 20.0, 680.0, 10.0, 1.0]) for left in (570.0, 660.0))
    family = Stopband(WAVE, CURVES[2], np.full(N, 0.05))

    def n_of(left: float) -> np.ndarray:
        return 0.5 - 0.45 * (rise(WAVE, left, 20.0) - rise(WAVE, 680.0, 10.0))

    def csd(left: float) -> float:
        curves = np.stack([*CURVES[[0, 1, 3]], n_of(left)])
        return GAIN * float(np.linalg.norm(curves @ ((photons[0] - photons[1]) * GRID.step_nm)))

    def light(left: float) -> float:
        return float(trapezoid(n_of(left)) / (0.5 * STEPS))

    least = 0.9
    at = brentq(lambda left: light(left) - least, 570.0, 660.0, xtol=1e-12)
    allowed_edges = np.linspace(at, 660.0, 2001)
    exact = csd(at)
    assert max(csd(float(left)) for left in allowed_edges) <= exact  # the constraint is active
    problem = Problem(
        setup, family, low, high, Objective(minimum={"csd_yellow_red": 1.0}), {"sensitivity": Bound(min=least)}
    )
    best = best_of(problem, 4, 300)
    per_nm = abs(csd(at + 1e-4) - csd(at - 1e-4)) / 2e-4
    light_per_nm = abs(light(at + 1e-4) - light(at - 1e-4)) / 2e-4
    room = HAIR * least / light_per_nm + X_TOLERANCE * 90
    return Result(abs(best.objective - exact), 1.01 * per_nm * room + 200 * EPS * GAIN)


@hard_case("the limit of two lines on the least sensitivity")
def limit_of_two_lines() -> Result:
    """Closed form: light is taken from one line alone, until none is left. Allowed: the bracket's stated width, 1e-3
    DN; what is attained is never above the closed form but by what is feasible, 1e-9.
    """
    results = []
    for nodes in (0.25, 0.5, 0.875, 1.0, 5.0):
        least = 1 - nodes / STEPS
        found = upper_bound_of(depth_problem({"sensitivity": Bound(min=least)}))
        exact = csd_of(min(nodes, 1.0))
        results.append((max(0.0, exact - found.attained, found.proven - exact), 1e-3 + 1e-6))
        results.append((max(0.0, exact - found.proven), 1e-6))
        results.append((max(0.0, found.attained - exact), GAIN * FEASIBLE * N))
    return worst(results)


@hard_case("the best value of a constraint that is out of reach", slow=True)
def best_values() -> Result:
    """Closed form at the corner of the box. Allowed: linear in depth, or growing with it, so the solver ends on the
    box's side: 1e-9 of the box and 16 roundings.
    """
    shallow = replace(depth_problem({}), low=np.array([602.5, 0.0, 662.5, 0.0, 0.3]))
    results = []
    for name, bound, exact in (
        ("sensitivity", Bound(min=0.99), 1 - 0.3 * OPEN / STEPS),
        ("sensitivity", Bound(max=0.1), 1 - OPEN / STEPS),
        ("csd_yellow_red", Bound(min=1e4), csd_of(1.0)),
        ("min_transmission", Bound(min=0.9), 0.7),
    ):
        problem = replace(shallow, constraints={name: bound})
        found = extreme_value(problem, name, starting_points(problem, 4, 1), 200)
        assert best_of(problem, 4, 100) is None
        results.append((abs(found / exact - 1), 2 * X_TOLERANCE + 16 * EPS))
    return worst(results)


STUDY = stopband_study(
    "impossible",
    "{left_nm: [590, 605], left_width_nm: 10, right_nm: [650, 670], right_width_nm: 10}",
    cfas="[RYNCy]",
    after="""\
constraints:
  sensitivity: {min: 0.99}
  csd_yellow_red: {min: 1.0e+5}
search: {starts: 4, max_evaluations: 200}
""",
)


@hard_case("a study that no design meets")
def infeasible_study() -> Result:
    """The narrowest band of the box, written out. Allowed: printed with 6 digits: half a unit of the last; both
    constraints are named.
    """
    with TemporaryDirectory() as name:
        path = Path(name) / "s.yaml"
        path.write_text(STUDY)
        study = load_study(path)
    y, g, wave = study.sensor.qe["Y"], study.sensor.qe["G"], study.grid.nodes_nm
    shape = rise(wave, 605.0, 10.0) - rise(wave, 650.0, 10.0)
    exact = float(1 - trapezoid((y - g) * shape) / trapezoid(y))
    try:
        run_search(
            study, study.search, rules_of(study), lambda tasks: (call(*a, **k) for call, a, k in tasks), lambda *_: None
        )
    except InfeasibleError as error:
        text = str(error)
    else:
        return outcome(False)
    found = re.search(r"out of reach: sensitivity >= 0.99; the best value found is ([0-9.]+)", text)
    named = "out of reach: csd_yellow_red >= 100000" in text and "no feasible design" in text
    return Result(abs(float(found[1]) - exact) if found and named else math.inf, 0.5e-6 + 2 * X_TOLERANCE)
