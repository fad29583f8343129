"""What tables show of designs besides their rows: seen once, by whoever has the scene at hand, and always the same."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest

from sweep.base.types import FloatArray
from sweep.camera.accuracy import REFERENCE
from sweep.camera.forward import ForwardModel
from sweep.camera.readout import Readout
from sweep.results.tables import LIMITED_BY, POINTS, RECOGNITION
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
  RYN_4Cy: {cfa: RYNCy, channel: N, base: Y, to: G, at: RYN_4Cy}
recognition: {states: [yellow, red], patches: 20}
"""
TABLES = (LIMITED_BY, POINTS, RECOGNITION)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "looks.yaml").write_text(STUDY)
    return tmp_path


def ran(folder: Path, jobs: int = 1) -> dict[str, list[object]]:
    run_study(load_study(folder / "looks.yaml"), folder / f"out{jobs}", jobs, lambda *_: None)
    return {name: pq.read_table(folder / f"out{jobs}" / name).to_pylist() for name in TABLES}


def test_each_scene_of_each_cfa_is_made_ready_once(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[tuple[Any, ...]] = []
    usual = ForwardModel.__init__

    def counted(self: ForwardModel, *given: object, **named: object) -> None:
        made.append(given)
        usual(self, *given, **named)  # type: ignore[arg-type]

    monkeypatch.setattr(ForwardModel, "__init__", counted)
    found = ran(folder)
    of_run = [
        setup for setup, *_ in made if setup.accuracy != REFERENCE
    ]  # the others are those of the check at its end
    assert len(of_run) == 2 * 2  # RGGB and the design
    assert [len(found[name]) for name in (LIMITED_BY, RECOGNITION)] == [4, 4]


def test_a_row_and_its_recognition_share_a_readout(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    read, usual = [], Readout.with_noise

    def counted(self: Readout, electrons: FloatArray) -> object:
        read.append(electrons.shape)
        return usual(self, electrons)

    monkeypatch.setattr(Readout, "with_noise", counted)
    path = folder / "looks.yaml"  # scenes that no other test of this process has read
    path.write_text(path.read_text().replace("read_noise_e: 2", "read_noise_e: 3"))
    ran(folder)
    assert len(read) == 2 * 2


@pytest.mark.parametrize("jobs", thinned([1, 2]))
def test_what_is_looked_at_later_or_elsewhere_is_the_same(folder: Path, jobs: int) -> None:
    before = ran(folder)
    for name in TABLES:
        (folder / "out1" / name).unlink()
    assert ran(folder, jobs) == before
