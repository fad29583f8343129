"""Searches of the studies of the project under noise."""

from __future__ import annotations

from dataclasses import replace

from sweep.camera.pixel import Pixel
from sweep.camera.scene import Scene
from sweep.metrics.objective import Objective
from sweep.search.problem import Evaluation, Problem, best_feasible, starting_points
from sweep.search.solver import search_from
from sweep.study import load_study

from ..conftest import STUDIES

STATES = ("green", "yellow", "red")


def problem_of(name: str, read_noise_e: float, level: float, objective: Objective) -> Problem:
    """The search of a study of the project, of a chart under noise."""
    study = load_study(STUDIES / f"{name}.yaml")
    assert study.search is not None
    problem = study.problem(study.search)
    scenario = Scene.model_validate({"noise": True, "exposure": {"kind": "white_patch", "level": level}})
    pixel = Pixel(read_noise_e=read_noise_e, prnu=0.01, offset_dn=168)
    setup = replace(problem.setup, scene=scenario).with_camera(pixel=pixel)
    return replace(problem, setup=setup, states=STATES, objective=objective)


def searched(problem: Problem, starts: int = 2, algorithm: str = "SLSQP") -> Evaluation:
    points = starting_points(problem, starts, 1)
    found = best_feasible([e for i, u in enumerate(points) for e in search_from(problem, i, u, algorithm, 120).log])
    assert found is not None
    return found
