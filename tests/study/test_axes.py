"""Numbers of the camera as axes: single studies as the oracle, the physics of the pitch, and faults."""

from __future__ import annotations

from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from sweep.camera.model import SceneModel
from sweep.camera.pixel import Pixel
from sweep.report.hold import holds_for
from sweep.report.page import answer_of
from sweep.runs import run_study
from sweep.runs.rows import Rows, rules_of
from sweep.runs.rows import rows_of as table_of
from sweep.study import Study, load_study
from sweep.study.load import sensor_studies_in

from ..build import issues, load, output_of
from ..commanded import commanded

HEAD = "study: axes\nsensor: ar0820\nlights: tl16\ncfas: [RGGB, RYYCy]\n"
FAR = "target: {distance_m: 60, fov_deg: 60, phase_px: [0.3, 0.2]}, optics: {f_number: 2}"
GRID = {
    "pixel.bits": (8, 10, 12, 13, 14),
    "pixel.pitch_um": (1.4, 2.1, 2.8, 3.5, 4.2),
    "pixel.well_e": (3000, 6000, 10000, 20000, 40000),
    "optics.f_number": (1.4, 2, 2.8, 4),
}


def rows_of(study: Study, folder: Path) -> pd.DataFrame:
    run_study(study, folder, 1, lambda *_: None)
    return pd.read_parquet(folder / "results.parquet")


@pytest.mark.slow
def test_a_grid_of_500_cameras_is_500_single_studies(tmp_path: Path) -> None:
    """Bit for bit, with one row a combination and the axes as columns."""
    each = ", ".join(f"{key}: {list(values)}" for key, values in GRID.items())
    grid = rows_of(load(tmp_path, f"{HEAD}scenarios: {{s: {{{FAR}, each: {{{each}}}}}}}\n"), tmp_path / "grid")
    assert len(grid) == 2 * 500
    assert grid["value"].isna().all()
    compared = [
        name for name in grid if grid[name].dtype == float and name not in (*GRID, "value", "omitted_effects_bound_dn")
    ]
    of_grid = grid.set_index([*GRID, "name"])
    for bits, pitch, well, f_number in product(*GRID.values()):
        text = f"{HEAD}pixel: {{bits: {bits}, pitch_um: {pitch}, well_e: {well}}}\n"
        text += f"scenarios: {{s: {{{FAR.replace('f_number: 2', f'f_number: {f_number}')}}}}}\n"
        single = load(tmp_path, text).with_plans()
        for space in single.spaces:
            expected = of_grid.loc[(bits, pitch, well, f_number, space.name)]
            for name, value in quantities_of(single, space.name).items():
                if name in compared:
                    np.testing.assert_array_equal(value, expected[name], err_msg=f"{name} of {text}")


def quantities_of(study: Study, cfa: str) -> dict[str, float]:
    """All columns of a plain CFA in the only scenario, as a run computes them."""
    space = next(space for space in study.spaces if space.name == cfa)
    first = np.zeros(1, dtype=np.intp)
    rules, scenario = rules_of(study), next(iter(study.scenarios))
    row = table_of(Rows(space, scenario, first, first, first), study.setup(space, scenario), rules, rules.wanted)
    return {k: np.nan if v is None else v for k, v in row.to_pylist()[0].items() if isinstance(v, float | None)}


def test_a_series_has_its_key_and_value_as_columns(tmp_path: Path) -> None:
    each = "{zip: {pixel.pitch_um: [2.1, 4.2], target.width_px: [3840, 1920]}}"
    text = f"{HEAD}scenarios: {{bits: {{each: {{pixel.bits: [8, 12]}}}}, lens: {{{FAR}, each: {each}}}, plain: {{}}}}\n"
    rows = rows_of(load(tmp_path, text), tmp_path / "out").set_index("name").loc["RGGB"]
    assert rows["series"].astype(object).fillna("").tolist() == ["bits", "bits", "lens", "lens", ""]
    assert rows["key"].dropna().tolist() == ["pixel.bits"] * 2 + ["pixel.pitch_um"] * 2
    assert rows["value"].dropna().tolist() == [8, 12, 2.1, 4.2]
    assert rows["target.width_px"].dropna().tolist() == [3840, 1920]
    again = load_study(tmp_path / "out" / "study.resolved.yaml")
    assert {name: scene.at for name, scene in again.scenarios.items()} == {
        name: scene.at for name, scene in load(tmp_path, text).scenarios.items()
    }


