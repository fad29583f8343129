"""Maps over the sensor: each value is that of a scene of its own, and a study without places of the sensor has none."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from sweep.metrics.smooth import smooth_csd
from sweep.report import read_output
from sweep.report.sensor_map import map_drawings, sensor_figures
from sweep.study import load_study

from ..commanded import commanded

LAYERS = "technology: {interference: {effective_index: 1.8}}"
MADE = f"cfa: RYNCy, channel: N, base: Y, to: G, {LAYERS}, at: {{left_width_nm: 6, right_width_nm: 6"
TINY = f"""
study: tiny
sensor: ar0820
lights: tl16
wavelengths: {{start_nm: 400, stop_nm: 700, step_nm: 5}}
cfas: [RGGB, RYNCy]
designs:
  nominal: {{{MADE}, left_nm: 613, right_nm: 651}}}}
  robust: {{{MADE}, left_nm: 628, right_nm: 665}}}}
scenarios:
  lens: {{optics: {{f_number: 1.6}}, off_axis_deg: 20, field: {{cra_deg: [0, 16, 20], places: any}}}}
  named: {{optics: {{f_number: 1.6, cra_deg: 16}}, off_axis_deg: 10.314104815618196}}
"""
OF_MAPS = ("sensor_map.parquet", "figures/places-1.svg")


def run_of(text: str, folder: Path) -> Path:
    """A run whose report draws maps alone."""
    (folder / "tiny.yaml").write_text(text)
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("sweep.report.page._drawings", map_drawings)
        code, _, said = commanded("run", folder / "tiny.yaml", "--output", folder, "--jobs", 1)
    assert code == 0, said
    return folder / "tiny"


@pytest.fixture(scope="module")
def tiny(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return run_of(TINY, tmp_path_factory.mktemp("map"))


def test_a_map_is_that_of_each_place(tiny: Path) -> None:
    """Half way to the corner: tan(10.314 degrees) is half of tan(20 degrees)."""
    study, kept = load_study(tiny.parent / "tiny.yaml"), pd.read_parquet(tiny / "sensor_map.parquet")
    output = read_output(tiny)
    few = output.named_rows[output.named_rows["scenario"] == "lens"].set_index("name")["design_id"]
    assert set(kept["design_id"]) == set(few)
    half = kept[kept["height"] == 0.5].set_index("design_id")
    assert set(half["cra_deg"]) == {16.0}
    for space in study.spaces:
        curves = space.curves(space.points(0, 1), study.grid.size)
        expected = smooth_csd(study.setup(space, "named"), curves, ("yellow", "red"))[0]
        assert half.loc[few[space.name], "csd_yellow_red"] == pytest.approx(expected, rel=1e-9)


def test_the_report_draws_the_nominal_design_beside_the_robust_one(tiny: Path) -> None:
    (figure,) = sensor_figures(read_output(tiny))
    assert [each.name for each in figure.maps] == ["nominal", "robust"]
    assert figure.level is not None
    assert figure.level[0] == "RGGB"
    nominal, robust = (each.dn for each in figure.maps)
    assert nominal.min() < 0.5 * robust.min()
    assert all((tiny / name).is_file() for name in OF_MAPS)
    lens = read_output(tiny).named_rows.set_index(["scenario", "name"]).loc[("lens", "nominal")]
    # The row is refined between the heights of the map.
    assert -1 < lens["csd_yellow_red"] - nominal.min() <= 1e-9
    assert np.diff(figure.maps[0].heights).max() == pytest.approx(1 / 40)


def test_without_places_of_the_sensor_there_is_no_map(tmp_path: Path) -> None:
    lines = [line for line in TINY.splitlines() if "field:" not in line]
    folder = run_of("\n".join(lines), tmp_path)
    assert not any((folder / name).exists() for name in OF_MAPS)
