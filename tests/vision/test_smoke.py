"""A whole study of vision with two seeds: its tables, its report, the bound, and the same numbers again."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from sweep.report.page import _vision_drawings
from sweep.report.vision import NETWORK, OBSERVER, benchmark_of, ranks_of
from sweep.report.vision_report import vision_sentences
from sweep.results.inventory import Inventory
from sweep.results.output import Output, read_output
from sweep.results.tables import VISION, VISION_TABLES
from sweep.vision.lamps import spectrum_digest
from sweep.vision.scenes import ORDERS, UNSEEN
from sweep.vision.scores import mean_of

from ..commanded import sweep
from ..plain_values import MOST_BYTES, pickled_size
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
  check_images: 100
  test_images: 100
  epochs: 4
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    base = tmp_path_factory.mktemp("vision")
    (base / "smoke.yaml").write_text(STUDY)
    done = sweep("run", str(base / "smoke.yaml"), "--output", str(base), "--jobs", "1")
    assert done.returncode == 0, done.stderr
    assert "rank correlation" in done.stdout
    return base / "smoke"


@pytest.fixture(scope="module")
def output(folder: Path) -> Output:
    return read_output(folder)


def test_every_design_reads_the_same_scenes(output: Output) -> None:
    images = output.vision[VISION]
    scenes = ["seed", "order", "lamps", "image", "state", "lamp", "background", "phantom", "distance_m", "level"]
    one, other = (images[images["name"] == name][scenes].reset_index(drop=True) for name in ("RGGB", "RCCC"))
    pd.testing.assert_frame_equal(one, other)
    assert len(one) == 2 * 2 * (100 + 50)
    assert not images[NETWORK].isna().any()
    assert images.loc[images["lamps"] == UNSEEN, OBSERVER].notna().all()


def test_lamps_of_the_test_are_never_learned_from(output: Output) -> None:
    images = output.vision[VISION].dropna(subset=["lamp"])
    known = {name: spectrum_digest(values) for (_, name), values in output.curves.lights.items()}
    for _, rows in images.groupby("seed"):
        seen, unseen = ({known[n] for n in rows.loc[rows["lamps"] == part, "lamp"]} for part in ("seen", "unseen"))
        assert seen
        assert unseen
        assert not seen & unseen


@pytest.mark.parametrize("order", ORDERS)
def test_the_network_is_never_better_than_the_observer(output: Output, order: str) -> None:
    """By no more than the interval of the difference on the same images lets it."""
    benchmark = benchmark_of(output)
    for design in benchmark.designs:
        more = benchmark.wrong(NETWORK, order)[design] - benchmark.wrong(OBSERVER, order)[design]
        assert mean_of(more.to_numpy(), benchmark.seeds(order)).high >= 0
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
    ranks = ranks_of(benchmark_of(output))
    assert set(ranks.everywhere) == {"csd", "dprime", "pair_error", OBSERVER}
    assert all(-1 <= found.low <= found.high <= 1 for found in ranks.everywhere.values())
    assert next(iter(vision_sentences(output))).startswith("The color separation ")


def test_the_report_has_its_figures(folder: Path) -> None:
    page = (folder / "report.html").read_text()
    assert "Images of traffic lights" in page
    assert "Rank correlation" in page
    assert {f"figures/vision-{name}.png" for name in ("errors", "ranks", "misread")} <= Inventory(folder).files.keys()


def test_its_drawings_are_plain_values(output: Output) -> None:
    drawings = list(_vision_drawings(output))
    assert len(drawings) == 3
    for name, _, draw in drawings:
        assert pickled_size(draw) < MOST_BYTES, name


def test_a_lost_table_comes_back_the_same(folder: Path) -> None:
    """Also with two workers: the same seed gives the same numbers."""
    before = {name: (folder / name).read_bytes() for name in VISION_TABLES}
    for name in VISION_TABLES:
        (folder / name).unlink()
    said = folder.with_name("said")
    run = Warm("run", folder.parent / "smoke.yaml", "--output", folder.parent, "--jobs", 2, said=said)
    assert run.wait(timeout=600) == 0, said.read_text()
    assert {name: (folder / name).read_bytes() for name in VISION_TABLES} == before
