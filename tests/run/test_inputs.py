"""A run keeps the files that it was made from: its folder is a study that runs anywhere."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import sweep
from sweep.results.manifest import Manifest

from ..commanded import commanded

NM = np.arange(400, 701)

pytestmark = pytest.mark.usefixtures("plain_pictures")


@pytest.fixture
def made(tmp_path: Path) -> sweep.FinishedRun:
    """A run of a file in another folder, a folder of lamps, and curves of Python; its files are gone."""
    (tmp_path / "elsewhere" / "leds").mkdir(parents=True)
    qe = pd.DataFrame({name: np.exp(-(((NM - c) / 45) ** 2)) for name, c in (("R", 620), ("G", 540), ("B", 460))}, NM)
    qe.add_suffix(" [QE]").to_csv(tmp_path / "elsewhere" / "qe.csv", index_label="nm")
    for name, peak in (("yellow", 592), ("red", 632)):
        led = pd.Series(np.exp(-(((NM - peak) / 9) ** 2)), NM, name=f"{name} [photons]")
        led.to_csv(tmp_path / "elsewhere" / "leds" / f"{name}.csv", index_label="nm")
    sensor = sweep.sensor(tmp_path / "elsewhere" / "qe.csv", N=(NM, np.where(NM > 610, 0.3, 0.9)))
    lights = sweep.lights(tmp_path / "elsewhere" / "leds")
    run = sweep.make_study("mine", sensor=sensor, lights=lights, cfas=["RGGB", "RGNB"]).run(tmp_path / "out", jobs=1)
    shutil.rmtree(tmp_path / "elsewhere")
    return run


def test_the_folder_of_a_run_is_a_study_without_its_files(made: sweep.FinishedRun, tmp_path: Path) -> None:
    moved = shutil.copytree(made.folder, tmp_path / "moved")
    code, _, said = commanded("run", moved / "study.resolved.yaml", "--output", tmp_path / "again", "--jobs", 1)
    assert (code, said) == (0, "")
    again = sweep.read_run(tmp_path / "again" / "mine")
    pd.testing.assert_frame_equal(again.table, made.table, check_exact=True)
    assert Manifest(again.folder).fingerprint == Manifest(made.folder).fingerprint
    assert (again.folder / "inputs.zip").read_bytes() == (made.folder / "inputs.zip").read_bytes()
    np.testing.assert_allclose(made.study.evaluate().csd_yellow_red, made.table.csd_yellow_red, rtol=1e-9)


@pytest.mark.parametrize("damage", [b"", b"PK\x05\x06" + bytes(18), b"no archive"])
def test_a_damaged_archive_is_one_line(made: sweep.FinishedRun, damage: bytes) -> None:
    folder = made.folder
    (folder / "inputs.zip").write_bytes(damage)
    assert "inputs.zip: is damaged" in commanded("status", folder, "--verify")[2]
    code, out, said = commanded("check", folder / "study.resolved.yaml")
    assert (code, out, said.count("\n"), "inputs.zip: is damaged" in said) == (2, "", 1, True)
    (folder / "inputs.zip").unlink()
    assert "no such file" in commanded("check", folder / "study.resolved.yaml")[2]


def test_a_catalog_with_files_of_no_use_is_kept(tmp_path: Path) -> None:
    dyes = tmp_path / "dyes"
    dyes.mkdir()
    for name, peak in (("short", 600), ("long", 640)):
        spectrum = pd.Series(np.exp(-(((NM - peak) / 20) ** 2)), NM, name="[absorbance]")
        spectrum.to_csv(dyes / f"{name}.csv", index_label="nm")
    (dyes / "notes.csv").write_text("no curves")
    (dyes / "gone.csv").symlink_to(tmp_path / "nowhere")
    (tmp_path / "dyed.yaml").write_text(
        "study: dyed\nsensor: ar0820\nlights: tl16\ncfas: [RYNCy]\ncolorants: {catalog: [dyes]}\ndesigns:\n"
        "  one: {cfa: RYNCy, channel: N, base: Y, family: mixture, at: {colorant_1: long, absorbance_1: 0.7}}\n"
    )
    run = sweep.load_study(tmp_path / "dyed.yaml").run(tmp_path / "out", jobs=1)
    shutil.rmtree(dyes)
    np.testing.assert_allclose(run.study.evaluate().csd_yellow_red, run.table.csd_yellow_red, rtol=1e-9)
