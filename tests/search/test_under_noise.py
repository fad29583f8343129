"""A search for errors under noise: exact derivatives in any scene, and designs that confuse lights less."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sweep.camera.accuracy import Accuracy
from sweep.camera.linear import linear_model
from sweep.camera.model import SceneModel
from sweep.camera.noise.law import STEPS_DN2
from sweep.designs.families.dual import Dual
from sweep.designs.families.free_form import FreeForm
from sweep.designs.families.mixture import AbsorptionBands, Mixture
from sweep.designs.families.stopband import MultiStopband
from sweep.designs.family import Family
from sweep.designs.registry import FAMILIES as REGISTERED
from sweep.metrics.bound import Bound
from sweep.metrics.evaluate import evaluate
from sweep.metrics.objective import Objective
from sweep.metrics.quantity import RequestedQuantities
from sweep.metrics.registry import quantities_of
from sweep.metrics.smooth import Rows, SmoothDesign
from sweep.spectra.colorants import modeled_colorants
from sweep.study import load_study

from ..build import one_line
from ..hard.random_scenes import random_scene
from ..hard.scenes import FAMILY, GRID, SENSOR
from .problems import STATES, best_of, noisy_problem

FAMILIES: tuple[Family, ...] = (
    FAMILY,
    MultiStopband(GRID.nodes_nm, SENSOR.qe["Y"], SENSOR.qe["G"], 2),
    FreeForm(GRID.nodes_nm, SENSOR.qe["Y"], np.array([500.0, 560.0, 600.0, 620.0, 650.0, 690.0])),
    Dual(GRID.nodes_nm, SENSOR.qe["Y"], SENSOR.qe["C"]),
    AbsorptionBands(GRID.nodes_nm, SENSOR.qe["Y"], 1),
    Mixture(GRID.nodes_nm, SENSOR.qe["Y"], modeled_colorants(GRID).absorbance[15:20], 2),
)
NOISY = [q for q in quantities_of(RequestedQuantities(STATES, STATES)).values() if q.states]


def family_of(seed: int, n_modified: int) -> tuple[Family, np.ndarray, np.ndarray]:
    """A family with so many modified channels, and one of its designs with the span of each parameter."""
    rng = np.random.default_rng([seed, 23])
    able = [family for family in FAMILIES if family.n_modified == n_modified]
    family = able[seed % len(able)]
    if isinstance(family, FreeForm):
        return family, rng.uniform(0.2, 1.0, 6), np.ones(6)
    if isinstance(family, AbsorptionBands):
        span = np.array([60.0, 30.0, 1.0, 0.2])
        return family, np.array([570.0, 25.0, 0.3, 0.01]) + rng.uniform(0, 1, 4) * span, span
    if isinstance(family, Mixture):
        span = np.array([0.0, 1.0, 0.0, 1.0, 0.2])  # no derivative by the number of a colorant
        return family, np.array([2.0, 0.2, 3.0, 0.2, 0.7]) + rng.uniform(0, 1, 5) * span, span
    bands = len(family.parameters) // 5
    middle = np.repeat(np.arange(bands), 5) * np.tile([85.0, 0, 85, 0, 0], bands)
    x = np.tile([500.0, 12.0, 545.0, 15.0, 0.7], bands) + middle
    x = x + rng.uniform(-1, 1, x.size) * np.tile([12.0, 5, 12, 5, 0.25], bands)
    return family, x, np.tile([30.0, 10, 30, 10, 0.5], bands)


def searchable(seed: int) -> bool:
    """Whether a scene has a filter to search, and no pulses under an exposure that the filter sets (they are refused)."""
    setup = random_scene(seed).setup
    return bool(setup.camera.modified) and (setup.scene.drive is None or setup.scene.exposure.kind == "fixed")


def differences_off(seed: int) -> float:
    """By how much a derivative of any quantity differs from differences, over 1e-6 of the largest of its row.

    Central differences, extrapolated (Richardson), which leaves the fourth order of the step. Their rounding, over the
    step and three times by the extrapolation: that of a mean, in units of the noise, moves d' by as much, and so d'^2 and the decades by 2 d' times that. On
    brightness curves a mean is anything up to full scale. Left out: rows whose differences do not converge, where the
    nearest point of a curve jumps, and chromatic ones of noiseless scenes, whose nearest point may be a moving knee.
    """
    made = random_scene(seed)
    family, x, span = family_of(seed, len(made.setup.camera.modified))
    # A lattice of pixels: more places take long, and are computed alike.
    setup = replace(made.setup, accuracy=Accuracy(phases_per_px=1))
    imager, free = linear_model(setup), np.arange(x.size)

    def rows(at: np.ndarray, free: np.ndarray = free[:1]) -> list[Rows]:
        design = SmoothDesign(imager, family, at, free, span[free])
        return [
            q.smooth(design)
            for q in NOISY
            if q.smooth is not None and not (setup.scene.noise is None and q.name.startswith("chromatic_"))
        ]

    design = SmoothDesign(imager, family, x, free, span)
    largest_dn = max(float(np.abs(design.response).max()), setup.camera.pixel.full_scale_dn)
    rounding = 6 * np.finfo(float).eps * largest_dn / np.sqrt(min(float(design.noisy[1].min()), STEPS_DN2))
    own, worst, step = rows(x, free), 0.0, 2e-4
    for k, unit in enumerate(np.eye(x.size) * span):
        ends = [rows(x + sign * share * step * unit) for share in (1, 0.5) for sign in (1, -1)]
        for n, exact in enumerate(own):
            wide, near = ((ends[2 * i][n].values - ends[2 * i + 1][n].values) / (2 * step / (i + 1)) for i in (0, 1))
            off = 2 * (np.sqrt(np.abs(exact.values)) + 1) * rounding + 4 * np.finfo(float).eps * np.abs(exact.values)
            allowed = 1e-6 * np.abs(exact.by_u).max(axis=1) + off / step
            converged = np.abs(near - wide) <= 1e-3 * np.abs(exact.by_u).max(axis=1) + off / step
            apart = np.abs(exact.by_u[:, k] - (4 * near - wide) / 3)[converged] / allowed[converged]
            worst = max(worst, float(apart.max(initial=0.0)))
    return worst


@pytest.mark.parametrize("seed", [1, 5, 9, 26])
def test_derivatives_agree_with_differences_in_scenes(seed: int) -> None:
    assert searchable(seed)
    assert differences_off(seed) <= 1


@pytest.mark.slow
@pytest.mark.long
def test_derivatives_agree_with_differences_in_100_scenes() -> None:
    seeds = [seed for seed in range(420) if searchable(seed)][:100]
    assert len(seeds) == 100
    assert {family_of(seed, len(random_scene(seed).setup.camera.modified))[0].kind for seed in seeds} == set(REGISTERED)
    assert {seed: off for seed in seeds if (off := differences_off(seed)) > 1} == {}


def test_error_constraints_are_met() -> None:
    bounds = {"error_green_red": Bound(max=1e-4), "dprime_yellow_red": Bound(min=5.0), "sensitivity": Bound(min=0.8)}
    problem = replace(
        noisy_problem("stopband", 30, 0.3, Objective(minimum={"cfa_sensitivity": 1.0})), constraints=bounds
    )
    best = best_of(problem, 2, 120)
    curves = problem.family.curves(best.x[None])
    found = evaluate(SceneModel(problem.setup.with_all_effects), curves, STATES)
    assert found["dprime_yellow_red"][0] == pytest.approx(5.0, rel=2e-3)  # light is bought with distance
    assert found["error_green_red"][0] <= 1e-4


@pytest.mark.parametrize(
    ("told", "issue"),
    [
        (
            "objective: error_yellow_red",
            "less of error_yellow_red is better; allowed: `{least: {error_yellow_red: 1}}`",
        ),
        (
            "objective: {least: {dprime_yellow_red: 1}}",
            "more of dprime_yellow_red is better; allowed: `minimum` or `sum`",
        ),
        ("constraints: {state_error: {max: 0}}", "no such error is computed (got 0.0); allowed: 1e-12 to 1"),
        ("constraints: {dprime_yellow_red: {max: 2}}", "dprime_yellow_red has no `max`"),
    ],
)
def test_invalid_error_constraint_is_one_line(told: str, issue: str, tmp_path: Path) -> None:
    start = "study: x\nsensor: ar0820\nlights: tl16\ncfas: [RGGB]\nscenarios: {s: {noise: true}}\nrecognition: {}\n"
    file = tmp_path / "x.yaml"
    file.write_text(f"{start}{told}\n")
    with one_line(issue):
        load_study(file)
