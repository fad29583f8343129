"""Images of a benchmark as files: those that the readers of the run have seen, with labels that are true."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from PIL import Image

from sweep.results.output import read_output
from sweep.runs.vision import vision_designs
from sweep.study import load_study
from sweep.vision.images import HeadCamera
from sweep.vision.isp import isp_of
from sweep.vision.lamps import TEST, split_lamps
from sweep.vision.materials import ambient_light
from sweep.vision.readers import scenes_of

from ..commanded import commanded
from ..conftest import draw_nothing
from .heads import GRID, head_setup

BENCHMARK = """\
study: heads
wavelengths: {step_nm: 20}
sensor: ar0820
lights: tl16
pixel: {read_noise_e: 2, offset_dn: 168, prnu: 0.01}
cfas: [RGGB, RYYCy]
vision:
  fov_deg: 120
  distances_m: [40, 100]
  intensities_cd: [200]
  levels:
    day: {illuminance_lx: 40000, exposure_s: 5.0e-5}
    night: {illuminance_lx: 1, light: sodium street light, exposure_s: 1.0e-3}
  test_images: 30
  train_images: 300
  check_images: 20
  seeds: 2
  network: false
  street: {columns: 3, rows: 2, heads: 2, brake_lamps: 2, street_lamps: 1, train_images: 20, test_images: 20}