def test_electrons_grow_with_the_square_of_the_pitch_and_the_lens_with_the_pitch(tmp_path: Path) -> None:
    """At a fixed irradiance and exposure; a full well per area keeps a lamp at the same share of it."""
    scene = f"{FAR}, exposure: {{kind: fixed, exposure_s: 0.001}}, each: {{pixel.pitch_um: [1.4, 2.8]}}"
    study = load(
        tmp_path,
        f"{HEAD}pixel: {{well_e_per_um2: 2000}}\nscenarios: {{s: {{{scene}}}, field: {{{scene.split('}, ', 2)[2]}}}}}\n",
    )
    field = [name for name in study.scenarios if name.startswith("field")]
    small, large = (study.setup(study.spaces[0], name) for name in field)
    assert (small.camera.pixel.well_e, large.camera.pixel.well_e) == pytest.approx((3920, 15680))
    electrons = [SceneModel(setup).pixel_electrons(np.empty((1, 0, study.grid.size))) for setup in (small, large)]
    np.testing.assert_allclose(electrons[1], 4 * electrons[0], rtol=1e-12)
    targets = [study.scenarios[name].target for name in study.scenarios if name.startswith("s ")]
    lens_um = [
        target.focal_length_um(study.pixel_in(study.scenarios[name]).pitch_um)
        for target, name in zip(targets, study.scenarios, strict=False)
        if target
    ]
    assert lens_um[1] == pytest.approx(2 * lens_um[0])
    assert targets[0].object_resolution_px == targets[1].object_resolution_px


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
    lines = issues(tmp_path, f"{HEAD}{text}\n")
    assert len(lines) == 1
    assert said in lines[0]


def test_a_density_and_a_full_well_replace_each_other() -> None:
    of_density = Pixel(well_e_per_um2=2000.0)
    assert Pixel(**of_density.with_numbers({"pitch_um": 4.2})).well_e == pytest.approx(2000 * 4.2**2)
    assert Pixel(**of_density.with_numbers({"well_e": 7.0})).well_e == 7.0
    assert Pixel(**Pixel(well_e=7.0).with_numbers({"well_e_per_um2": 1.0})).well_e == pytest.approx(2.1**2)


def test_named_pixels_have_a_run_each_and_a_comparison(tmp_path: Path) -> None:
    path = tmp_path / "axes.yaml"
    path.write_text(
        f"{HEAD}pixel: {{offset_dn: 10}}\npixels: {{plain: , split: split_pixel, small: {{pitch_um: 1.4}}}}\n"
    )
    several = sensor_studies_in(path)
    assert several is not None
    studies = {member.pixel: load_study(path, member=member) for member in several.members}
    assert [len(study.pixel.captures) for study in studies.values()] == [0, 3, 0]
    assert [study.pixel.pitch_um for study in studies.values()] == [2.1, 2.1, 1.4]
    assert {study.pixel.offset_dn for study in studies.values()} == {10}
    assert commanded("run", path, "--output", tmp_path / "out", "--jobs", 1)[0] == 0
    rows = pd.read_parquet(tmp_path / "out" / "axes" / "results.parquet")
    assert rows["sensor"].unique().tolist() == ["ar0820 plain", "ar0820 split", "ar0820 small"]


def test_a_page_over_bit_depths_names_no_single_full_scale(tmp_path: Path) -> None:
    output = output_of(tmp_path, f"{HEAD}scenarios: {{s: {{each: {{pixel.bits: [8, 12]}}}}}}\n")
    assert "8 to 12 bits (full scale 255 to 4,095\u00a0DN)" in holds_for(output)
    assert "bit depth" in " ".join(answer_of(output))
    assert "4,095" not in " ".join(answer_of(output))
