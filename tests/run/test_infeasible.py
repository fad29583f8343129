"""A sweep in which no design meets the constraints: what it says, and how it ends."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from ..commanded import commanded

TEXT = """\
study: none
sensor: ar0820
lights: tl16
cfas: [RGGB, RYNCy]
sweeps:
  edges: {cfa: RYNCy, channel: N, base: Y, to: G, grid: {left_nm: [600, 610, 620], left_width_nm: 5, right_nm: [650, 660], right_width_nm: 5}}
constraints: {sensitivity: {min: 0.90}, csd_yellow_red: {min: 300}}
"""


def test_a_sweep_without_a_feasible_design_ends_with_3_and_names_the_nearest(tmp_path: Path) -> None:
    (tmp_path / "none.yaml").write_text(TEXT)
    code, said, complaint = commanded("run", tmp_path / "none.yaml", "--output", tmp_path, "--jobs", 1)
    assert (code, "no design meets every constraint" in complaint) == (3, True)
    rows = pd.read_parquet(tmp_path / "none" / "results.parquet")
    swept = rows[rows["kind"] == "sweep"]
    nearest = swept.sort_values("violation", kind="stable").iloc[0]
    assert f"The nearest is filter {nearest['filter_id']}" in " ".join(said.split()).replace("\u00a0", " ")
