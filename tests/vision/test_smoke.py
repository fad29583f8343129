"""A whole study of vision with two seeds: its tables, its report, the bound, and the same numbers again."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from sweep import read_run
from sweep.base.errors import SweepError
from sweep.report.sections.vision import Vision
from sweep.report.vision import NETWORK, OBSERVER, PROTOTYPES, benchmark_of, lessons_of, ranks_of
from sweep.results.output import Output, read_output
from sweep.results.tables import VISION, VISION_TABLES
from sweep.vision.batches import Batch
from sweep.vision.scenes import ORDERS, UNSEEN

from ..commanded import commanded, sweep
from ..warm import Warm

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
  network_images: 20000
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
    assert "Rank correlation" in " ".join(done.stdout.split())
    return base / "smoke"


@pytest.fixture(scope="module")
def output(folder: Path) -> Output:
    return read_output(folder)


@pytest.mark.parametrize("order", ORDERS)
def test_no_reader_is_better_than_the_observer(output: Output, order: str) -> None:
    """By no more than three standard errors of the difference on the same images."""
    benchmark = benchmark_of(output)
    assert benchmark.learners == [PROTOTYPES, NETWORK]
    for design, reader in product(benchmark.designs, benchmark.learners):
        more = (benchmark.wrong(reader, order)[design] - benchmark.wrong(OBSERVER, order)[design]).to_numpy()
        assert more.mean() >= -3 * more.std() / np.sqrt(more.size)
    for design in benchmark.designs:
        said = benchmark.answers(design, OBSERVER, order)
        wrong = (said["said"] != said["state"]).to_numpy(dtype=float)
        off = wrong - (1 - said["p"].to_numpy())
        assert abs(off.mean()) <= 4 * off.std() / np.sqrt(off.size) + 1e-9


def test_the_quantity_is_the_observers_doubt(output: Output) -> None:
    """Of the first seed's images, the lenses in any order."""
    images = output.vision[VISION]
    for row in output.table.to_dict("records"):
        own = images[(images["name"] == row["name"]) & (images["seed"] == 0) & (images["order"] == "shuffled")]
        doubt = 1 - own.loc[own["lamps"] == UNSEEN, f"{OBSERVER}_p"]
        assert row["vision_error"] == pytest.approx(doubt.mean(), rel=1e-9)


def test_ranks_and_sentences(output: Output) -> None:
    benchmark = benchmark_of(output)
    for reader in benchmark.learners:
        ranks = ranks_of(benchmark, reader)
        assert set(ranks.everywhere) == {"csd", "dprime", "pair_error", OBSERVER}
        assert all(-1 <= found.low <= found.high <= 1 for found in ranks.everywhere.values())
        whole = [lesson for lesson in lessons_of(benchmark) if lesson.reader == reader]
        assert [lesson.images for lesson in whole] == [313, 2500, 20000]
        assert min(whole[-1].times.values()) >= 1
        times = benchmark.times_observer("RGGB", reader, benchmark.vision.distances_m)
        assert times.value == pytest.approx(whole[-1].times["RGGB"], rel=1e-9)
    section, _ = Vision.of(output)
    assert section.answer[-1].startswith("Rank correlation of the color separation")


def test_the_report_has_its_figures(folder: Path) -> None:
    page = (folder / "report.html").read_text()
    assert "Images read wrongly" in page or "errs (percent of the images)" in page
    assert page.count("<svg") > 2


def test_a_lost_table_comes_back_the_same(folder: Path) -> None:
    """Also with two workers: the same seed gives the same numbers."""
    before = {name: (folder / name).read_bytes() for name in VISION_TABLES}
    for name in VISION_TABLES:
        (folder / name).unlink()
    said = folder.with_name("said")
    run = Warm("run", folder.parent / "smoke.yaml", "--output", folder.parent, "--jobs", 2, said=said)
    assert run.wait(timeout=600) == 0, said.read_text()
    assert {name: (folder / name).read_bytes() for name in VISION_TABLES} == before


def files_of(folder: Path, manifest: pd.DataFrame) -> Iterator[Batch]:
    """Images of exported files in the order of their manifest, as anyone reads them."""
    for name, labels in manifest.groupby("file", sort=False):
        with np.load(folder / str(name)) as held:
            yield Batch(held["images"][labels["index"].to_numpy()], labels)


@pytest.fixture(scope="module")
def exported(folder: Path) -> tuple[Path, pd.DataFrame]:
    to = folder.parent / "images"
    code, _, said = commanded("export", folder, "--images", to, "--jobs", 1)
    assert code == 0, said
    return to, pd.read_parquet(to / "manifest.parquet")


def test_python_yields_and_scores_the_same_images(folder: Path, exported: tuple[Path, pd.DataFrame]) -> None:
    run, (to, manifest) = read_run(folder), exported
    batches = list(run.images("test", ["RCCC"]))
    here = manifest[(manifest["name"] == "RCCC") & (manifest["split"] == "test")]
    held = np.concatenate([batch.images for batch in files_of(to, here)])
    np.testing.assert_array_equal(np.concatenate([batch.images for batch in batches]), held)
    labels = pd.concat([batch.labels for batch in batches], ignore_index=True)
    assert list(labels["image_id"]) == list(here["image_id"])
    predictions = manifest[manifest["split"] == "test"][["image_id"]].assign(state="red")
    scores = run.score(predictions).set_index(["name", "order", "distance_m", "level"])
    assert scores.loc[("RCCC", "shuffled", "all", "all"), "error"] == pytest.approx(0.75, abs=0.01)
    predictions.to_csv(folder.parent / "red.csv", index=False)
    code, out, said = commanded("score", folder, folder.parent / "red.csv", "--output", folder.parent / "scores")
    assert code == 0, said
    assert "red, RGGB: errs on 75.0 %" in out
    assert "network, RGGB: errs on" in out
    for wrong in ({"designs": ["RGBB"]}, {"split": "tset"}, {"form": "jpeg"}):
        with pytest.raises(SweepError, match="unknown"):
            run.images(**wrong)
