"""Separations over the image height beside those of scenes that have one chief ray angle."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ...build import output_of

STUDY = """\
study: map
sensor: ar0820
lights: tl16
pixel: {bits: 24}
scenarios:
SCENES
cfas: [RGGB, RYNCy]
designs:
  layers:
    {cfa: RYNCy, channel: N, base: Y, to: G, technology: {interference: {effective_index: 1.8}},
     at: {left_nm: 606, left_width_nm: 36, right_nm: 646, right_width_nm: 7}}
"""


@pytest.mark.usefixtures("plain_pictures")
def test_a_height_has_the_separation_of_its_angle(tmp_path: Path) -> None:
    map_of = output_of(tmp_path, STUDY.replace("SCENES", "  field: {field: {cra_max_deg: 25, places: any}}"))
    table = map_of.tables["sensor_map.parquet"].set_index(["design_id", "height"])["csd_yellow_red"]
    angles = {0.0: 0, 0.4: 10, 1.0: 25}
    scenes = "\n".join(f"  at {angle}: {{optics: {{cra_deg: {angle}}}}}" for angle in angles.values())
    (tmp_path / "angles").mkdir()
    rows = output_of(tmp_path / "angles", STUDY.replace("SCENES", scenes)).named_rows.set_index(["name", "scenario"])
    for design_id, name in map_of.named_rows[["design_id", "name"]].itertuples(index=False):
        found = [table[design_id, height] for height in angles]
        expected = [rows.loc[(name, f"at {angle}"), "csd_yellow_red"] for angle in angles.values()]
        np.testing.assert_allclose(found, expected, rtol=1e-5)
        assert (np.ptp(expected) > 1) == (name == "layers")
