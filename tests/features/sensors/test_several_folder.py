"""The folder of a study of several sensors is a run: it is continued, verified and repaired."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest

from sweep.features.sensors import ALL_SENSORS
from sweep.results.dataset import part_name
from sweep.results.manifest import Manifest
from sweep.results.tables import MANIFEST, PROVENANCE, REPORT

from ...commanded import commanded
from ...conftest import draw_nothing

SEVERAL = """\
study: few
wavelengths: {step_nm: 5}
sensors: [ar0820, opencam]
lights: tl16
cfas: [RGGB, RYNCy]
boxes:
  yellow: {cfa: RYNCy, channel: N, base: Y, to: G, box: {left_nm: [570, 640], left_width_nm: 8, right_nm: [630, 700], right_width_nm: 8}}
constraints: {sensitivity: {min: 0.9}}
search: {space: yellow, starts: 2, max_evaluations: 40}
"""
PART = part_name(0)

pytestmark = pytest.mark.usefixtures("plain_pictures")


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("several")
    with pytest.MonkeyPatch.context() as patch:
        draw_nothing(patch)
        code, out, err = run(folder)
    assert code == 0, err
    assert out.splitlines()[-1] == str(folder / "out" / "few")
    return folder


def run(folder: Path, text: str = SEVERAL, *extra: object) -> tuple[int, str, str]:
    (folder / "few.yaml").write_text(text)
    return commanded("run", folder / "few.yaml", "--output", folder / "out", "--jobs", 1, *extra)


@pytest.fixture
def folder(whole: Path, tmp_path: Path) -> Path:
    """A copy of the finished run; the study lies in the test's own folder."""
    shutil.copytree(whole, tmp_path, dirs_exist_ok=True)
    return tmp_path / "out" / "few"


def contents(folder: Path) -> dict[Path, bytes]:
    return {path.relative_to(folder): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_a_finished_study_is_verified_and_not_computed_again(folder: Path, tmp_path: Path) -> None:
    code, out, _ = commanded("status", folder, "--verify")
    assert code == 0
    assert "finished: 2 of 2 runs finished." in out
    assert f"ok: its {len(Manifest(folder).files)} files are as the run wrote them." in out
    before = contents(folder)
    assert run(tmp_path, SEVERAL, "--quiet") == (0, f"{folder}\n", "")
    assert contents(folder) == before
    assert {MANIFEST, PART, ALL_SENSORS, REPORT, PROVENANCE} <= {str(path) for path in before}


@pytest.mark.parametrize("name", [ALL_SENSORS, PART, REPORT, PROVENANCE])
def test_damage_is_noticed_and_repaired(folder: Path, tmp_path: Path, name: str) -> None:
    before = contents(folder)
    os.truncate(folder / name, (folder / name).stat().st_size // 2)
    code, _, err = commanded("status", folder, "--verify")
    assert (code, "is damaged; `sweep run` of its study makes it again" in err) == (1, True)
    code, _, err = commanded("report", folder)
    assert (code, err.count("\n")) == ((2, 1) if name == ALL_SENSORS else (0, 0))
    code, _, err = run(tmp_path)
    assert (code, err.count("nothing was computed")) == (0, 2)
    assert commanded("status", folder, "--verify")[0] == 0
    for file in (ALL_SENSORS, PART):
        assert (folder / file).read_bytes() == before[Path(file)]


def test_a_changed_study_goes_beside_with_its_own_filters(folder: Path, tmp_path: Path) -> None:
    before = contents(folder)
    code, _, _ = run(tmp_path, SEVERAL.replace("[570, 640]", "[570, 575]"))
    assert (code, list(folder.parent.iterdir())) == (3, [folder])  # infeasible: nothing is left
    code, out, err = run(tmp_path, SEVERAL.replace("0.9", "0.85"))
    assert code == 0
    assert "holds another study of this name (changed" in err
    assert out.splitlines()[-1] == f"{folder}-2"
    assert contents(folder) == before


@pytest.mark.parametrize("runs", [5, [["a"]]])
def test_forged_runs_are_one_line(tmp_path: Path, runs: object) -> None:
    Manifest(tmp_path).begin({"fingerprint": "0" * 64, "runs": runs})
    code, _, err = commanded("report", tmp_path)
    assert (code, err.count("\n")) == (2, 1)


def test_a_changed_value_names_the_folder_and_the_same_command_continues_it(tmp_path: Path) -> None:
    text = SEVERAL.replace("sensors: [ar0820, opencam]", "sensor: ar0820").split("boxes")[0].replace(", RYNCy", "")
    for bits in (8, 10, 8):
        found = run(tmp_path, text, "--set", f"pixel.bits={bits}", "--set", "seed=2", "--quiet")
        assert found == (0, f"{tmp_path}/out/few/pixel.bits={bits},seed=2\n", "")
    assert sorted(path.name for path in (tmp_path / "out" / "few").iterdir()) == [
        f"pixel.bits={bits},seed=2" for bits in (10, 8)
    ]


def test_a_lost_run_is_made_again_alone(folder: Path, tmp_path: Path) -> None:
    before = contents(folder)
    shutil.rmtree(folder / "opencam_tl16")
    assert "opencam tl16: not run." in commanded("status", folder)[1]
    assert commanded("audit", folder)[0] == 2
    code, _, err = run(tmp_path)
    assert (code, err.count("nothing was computed")) == (0, 1)
    again = contents(folder)
    assert all(again[path] == before[path] for path in before if path.suffix == ".parquet")