"""


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("heads")
    (folder / "heads.yaml").write_text(BENCHMARK)
    with pytest.MonkeyPatch.context() as patch:
        draw_nothing(patch)
        code, _, err = commanded("run", folder / "heads.yaml", "--output", folder, "--jobs", 1)
    assert code == 0, err
    return folder / "heads"


def exported(run: Path, to: Path, *options: str) -> pd.DataFrame:
    code, _, err = commanded("export", run, "--images", to, "--jobs", 1, *options)
    assert code == 0, err
    return pd.read_parquet(to / "manifest.parquet")


def refused(said: str, *arguments: object) -> None:
    code, _, err = commanded(*arguments)
    assert (code, said in err) == (2, True), err


def image(folder: Path, row: pd.Series) -> np.ndarray:
    with np.load(folder / row["file"]) as held:
        return np.asarray(held["images"][row["index"]])


def test_raw_images_are_those_that_the_observer_reads(run: Path, tmp_path: Path) -> None:
    manifest = exported(run, tmp_path / "raw")
    study, output = load_study(run / "study.resolved.yaml"), read_output(run)
    counts = manifest.groupby(["name", "split"]).size()
    assert counts.to_dict() == {
        (name, split): n * 2 for name in ("RGGB", "RYYCy") for split, n in (("train", 300), ("check", 20), ("test", 60))
    }  # of two seeds; the test shows the street's order, too
    assert manifest["image_id"].is_unique
    row, setup, curves = vision_designs(study, output.named_rows)[1]
    vision, seed = study.section.vision, (study.section.seed, 1)
    camera = HeadCamera(setup, curves, vision)
    scenes = scenes_of(vision, split_lamps(setup.lights, vision, seed), "shuffled", TEST, seed)
    here = manifest.query("name == 'RYYCy' and seed == 1 and order == 'shuffled' and split == 'test'")
    held = np.stack([image(tmp_path / "raw", one) for _, one in here.iterrows()])
    assert held.dtype == np.uint16
    np.testing.assert_array_equal(held, camera.images(scenes))
    answers = pd.read_parquet(run / "vision.parquet").query("name == 'RYYCy' and seed == 1 and order == 'shuffled'")
    answers = answers[answers["lamps"] == "unseen"]
    for column in ("state", "lamp", "distance_m", "level", "background"):
        assert list(here[column]) == list(answers[column]), column
    assert row["name"] == "RYYCy"


def test_the_observer_s_own_answers_are_scored(run: Path, tmp_path: Path) -> None:
    """By the names of the exported images: no distance from the ideal observer, and a page."""
    manifest = exported(run, tmp_path / "raw").query("split == 'test'")
    answers = pd.read_parquet(run / "vision.parquet").query("lamps == 'unseen'")
    key = ["design_id", "seed", "order", "image"]
    file = manifest.merge(answers[[*key, "observer"]], on=key).rename(columns={"state": "truth", "observer": "state"})
    file[["image_id", "state"]].to_csv(tmp_path / "ideal.csv", index=False)
    code, out, err = commanded("score", run, tmp_path / "ideal.csv", "--output", tmp_path / "scores")
    assert code == 0, err
    assert out.splitlines()[0].startswith("ideal, RGGB: errs on")
    assert "+0.0 points (+0.0 to +0.0) against the ideal observer" in out
    scores = pd.read_parquet(tmp_path / "scores" / "scores.parquet")
    assert set(scores["distance_m"]) == {"all", "40.0", "100.0"}
    assert "<table" in (tmp_path / "scores" / "scores.html").read_text()


def test_the_lit_lens_is_where_the_label_says(run: Path, tmp_path: Path) -> None:
    """At night, the center of the light above the darkest pixels: within half a pixel of the lens."""
    manifest = exported(run, tmp_path / "raw")
    here = manifest.query("name == 'RGGB' and level == 'night' and distance_m == 100 and state != 'off'")
    assert len(here) > 20
    for _, row in here.head(40).iterrows():
        light = image(tmp_path / "raw", row).astype(float) - 168
        light[light < 0.05 * light.max()] = 0  # noise, and the dim background
        rows, columns = np.mgrid[0 : light.shape[0], 0 : light.shape[1]]
        x, y = ((light * at).sum() / light.sum() for at in (columns, rows))
        assert abs(x - row["lens_x_px"][int(row["lit"])]) < 1.0
        assert abs(y - row["lens_y_px"][int(row["lit"])]) < 1.0
        assert row["lenses"][int(row["lit"])] == row["state"]


def test_an_interrupted_export_goes_on_and_another_is_refused(run: Path, tmp_path: Path) -> None:
    whole, torn = tmp_path / "whole", tmp_path / "torn"
    first, _ = exported(run, whole), exported(run, torn)
    for path in (torn / "manifest.parquet", torn / "parts" / "1-0.parquet", *(torn / "images" / "1").glob("0-*.npz")):
        path.unlink()
    pd.testing.assert_frame_equal(exported(run, torn), first)
    for path in whole.rglob("*.npz"):
        assert path.read_bytes() == (torn / path.relative_to(whole)).read_bytes()
    refused("holds other images", "export", run, "--images", whole, "--form", "isp")
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "notes.txt").write_text("x")
    refused("holds other files", "export", run, "--images", tmp_path / "mine")
    refused("one of --design and --images", "export", run)
    refused("of more than three channels", "export", run, "--images", tmp_path / "d", "--png", "--form", "demosaicked")
    assert not (tmp_path / "d").exists()


def test_pictures_are_files_that_viewers_open(run: Path, tmp_path: Path) -> None:
    manifest = exported(run, tmp_path / "isp", "--form", "isp", "--png")
    row = manifest.query("name == 'RGGB' and state == 'red' and distance_m == 40 and level == 'day'").iloc[0]
    with Image.open(tmp_path / "isp" / row["file"]) as picture:
        assert picture.mode == "RGB"
        assert picture.size == (24, 24)
        red, green, blue = np.moveaxis(np.asarray(picture, dtype=float), 2, 0)
    at = int(np.clip(round(row["lens_y_px"][int(row["lit"])]), 0, 23)), round(row["lens_x_px"][0])
    assert red[at] > 2 * max(green[at], blue[at])


def test_coco_boxes_hold_the_lenses(run: Path, tmp_path: Path) -> None:
    """Images of the test alone; at night the brightest pixel is in the box of its image."""
    manifest = exported(run, tmp_path / "coco", "--form", "raw", "--png", "--coco", "--split", "test")
    names = [f"coco-{kind}{design}-test.json" for kind in ("", "street-") for design in (0, 1)]
    assert sorted(path.name for path in (tmp_path / "coco").glob("coco-*")) == names
    held = json.loads((tmp_path / "coco" / "coco-1-test.json").read_text())
    files = {one["id"]: one["file_name"] for one in held["images"]}
    assert sorted(files.values()) == sorted(manifest.query("design_id == 1 and split == 'test'")["file"])
    states, by_file = {one["id"]: one["name"] for one in held["categories"]}, manifest.set_index("file")
    for one in held["annotations"]:
        row, (left, top, width, height) = by_file.loc[files[one["image_id"]]], one["bbox"]
        assert states[one["category_id"]] == row["state"]
        if row["distance_m"] == 100:
            assert (width, height) == pytest.approx((1.6 * row["lens_diameter_px"], 4.6 * row["lens_diameter_px"]))
        if row["level"] == "night" and row["state"] != "off":
            pixels = np.asarray(Image.open(tmp_path / "coco" / row.name))
            y, x = np.unravel_index(pixels.argmax(), pixels.shape)
            assert top - 1 <= y + 0.5 <= top + height + 1
            assert left - 1 <= x + 0.5 <= left + width + 1
    streets = json.loads((tmp_path / "coco" / "coco-street-0-test.json").read_text())
    assert (len(streets["images"]), len(streets["annotations"])) == (40, 80)
    first = streets["images"][0]
    assert Image.open(tmp_path / "coco" / first["file_name"]).size == (first["width"], first["height"]) == (108, 72)
    refused("with --png", "export", run, "--images", tmp_path / "d", "--coco")


def test_detections_in_streets_are_scored(run: Path, tmp_path: Path) -> None:
    """The labels themselves are all right; of other images, states and numbers each has a line."""
    exported(run, tmp_path / "raw", "--split", "test")
    columns = ["state", "head_x_px", "lit_y_px"]
    lit = pd.read_parquet(tmp_path / "raw" / "street.parquet")[["image_id", *columns]].explode(columns)
    lit = lit[lit["state"] != "off"].rename(columns={"head_x_px": "x_px", "lit_y_px": "y_px"}).assign(score=0.9)
    lit.to_csv(tmp_path / "right.csv", index=False)
    code, out, err = commanded("score", run, tmp_path / "right.csv", "--output", tmp_path / "scores")
    assert code == 0, err
    assert "right, RGGB: average precision 1.000 (1.000 to 1.000)" in out
    assert "not told apart" in out
    table = pd.read_parquet(tmp_path / "scores" / "street_scores.parquet")
    assert set(table["level"]) == {"all", "day", "night"}
    for change, line in (
        ({"image_id": "x"}, "not an image of a street of the test"),
        ({"state": "yelow"}, "no signal type (and"),
        ({"score": "much"}, "no number"),
    ):
        lit.assign(**change).to_csv(tmp_path / "wrong.csv", index=False)
        refused(line, "score", run, tmp_path / "wrong.csv", "--output", tmp_path / "scores")


@pytest.mark.parametrize("cfa", ["RGGB", "RYYCy"])
@pytest.mark.parametrize("light", ["daylight", "sodium street light"])
def test_white_is_white_under_its_own_light(cfa: str, light: str) -> None:
    qe = head_setup(cfa).camera.qe
    white = ambient_light(GRID, light) @ qe.T
    isp = isp_of(GRID, qe, light)
    assert isp.developed(white / white.max() / 2).tolist() == [188, 188, 188]  # sRGB of 0.5
    assert isp.developed(np.ones(len(qe))).tolist() == [255, 255, 255]  # what clips is white
