"""CTA: only where a study asks, and what it does not see."""

from __future__ import annotations

import numpy as np

from sweep.camera.model import SceneModel
from sweep.metrics.columns.probabilities import detection
from sweep.metrics.evaluate import evaluate

from ..hard.scenes import scene


def test_contrasts_that_are_none_or_have_no_noise_or_no_light() -> None:
    first, second = np.array([0]), np.array([1])

    def of(one: float, other: float, variance: float) -> float:
        return float(detection(np.array([[[one], [other]]]), np.full((1, 2, 1), variance), first, second)[0])

    assert of(100, 100, 4) == 0  # no contrast
    assert of(100, 50, 0) == 1  # no noise
    assert 0 <= of(100, 0, 4) < 1e-6  # any contrast may be measured
    assert of(50, 100, 4) == of(100, 50, 4)


def test_cta_is_a_column_only_where_a_study_asks() -> None:
    """In a bright scene it is near 1."""
    made = scene("bright", "RYNCy", {"noise": True}, {"read_noise_e": 10, "prnu": 0.01, "offset_dn": 168})
    model = SceneModel(made.setup)
    assert "cta_yellow_red" not in evaluate(model, made.curves, ("yellow", "red"))
    assert 0.995 < evaluate(model, made.curves, ("yellow", "red"), probabilities=True)["cta_yellow_red"][0] <= 1
