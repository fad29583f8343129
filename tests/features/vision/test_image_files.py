"""Images of a benchmark as files: those that the readers of the run have seen, with labels that are true."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from PIL import Image
from scipy.integrate import trapezoid

from sweep import images, read_run
from sweep.features.vision.batches import formed
from sweep.features.vision.images import HeadCamera
from sweep.features.vision.isp import isp_of
from sweep.features.vision.lamps import TEST, split_lamps
from sweep.features.vision.materials import ambient_light
from sweep.features.vision.readers import scenes_of
from sweep.features.vision.tables import vision_designs
from sweep.results.lock import locked
from sweep.results.output import read_output
from sweep.study import load_study

from ...commanded import commanded
from ...conftest import draw_nothing
from .heads import GRID, LEVELS, NO_FILTERS, head_setup, vision

BENCHMARK = """\
study: heads
wavelengths: {step_nm: 20}
sensor: ar0820
lights: tl16
pixel: {read_noise_e: 2, offset_dn: 168, prnu: 0.01}
cfas: [RGGB, RYYCy]
vision:
  fov_deg: 120
  distances_m: [80, 100]
  intensities_cd: [200]
  levels:
    day: {illuminance_lx: 40000, exposure_s: 5.0e-5}
    night: {illuminance_lx: 1, light: sodium street light, exposure_s: 1.0e-3}
  test_images: 30
  train_images: 300
  check_images: 20
  seeds: 2
  prototypes: false
  street: {columns: 3, rows: 2, heads: 2, brake_lamps: 2, street_lamps: 1, train_images: 20, test_images: 20}
