"""The generalization gap and its interval."""

from __future__ import annotations

import numpy as np

from sweep.report.sections.left_out import generalization_gap


def test_the_interval_of_the_gap_holds_the_mean_as_often_as_it_says() -> None:
    rng = np.random.default_rng(1)
    found = [generalization_gap(rng.exponential(10.0, 40), seed) for seed in range(200)]
    held = np.mean([low <= 10 <= high for _, low, high in found])
    assert 0.87 <= held <= 0.99  # 0.95 for many lights; a little less for few and a skewed distribution


def test_a_gap_of_equal_falls_has_no_width() -> None:
    falls = np.array([0.0, 0.0, 3.0, 12.0, 1.0])
    assert generalization_gap(np.full(7, 2.5), 1) == (2.5, 2.5, 2.5)
    mean, low, high = generalization_gap(falls, 3)
    assert 0 <= low < mean == falls.mean() < high <= falls.max()
