"""CTA: contrasts that it does not see."""

from __future__ import annotations

import numpy as np

from sweep.metrics.columns.probabilities import detection


def test_contrasts_that_are_none_or_have_no_noise_or_no_light() -> None:
    first, second = np.array([0]), np.array([1])

    def of(one: float, other: float, variance: float) -> float:
        return float(detection(np.array([[[one], [other]]]), np.full((1, 2, 1), variance), first, second)[0])

    assert of(100, 100, 4) == 0  # no contrast
    assert of(100, 50, 0) == 1  # no noise
    assert 0 <= of(100, 0, 4) < 1e-6  # any contrast may be measured
    assert of(50, 100, 4) == of(100, 50, 4)
