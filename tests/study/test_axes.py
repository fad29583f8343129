"""Numbers of the camera as axes: single studies as the oracle, the physics of the pitch, and faults."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from sweep.camera.model import SceneModel
from sweep.camera.pixel import Pixel
from sweep.study import load_study
from sweep.study.load import sensor_studies_in

from ..build import load, one_line, output_of
from ..commanded import commanded
from ..golden import numbers_of

HEAD = "study: axes\nsensor: ar0820\nlights: tl16\ncfas: [RGGB, RYYCy]\ncolumns: all\n"
FAR = "target: {distance_m: 60, fov_deg: 60, phase_px: [0.3, 0.2]}, optics: {f_number: 2}"


@pytest.mark.parametrize(("bits", "pitch", "well", "f_number"), [(8, 1.4, 3000, 2), (13, 2.8, 20000, 4)])
def test_a_camera_of_a_grid_is_that_of_a_single_study(
    tmp_path: Path, bits: int, pitch: float, well: float, f_number: float
) -> None:
    """Bit for bit."""
    each = f"pixel.bits: [9, {bits}], pixel.pitch_um: [{pitch}], pixel.well_e: [{well}], optics.f_number: [{f_number}]"
    grid = numbers_of(load(tmp_path, f"{HEAD}scenarios: {{s: {{{FAR}, each: {{{each}}}}}}}\n"))
    text = f"{HEAD}pixel: {{bits: {bits}, pitch_um: {pitch}, well_e: {well}}}\n"
    text += f"scenarios: {{s: {{{FAR.replace('f_number: 2', f'f_number: {f_number}')}}}}}\n"
    single = numbers_of(load(tmp_path, text)).set_index(["name", "column"])["value"]
    (scenario,) = {name for name in grid["scenario"] if f" bits={bits} " in name}
    found = grid[grid["scenario"] == scenario].set_index(["name", "column"])["value"]
    assert len(single) > 20
    np.testing.assert_array_equal(found[single.index], single)


def test_a_series_has_its_key_and_value_as_columns(tmp_path: Path) -> None:
    each = "{zip: {pixel.pitch_um: [2.1, 4.2], target.width_px: [3840, 1920]}}"
    text = f"{HEAD}scenarios: {{bits: {{each: {{pixel.bits: [8, 12]}}}}, lens: {{{FAR}, each: {each}}}, plain: {{}}}}\n"
    rows = output_of(tmp_path, text).table.set_index("name").loc["RGGB"]
    assert rows["series"].astype(object).fillna("").tolist() == ["bits", "bits", "lens", "lens", ""]
    assert rows["key"].dropna().tolist() == ["pixel.bits"] * 2 + ["pixel.pitch_um"] * 2
    assert rows["value"].dropna().tolist() == [8, 12, 2.1, 4.2]
    assert rows["target.width_px"].dropna().tolist() == [3840, 1920]
    again = load_study(tmp_path / "out" / "study.resolved.yaml")
    assert {name: scene.at for name, scene in again.scenarios.items()} == {
        name: scene.at for name, scene in load(tmp_path, text).scenarios.items()
    }


def test_scenes_after_the_first_of_a_series_have_what_is_asked_for(tmp_path: Path) -> None:
    text = f"{HEAD}recognition: {{}}\nobjective: chromatic_csd_yellow_red\nscenarios: {{s: {{noise: true, {FAR}, each: {{pixel.bits: [8, 12]}}}}}}\n"
    for folder in ("asked", "all"):
        (tmp_path / folder).mkdir()
    asked = output_of(tmp_path / "asked", text.replace("columns: all\n", "")).table
    every = output_of(tmp_path / "all", text).table
    first, other = (asked[asked["value"] == bits] for bits in (8, 12))
    assert not first.isna().any()["chromatic_csd_green_red"]
    known = {
        "csd_yellow_red",
        "chromatic_csd_yellow_red",
        "dprime_green_red",
        "chromatic_error_green_red",
        "state_error",
    }
    left_out = {name for name in other if other[name].isna().all() and not every[name].isna().all()}
    assert {"csd_green_red", "pixel_csd_yellow_red", "chromatic_csd_green_red"} <= left_out
    assert not known & left_out
    for name in set(asked) - left_out - {"simulation_key"}:
        assert asked[name].equals(every[name]), name


def test_electrons_grow_with_the_square_of_the_pitch(tmp_path: Path) -> None:
    """At a fixed irradiance and exposure; a full well per area keeps a lamp at the same share of it."""
    scenes = "{s: {exposure: {kind: fixed, exposure_s: 0.001}, each: {pixel.pitch_um: [1.4, 2.8]}}}"
    study = load(tmp_path, f"{HEAD}pixel: {{well_e_per_um2: 2000}}\nscenarios: {scenes}\n")
    small, large = (study.setup(study.spaces[0], name) for name in study.scenarios)
    assert (small.camera.pixel.well_e, large.camera.pixel.well_e) == pytest.approx((3920, 15680))
    electrons = [SceneModel(setup).pixel_electrons(np.empty((1, 0, study.grid.size))) for setup in (small, large)]
    np.testing.assert_allclose(electrons[1], 4 * electrons[0], rtol=1e-12)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("scenarios: {s: {each: {pixel.bitz: [8]}}}", "did you mean 'bits'"),
        ("scenarios: {s: {each: {pixel.bits: [8, 9.5]}}}", "scenarios.s.pixel.bits: not allowed (got 9.5)"),
        ("scenarios: {s: {each: {zip: {pixel.bits: [8, 9], optics.f_number: [2]}}}}", "as many values of each key"),
        ("scenarios: {s: {each: {zip: 3}}}", "scenarios.s.each.zip: no mapping of keys (got 3)"),
        ("pixel: {well_e: 5, well_e_per_um2: 3}", "well_e_per_um2 gives well_e 13.23"),
        ("scenarios: {s: {pixel: {captures: split_pixel}}}", "scenarios.s.pixel.captures: one scenario has no others"),
        ("pixels: 3", "pixels: no mapping of names to pixels (got 3)"),
        ("pixels: {}", "pixels: no mapping of names to pixels"),
    ],
)
def test_a_wrong_axis_is_one_line(tmp_path: Path, text: str, said: str) -> None:
    with one_line(said):
        load(tmp_path, f"{HEAD}{text}\n")


def test_a_density_and_a_full_well_replace_each_other() -> None:
    assert Pixel(**Pixel(well_e_per_um2=2000.0).with_numbers({"well_e": 7.0})).well_e == 7.0
    assert Pixel(**Pixel(well_e=7.0).with_numbers({"well_e_per_um2": 1.0})).well_e == pytest.approx(2.1**2)


def test_named_pixels_have_a_run_each_and_a_comparison(tmp_path: Path) -> None:
    path = tmp_path / "axes.yaml"
    path.write_text(
        f"{HEAD}pixel: {{offset_dn: 10}}\npixels: {{plain: , split: split_pixel, small: {{pitch_um: 1.4}}}}\n"
    )
    several = sensor_studies_in(path)
    assert several is not None
    pixels = [load_study(path, member=member).pixel for member in several.members]
    made = [(len(pixel.captures), pixel.pitch_um, pixel.offset_dn) for pixel in pixels]
    assert made == [(0, 2.1, 10), (3, 2.1, 10), (0, 1.4, 10)]
    assert commanded("run", path, "--output", tmp_path / "out", "--jobs", 1)[0] == 0
    rows = pd.read_parquet(tmp_path / "out" / "axes" / "results.parquet")
    assert rows["sensor"].unique().tolist() == ["ar0820 plain", "ar0820 split", "ar0820 small"]
