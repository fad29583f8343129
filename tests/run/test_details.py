"""Details of designs for the report: the same with any number of workers, and when they are made again."""

from __future__ import annotations

from pathlib import Path

import pyarrow.parquet as pq
import pytest

from sweep.results.tables import LIMITED_BY, POINTS
from sweep.run import run_study
from sweep.study import load_study

from ..cases import thinned

STUDY = """
study: looks
sensor: ar0820
lights: tl16
pixel: {read_noise_e: 2}
scenarios:
  near: {target: {distance_m: 150, fov_deg: 60}, optics: {f_number: 2}, noise: true}
  far: {target: {distance_m: 300, fov_deg: 60}, optics: {f_number: 2}, noise: true}
cfas: [RGGB, RYNCy]
designs:
  RYN4Cy: {cfa: RYNCy, channel: N, base: Y, to: G, at: RYN4Cy}
recognition: {states: [yellow, red]}
"""
TABLES = (LIMITED_BY, POINTS)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "looks.yaml").write_text(STUDY)
    return tmp_path


def ran(folder: Path, jobs: int = 1) -> dict[str, list[object]]:
    run_study(load_study(folder / "looks.yaml"), folder / f"out{jobs}", jobs, lambda *_: None)
    return {name: pq.read_table(folder / f"out{jobs}" / name).to_pylist() for name in TABLES}


@pytest.mark.parametrize("jobs", thinned([1, 2]))
def test_deleted_tables_are_computed_again_with_equal_values(folder: Path, jobs: int) -> None:
    before = ran(folder)
    for name in TABLES:
        (folder / "out1" / name).unlink()
    assert ran(folder, jobs) == before
