"""Search problems of the project's studies, searches from several starts, and random filters of any family."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.integrate import trapezoid

from sweep.camera.pixel import Pixel
from sweep.camera.scene import Scene
from sweep.camera.setup import Setup
from sweep.metrics.objective import Objective
from sweep.metrics.separation import separation
from sweep.metrics.smooth import smooth_response
from sweep.search.gradients import Model
from sweep.search.problem import Evaluation, Problem, SearchRun, best_feasible, starting_points
from sweep.search.solver import search_from
from sweep.study import load_study

from ..conftest import STUDIES

STATES = ("green", "yellow", "red")
YELLOW_RED = ("yellow", "red")
STUDY = load_study(STUDIES / "stopband.yaml")
PROBLEM = STUDY.problem(STUDY.search)
"""The search of the study `stopband`."""


def problem_of(name: str) -> Problem:
    """The search of a study of the project."""
    study = load_study(STUDIES / f"{name}.yaml")
    return study.problem(study.search)


def noisy_problem(name: str, read_noise_e: float, level: float, objective: Objective) -> Problem:
    """The search of a study of the project, of a chart under noise."""
    problem = problem_of(name)
    scene = Scene.model_validate({"noise": True, "exposure": {"kind": "white_patch", "level": level}})
    pixel = Pixel(read_noise_e=read_noise_e, prnu=0.01, offset_dn=168)
    setup = replace(problem.setup, scene=scene).with_camera(pixel=pixel)
    return replace(problem, setup=setup, states=STATES, objective=objective)


def best_of(problem: Problem, starts: int, evaluations: int, algorithm: str = "SLSQP") -> Evaluation | None:
    """The best feasible design of searches from several starting points, each of so many evaluations."""
    points = starting_points(problem, starts, 1)
    return best_feasible(
        [e for i, u in enumerate(points) for e in search_from(problem, i, u, algorithm, evaluations).log]
    )


def best_random(problem: Problem, count: int) -> Evaluation | None:
    """The best feasible of random designs of the box."""
    run = SearchRun(0)
    model = Model(problem, run, count + 1)
    for u in np.random.default_rng(8).uniform(size=(count, problem.free.size)):
        model.at(u)
    return best_feasible(run.log)


def rows_at(problem: Problem, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """All rows of the smooth model, terms before conditions, and their derivatives."""
    point = Model(problem, SearchRun(0), 1).at(u)
    return (
        np.concatenate([point.terms.values, point.conditions.values]),
        np.vstack([point.terms.by_u, point.conditions.by_u]),
    )


def csd_of(setup: Setup, curves: np.ndarray, pair: tuple[str, str] = YELLOW_RED) -> np.ndarray:
    """CSD of each filter by the smooth response at the first phase, ndarray[n_designs], DN."""
    return separation(smooth_response(setup, curves)[:, 0], *(setup.members[name] for name in pair))


def filters(problem: Problem, n: int) -> np.ndarray:
    """Random filters below the base with at least nine tenths of its sensitivity: smooth, steps, and deep bands."""
    base, rng = problem.setup.camera.base_qe[0], np.random.default_rng(5)
    found = [base]
    while len(found) < n:
        share = np.ones(base.size)
        for _ in range(rng.integers(1, 4)):
            start = rng.integers(0, base.size)
            share[start : start + rng.integers(1, 60)] = rng.uniform(0, 1)
        if trapezoid(share * base) / trapezoid(base) >= 0.9:
            found.append(share * base)
    return np.array(found)
