"""Up to where designs are usable: between which scenarios that is looked for, and what is found there."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import sweep
from sweep.metrics.columns.confusion import STATE_ERROR
from sweep.runs.crossings import crossings_of

from ..build import output_of

STUDY = """
study: noisy
sensor: ar0820
lights: tl16
pixel: {read_noise_e: 2}
scenarios:
  SCENES
cfas: [RGGB]
recognition: {states: [yellow, red], error_max: 1.0e-3}
"""
LEVEL = "noise: true, exposure: {kind: white_patch, level: %s}"


def crossings(folder: Path, *scenes: str) -> pd.DataFrame:
    output = output_of(folder, STUDY.replace("SCENES", "\n  ".join(scenes)))
    return pd.read_parquet(output.folder / "crossings.parquet")


def test_where_an_allowed_error_ends_the_error_is_the_allowed_one(tmp_path: Path) -> None:
    scenes = "dim: {noise: true, exposure: {kind: white_patch}, each: {exposure.level: [0.5, 0.02]}}"
    found = crossings(tmp_path, scenes).set_index("quantity")
    assert (found["rises"] == False).all()  # noqa: E712  (less light has more errors)
    for quantity, row in found.iterrows():
        assert row["error"] == pytest.approx(1e-3, rel=0.05)
        alone = STUDY.replace("SCENES", f"there: {{{LEVEL % row['at']}}}")
        path = tmp_path / "there.yaml"
        path.write_text(alone)
        column = {"state_error": STATE_ERROR, "chromatic_error": "chromatic_error_yellow_red"}[str(quantity)]
        assert sweep.load_study(path).evaluate()[column].iloc[0] == pytest.approx(row["error"], rel=1e-6)


def test_an_error_that_comes_back_between_two_numbers_is_found() -> None:
    """Two of its ends are between neighboring numbers at which the error is allowed."""

    def error(number: float) -> float:
        return 1e-3 * 10 ** (1 - ((np.log(number) - np.log(3.0)) / 0.2) ** 2)

    known = {number: error(number) for number in (1.0, 2.4, 3.8, 10.0)}
    assert max(known.values()) < 1e-3
    found = crossings_of(error, known, 1e-3)
    assert [row["rises"] for row in found] == [True, False]
    assert [row["at"] for row in found] == pytest.approx([3 * np.exp(-0.2), 3 * np.exp(0.2)], rel=2e-3)


def test_nothing_is_looked_for_between_whole_numbers(tmp_path: Path) -> None:
    assert crossings(tmp_path, f"dim: {{{LEVEL % 0.5}, each: {{pixel.bits: [4, 12]}}}}").empty


def test_designs_change_places_where_both_have_the_same_separation(tmp_path: Path) -> None:
    """A distance between two computed ones, with all phases of the mosaic."""
    text = """
study: far
sensor: ar0820
lights: tl16
pixel: {read_noise_e: 2, offset_dn: 168, crosstalk: 0.01}
scenarios:
  road: {target: {fov_deg: 60, phase_px: any}, optics: {f_number: 2}, noise: true, each: {target.distance_m: [270, 300]}}
cfas: [RGGB, RYNCy]
designs:
  mine: {cfa: RYNCy, channel: N, base: Y, to: G, at: {left_nm: 612.89, left_width_nm: 5.92, right_nm: 651.18, right_width_nm: 6.25}}
"""
    output = output_of(tmp_path, text)
    (row,) = pd.read_parquet(output.folder / "crossings.parquet").to_dict("records")
    assert (row["name"], row["against"], row["quantity"], row["rises"]) == ("RGGB", "mine", "csd_yellow_red", True)
    assert row["at"] == pytest.approx(284, rel=5e-3)
    (tmp_path / "there.yaml").write_text(text.replace("[270, 300]", f"[{row['at']}]"))
    there = sweep.load_study(tmp_path / "there.yaml").evaluate()
    assert there.csd_yellow_red.to_numpy() == pytest.approx(row["value"], rel=2e-3)
