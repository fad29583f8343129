"""Sweeps that are no grid: listed designs, in the study or in a file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from sweep.runs.provenance import resolved_yaml
from sweep.study import Study, load_study

from ..build import load, one_line, stopband_study

NAMES = ["right_nm", "left_nm", "left_width_nm", "right_width_nm"]
DESIGNS = [[650, 600, 10, 5], [660, 610, 10, 5], [670, 620.5, 10, 5]]


def written(folder: Path, keys: str, before: str = "wavelengths: {step_nm: 5}\n") -> Path:
    """A study whose sweep has these keys in place of a grid."""
    path = folder / "drawn.yaml"
    path.write_text(stopband_study("drawn", "GRID", before).replace("    grid: GRID", f"    {keys}"))
    return path


def points(study: Study) -> np.ndarray:
    space = next(space for space in study.spaces if space.kind == "sweep")
    every = space.points(0, space.size)
    np.testing.assert_array_equal(space.points(1, space.size), every[1:])
    return every


def test_listed_designs_are_taken_one_by_one_also_from_a_file(tmp_path: Path) -> None:
    expected = [[left, left_width, right, right_width, 1] for right, left, left_width, right_width in DESIGNS]
    designs = ", ".join(str(dict(zip(NAMES, design, strict=True))).replace("'", "") for design in DESIGNS)
    np.testing.assert_array_equal(points(load_study(written(tmp_path, f"values: [{designs}]"))), expected)
    pd.DataFrame(DESIGNS, columns=NAMES).to_csv(tmp_path / "drawn.csv", index=False)
    of_file = load_study(written(tmp_path, "values: drawn.csv"))
    np.testing.assert_array_equal(points(of_file), expected)
    assert set(of_file.digests) == {"drawn.csv"}
    (tmp_path / "drawn.csv").unlink()  # a run keeps the designs
    np.testing.assert_array_equal(points(load(tmp_path, resolved_yaml(of_file))), expected)


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ("values: []", "yaml:12: sweeps.edges.values: too few entries (got 0)"),
        ("values: [{left_nm: 600}, {right_nm: 5}]", "design 2 names other parameters"),
        ("values: none.csv", "yaml:12: sweeps.edges.values: no such file"),
        ("values: words.csv", "yaml:12: sweeps.edges.values: words.csv: could not convert string to float"),
        ("values: gaps.csv", "gaps.csv: designs that cannot be used (got 2); allowed: 1 to 10,000 designs"),
        ("technology: pigment", "one of `grid` and `values`; there is none of them"),
        ("values: [{left_nm: 3, left_width_nm: 1, right_nm: 650, right_width_nm: 1}]", "out of range (got 3.0)"),
    ],
)
def test_invalid_sweep_is_one_line(tmp_path: Path, keys: str, said: str) -> None:
    (tmp_path / "words.csv").write_text("left_nm,right_nm\n600,x\n")
    (tmp_path / "gaps.csv").write_text("left_nm,right_nm\n600,650\n610,\n")
    with one_line(said, alone=False):
        load_study(written(tmp_path, keys))
