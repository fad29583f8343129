"""A whole study of vision with two seeds: its tables, its report, the bound, and the same numbers again."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from sweep import images, read_run, scores
from sweep.features.vision import FILES, VISION
from sweep.features.vision.page import OBSERVER
from sweep.features.vision.scenes import UNSEEN
from sweep.results.output import Output, read_output

from ...commanded import sweep
from ...warm import Warm

pytestmark = [pytest.mark.slow, pytest.mark.long]

STUDY = """\
study: smoke
sensor: ar0820
lights: tl16
pixel: {read_noise_e: 2, offset_dn: 168, well_e: 4000}
cfas: {RGGB: , RCCC: , RCCB: , RYYCy: , BGGR: {tile: [[B, G], [G, R]]}}
vision:
  fov_deg: 120
  distances_m: [150, 500]
  levels:
    day: {illuminance_lx: 40000, exposure_s: 2.0e-5, phantom_cd: 50}
  crop_px: 16
  places_per_pixel: 1
  seeds: 2
  train_images: 400
  prototype_images: 20000
  check_images: 100
  test_images: 100
  street: {columns: 3, rows: 2, heads: 1, brake_lamps: 1, street_lamps: 1, train_images: 20, test_images: 20}
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    base = tmp_path_factory.mktemp("vision")
    (base / "smoke.yaml").write_text(STUDY)
    done = sweep("run", str(base / "smoke.yaml"), "--output", str(base), "--jobs", "1")
    assert done.returncode == 0, done.stderr
    return base / "smoke"


@pytest.fixture(scope="module")
def output(folder: Path) -> Output:
    return read_output(folder)


def test_the_quantity_is_the_observers_doubt(output: Output) -> None:
    """Of the first seed's images, the lenses in any order."""
    images = output.tables[VISION]
    for row in output.table.to_dict("records"):
        own = images[(images["name"] == row["name"]) & (images["seed"] == 0) & (images["order"] == "shuffled")]
        doubt = 1 - own.loc[own["lamps"] == UNSEEN, f"{OBSERVER}_p"]
        assert row["vision_error"] == pytest.approx(doubt.mean(), rel=1e-9)


def test_a_lost_table_comes_back_the_same(folder: Path) -> None:
    """Also with two workers: the same seed gives the same numbers."""
    before = {name: (folder / name).read_bytes() for name in FILES}
    for name in FILES:
        (folder / name).unlink()
    said = folder.with_name("said")
    run = Warm("run", folder.parent / "smoke.yaml", "--output", folder.parent, "--jobs", 2, said=said)
    assert run.wait(timeout=600) == 0, said.read_text()
    assert {name: (folder / name).read_bytes() for name in FILES} == before


def test_python_scores_the_images_that_it_yields(folder: Path) -> None:
    run = read_run(folder)
    labels = pd.concat([batch.labels for batch in images(run, "test")], ignore_index=True)
    scored = scores(run, labels[["image_id"]].assign(state="red")).set_index(["name", "order", "distance_m", "level"])
    assert scored.loc[("RCCC", "shuffled", "all", "all"), "error"] == pytest.approx(0.75, abs=0.01)
