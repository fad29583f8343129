"""Sweeps that are no grid: drawn, paired and listed designs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.stats import qmc

from sweep.study import load_study

from ..build import one_line, stopband_study

BOX = "{left_nm: {min: 560, max: 620}, left_width_nm: 10, right_nm: {min: 630, max: 690}, right_width_nm: {min: 5, max: 25}}"
LOW, HIGH = np.array([560.0, 630.0, 5.0]), np.array([620.0, 690.0, 25.0])


def written(folder: Path, keys: str, before: str = "wavelengths: {step_nm: 5}\n") -> Path:
    """A study whose sweep has these keys in place of a grid."""
    path = folder / "drawn.yaml"
    path.write_text(stopband_study("drawn", "GRID", before).replace("    grid: GRID", f"    {keys}"))
    return path


def points(folder: Path, keys: str, before: str = "") -> np.ndarray:
    space = next(space for space in load_study(written(folder, keys, before)).spaces if space.kind == "sweep")
    return space.points(0, space.size)


@pytest.mark.parametrize("method", ["sobol", "lhs"])
def test_a_design_depends_on_its_number_and_the_seed_alone(tmp_path: Path, method: str) -> None:
    keys = f"{method}: 1000\n    box: {BOX}"
    space = next(space for space in load_study(written(tmp_path, keys)).spaces if space.kind == "sweep")
    every = space.points(0, 1000)
    assert np.unique(every, axis=0).shape == (1000, 5)
    for start, stop in ((0, 1), (333, 600), (999, 1000)):
        np.testing.assert_array_equal(space.points(start, stop), every[start:stop])
    np.testing.assert_array_equal(points(tmp_path, keys), every)
    assert (points(tmp_path, keys, "seed: 2\n") != every).any()
    assert (every[:, [1, 4]] == [10, 1]).all()
    shares = (every[:, [0, 2, 3]] - LOW) / (HIGH - LOW)
    assert 0 <= shares.min() <= shares.max() <= 1
    random = np.random.default_rng(0).random(shares.shape)
    assert qmc.discrepancy(shares) < qmc.discrepancy(random)
    if method == "lhs":
        np.testing.assert_array_equal(np.sort(np.floor(shares * 1000), axis=0), np.arange(1000)[:, None].repeat(3, 1))
    else:
        np.testing.assert_array_equal(points(tmp_path, f"sobol: 100\n    box: {BOX}"), every[:100])


def test_zip_and_list_take_values_together(tmp_path: Path) -> None:
    paired = points(
        tmp_path,
        "zip: {left_nm: [600, 610, 620], right_nm: {min: 650, max: 670, count: 3}, left_width_nm: 10, right_width_nm: 5}",
    )
    expected = [[600, 10, 650, 5, 1], [610, 10, 660, 5, 1], [620, 10, 670, 5, 1]]
    np.testing.assert_array_equal(paired, expected)
    designs = ", ".join(
        f"{{right_nm: {right}, left_nm: {left}, left_width_nm: 10, right_width_nm: 5}}"
        for left, _, right, _, _ in expected
    )
    np.testing.assert_array_equal(points(tmp_path, f"list: [{designs}]"), expected)


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ("sobol: 10", "yaml:7: sweeps.edges: `box` goes with"),
        (f"box: {BOX}", "one of `grid`, `sobol`, `lhs`, `zip`, `list`; there is none"),
        (f"sobol: 0\n    box: {BOX}", "yaml:12: sweeps.edges.sobol: not allowed (got 0)"),
        ("zip: {left_nm: [1, 2], right_nm: [1, 2, 3]}", "left_nm 2, right_nm 3"),
        ("list: []", "list: one design or more"),
        ("list: [{left_nm: 600}, {right_nm: 5}]", "design 2 names other parameters"),
        ("sobol: 4\n    box: {left_nm: {min: 3, max: 4}}", "yaml:13: sweeps.edges.box.left_nm: out of range (got 3.0)"),
    ],
)
def test_invalid_sweep_is_one_line(tmp_path: Path, keys: str, said: str) -> None:
    with one_line(said, alone=False):
        load_study(written(tmp_path, keys))
