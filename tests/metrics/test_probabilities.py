"""CTA: only where a study asks, and what it does not see."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sweep.camera.model import SceneModel
from sweep.camera.pixel import Pixel
from sweep.camera.scene import Scene
from sweep.metrics.columns.probabilities import detection
from sweep.metrics.evaluate import evaluate
from sweep.study import load_study

from ..conftest import STUDIES

TWO = np.array([[612.89, 5.92, 651.18, 6.25, 1.0], [600.0, 20.0, 660.0, 20.0, 0.7]])
"""A stopband that separates well, and one of about half its d'."""


def test_cta_is_near_one_where_d_prime_still_differs() -> None:
    """In a bright scene it is near 1 for filters whose d' differs by more than 1.8 times."""
    study = load_study(STUDIES / "stopband.yaml")
    assert study.search is not None
    problem = study.problem(study.search)
    scenario = Scene.model_validate({"noise": True})
    pixel = Pixel(read_noise_e=10, prnu=0.01, offset_dn=168)
    model = SceneModel(replace(problem.setup, scene=scenario).with_camera(pixel=pixel))
    curves = problem.family.curves(TWO)
    assert "cta_yellow_red" not in evaluate(model, curves, ("yellow", "red"))
    found = evaluate(model, curves, ("yellow", "red"), probabilities=True)
    good, poor = found["dprime_yellow_red"]
    assert good > 1.8 * poor
    assert (found["cta_yellow_red"] > 0.995).all()
    assert not any(name.startswith("csp") for name in found)


def test_contrasts_that_are_none_or_have_no_noise_or_no_light() -> None:
    first, second = np.array([0]), np.array([1])

    def of(one: float, other: float, variance: float) -> float:
        return float(detection(np.array([[[one], [other]]]), np.full((1, 2, 1), variance), first, second)[0])

    assert of(100, 100, 4) == 0  # no contrast
    assert of(100, 50, 0) == 1  # no noise
    assert 0 <= of(100, 0, 4) < 1e-6  # any contrast may be measured
    assert of(50, 100, 4) == of(100, 50, 4)