"""

pytestmark = pytest.mark.feature("export")


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
    code, _, err = commanded("export-images", run, to, "--jobs", 1, *options)
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
    vision, seed = study.section.key("vision"), (study.section.seed, 1)
    camera = HeadCamera(setup, curves, vision)
    scenes = scenes_of(vision, split_lamps(setup.lights, vision, seed), "shuffled", TEST, seed)
    here = manifest.query("name == 'RYYCy' and seed == 1 and order == 'shuffled' and split == 'test'")
    held = np.stack([image(tmp_path / "raw", one) for _, one in here.iterrows()])
    assert held.dtype == np.uint16
    np.testing.assert_array_equal(held, camera.images(scenes))
    yielded = list(images(read_run(run), "test", ["RYYCy"]))
    labels = pd.concat([batch.labels for batch in yielded], ignore_index=True)
    at = pd.Index(labels["image_id"]).get_indexer(here["image_id"])
    np.testing.assert_array_equal(np.concatenate([batch.images for batch in yielded])[at], held)
    answers = pd.read_parquet(run / "vision.parquet").query("name == 'RYYCy' and seed == 1 and order == 'shuffled'")
    answers = answers[answers["lamps"] == "unseen"]
    for column in ("state", "lamp", "distance_m", "level", "background"):
        assert list(here[column]) == list(answers[column]), column
    assert row["name"] == "RYYCy"


def test_the_observer_s_own_answers_are_scored(run: Path, tmp_path: Path) -> None:
    """By the names of the exported images: no distance from the ideal observer."""
    manifest = exported(run, tmp_path / "raw").query("split == 'test'")
    answers = pd.read_parquet(run / "vision.parquet").query("lamps == 'unseen'")
    key = ["design_id", "seed", "order", "image"]
    file = manifest.merge(answers[[*key, "observer"]], on=key).rename(columns={"state": "truth", "observer": "state"})
    file[["image_id", "state"]].to_csv(tmp_path / "ideal.csv", index=False)
    code, out, err = commanded("score", run, tmp_path / "ideal.csv", "--output", tmp_path / "scores")
    assert code == 0, err
    assert "+0.0 points (+0.0 to +0.0) against the ideal observer" in out


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
    parts = (torn / "parts" / name for name in ("1-0-shuffled-train-0.parquet", "0-1-street-test-0.parquet"))
    images = (torn / "images" / name for name in ("1/0-shuffled-train-0.npz", "0/1-street-test-0.npz"))
    for path in (torn / "manifest.parquet", *parts, *images):
        path.unlink()
    pd.testing.assert_frame_equal(exported(run, torn), first)
    assert files_of(whole) == files_of(torn)
    lost, cut, swapped = sorted((torn / "images").rglob("*.npz"))[:3]
    lost.unlink()
    os.truncate(cut, cut.stat().st_size // 2)
    swapped.write_bytes((torn / "images" / "1" / "0-shuffled-train-0.npz").read_bytes())
    one, other = sorted((torn / "parts").iterdir())[-2:]
    one.write_bytes(other.read_bytes())
    pd.testing.assert_frame_equal(exported(run, torn), first)
    assert files_of(whole) == files_of(torn)
    with locked(torn):
        refused("in use by another command", "export-images", run, torn)
    refused("holds other images", "export-images", run, whole, "--form", "isp")
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "notes.txt").write_text("x")
    refused("holds other files", "export-images", run, tmp_path / "mine")


def files_of(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.fixture(scope="module")
def pictures(run: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    to = tmp_path_factory.mktemp("pictures") / "coco"
    code, _, err = commanded(
        "export-images", run, to, "--form", "isp", "--format", "coco", "--split", "test", "--jobs", 1
    )
    assert code == 0, err
    return to


def annotated(folder: Path) -> dict[str, Any]:
    return dict(json.loads((folder / "annotations" / "instances_test.json").read_text()))


def test_boxes_hold_the_lamps(pictures: Path) -> None:
    """By day a red lens is red where its box is; a head has the state of its lamp."""
    held, streets = annotated(pictures / "0-RGGB"), pd.read_parquet(pictures / "street.parquet")
    names = {one["id"]: one["name"] for one in held["categories"]}
    assert list(names.values()) == ["off head", "red head", "yellow head", "green head", *LAMPS]
    assert (len(held["images"]), streets["coco_id"].is_unique) == (40, True)
    lamps = [one for one in held["annotations"] if names[one["category_id"]] in LAMPS]
    heads = [one for one in held["annotations"] if one not in lamps]
    assert len(heads) == 80
    assert len(lamps) == sum(names[one["category_id"]] != "off head" for one in heads)
    files, seen = {one["id"]: one["file_name"] for one in held["images"]}, 0
    levels = streets.set_index("image_id")["level"]
    for one in lamps:
        name, (left, top, width, height) = files[one["image_id"]], one["bbox"]
        if levels[Path(name).stem] == "day" and names[one["category_id"]] == "red lamp" and width > 4:
            with Image.open(pictures / "0-RGGB" / "images" / "test" / name) as picture:
                assert (picture.mode, picture.size) == ("RGB", (108, 72))
                y, x = round(top + height / 2 - 0.5), round(left + width / 2 - 0.5)
                red, green, blue = np.asarray(picture, dtype=float)[y, x]
            assert red > 1.5 * max(green, blue)
            seen += 1
    assert seen >= 2


LAMPS = ["red lamp", "yellow lamp", "green lamp"]


def test_perfect_boxes_come_back(run: Path, pictures: Path, tmp_path: Path) -> None:
    """With numbers, stems and file names of COCO: all score 1."""
    for kind in ("numbers", "stems", "names"):
        (tmp_path / kind).mkdir()
        for name in ("0-RGGB", "1-RYYCy"):
            held = annotated(pictures / name)
            files = {one["id"]: one["file_name"] for one in held["images"]}
            called = {"numbers": int, "stems": lambda at, f=files: Path(f[at]).stem, "names": lambda at, f=files: f[at]}
            rows = [
                {"image_id": called[kind](one["image_id"]), "score": 0.5}  # type: ignore[operator]
                | {key: one[key] for key in ("category_id", "bbox")}
                for one in held["annotations"]
            ]
            (tmp_path / kind / f"{name}.json").write_text(json.dumps(rows))
    readers = [tmp_path / name for name in ("numbers", "stems", "names")]
    code, out, err = commanded("score", run, *readers, "--output", tmp_path / "scores")
    assert code == 0, err
    assert out.count("average precision 1.000") == 12  # heads and lamps, two designs
    table = pd.read_parquet(tmp_path / "scores" / "street_scores.parquet")
    scores = table[["ap50", "ap", "recall"]].to_numpy()
    np.testing.assert_allclose(scores[np.isfinite(scores)], 1.0)


ROW = '[{"image_id": 1, "category_id": 1, "bbox": [1, 2, 3, 4], "score": 0.5}]'


@pytest.mark.parametrize(
    ("file", "text", "said"),
    [
        ("mine.json", ROW.replace('id": 1, "cat', 'id": 99999, "cat'), "[0].image_id"),
        ("mine.json", ROW.replace('y_id": 1', 'y_id": 9'), "[0].category_id"),
        ("mine.json", ROW.replace(", 4]", "]"), "[0].bbox"),
        ("mine.json", ROW.replace("3, 4]", "-3, 4]"), "[0].bbox"),
        ("mine.json", ROW.replace("0.5", '"x"'), "[0].score"),
        ("mine.json", ROW.replace("0.5", "null"), "[0].score"),
        ("mine.json", "{}", "no results of COCO"),
        ("mine.json", '[{"image_id": 1, "bb', "no JSON"),
        ("mine.json", "[]", "no detections"),
        ("mine.json", ROW.replace("1, 2, 3, 4", "100, 20, 900, 400"), "boxes reach beyond their images"),
    ],
)
def test_other_detections_are_refused_with_a_line(run: Path, tmp_path: Path, file: str, text: str, said: str) -> None:
    path = tmp_path / file
    path.write_text(text)
    refused(said, "score", run, path, "--output", tmp_path / "scores")


def test_strips_are_parts_of_whole_images(monkeypatch: pytest.MonkeyPatch) -> None:
    """Developed a few rows at a time, images are the same, but for the rounding of a product."""
    requested = vision(levels={name: LEVELS[name] for name in ("day", "night")})
    setup = head_setup("RYYCy")
    camera, lamps = HeadCamera(setup, NO_FILTERS, requested), split_lamps(setup.lights, requested, (1, 0))
    scenes = scenes_of(requested, lamps, "shuffled", TEST, (1, 0))
    for form in ("demosaicked", "isp"):
        whole = formed(camera, scenes, form)
        with monkeypatch.context() as patch:
            patch.setattr("sweep.features.vision.batches._STRIP_ROWS", 3)
            strips = formed(camera, scenes, form)
        np.testing.assert_allclose(strips.astype(float), whole.astype(float), rtol=1e-6, atol=form == "isp")


@pytest.mark.parametrize("cfa", ["RGGB", "RYYCy"])
@pytest.mark.parametrize("light", ["daylight", "sodium street light"])
def test_white_is_white_under_its_own_light(cfa: str, light: str) -> None:
    qe = head_setup(cfa).camera.qe
    white = trapezoid(ambient_light(GRID, light) * qe)
    isp = isp_of(GRID, qe, light)
    assert isp.developed(white / white.max() / 2).tolist() == [188, 188, 188]  # sRGB of 0.5
    assert isp.developed(np.ones(len(qe))).tolist() == [255, 255, 255]  # what clips is white
