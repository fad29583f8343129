"""Damaged, foreign and hostile files in the folder of a run: never taken for results, and mended by the same command."""

from __future__ import annotations

import hashlib
import json
import os
import pickle
import shutil
import subprocess
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from sweep.base.errors import OutputError
from sweep.cli.status import status_of
from sweep.report import make_report, read_output
from sweep.results.identity import run_facts
from sweep.results.inventory import Inventory
from sweep.results.parts import PARTS, Parts
from sweep.results.tables import RUN, SUMS
from sweep.run import output_folder, run_study
from sweep.study import Study, load_study

from ..build import ran, stopband_study, study_file
from ..commanded import commanded
from ..conftest import draw_nothing
from ..mischief import StoppedError, half_done, rows
from ..tampering import hostile, listed_anew

EVERY_TABLE = stopband_study(
    "small",
    "{left_nm: [590, 600, 610], left_width_nm: 5, right_nm: {min: 640, max: 690, count: 51}, right_width_nm: 5}",
    before="scenarios:\n  chart: {exposure: {kind: white_patch}, noise: true}\npixel: {read_noise_e: 2}\n",
    after="""\
constraints: {sensitivity: {min: 0.9}}
search: {starts: 1, max_evaluations: 20, front: {min: 0.8, max: 0.9, count: 2}}
recognition: {states: [green, yellow, red]}
published: {Table 2: {RGGB: {csd_yellow_red: 138}}}
""",
)
TABLES = ("results", "search", "front", "curves", "points")
FILES = (
    *(f"{name}.parquet" for name in (*TABLES, "audit", "paper_comparison")),
    *("study.resolved.yaml", "provenance.json", "report.html", "pareto.png", "figures/sensor.svg", SUMS),
)
DRAWN = ("report.html", "pareto.png", "figures/sensor.svg", "paper_comparison.parquet")


def cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def flipped(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[len(content) // 3] ^= 1
    path.write_bytes(content)


def emptied(path: Path) -> None:
    path.write_bytes(b"")


DAMAGES = (cut, flipped, emptied)
FAST = {("results.parquet", flipped), ("points.parquet", cut), ("report.html", emptied)}


@pytest.fixture(scope="module")
def whole_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a study of every table, and its finished and audited run in `outputs/small`."""
    base = tmp_path_factory.mktemp("whole")
    (base / "small.yaml").write_text(EVERY_TABLE)
    with pytest.MonkeyPatch.context() as patch:
        draw_nothing(patch)
        assert commanded("run", base / "small.yaml", "--output", base / "outputs", "--jobs", 1)[0] == 0
        assert commanded("audit", base / "outputs" / "small")[0] == 0
    assert {*FILES, RUN} <= {*Inventory(base / "outputs" / "small").files, SUMS}
    return base


def same_tables(folder: Path, other: Path) -> bool:
    return all((folder / f"{name}.parquet").read_bytes() == (other / f"{name}.parquet").read_bytes() for name in TABLES)


@pytest.mark.usefixtures("plain_pictures")
@pytest.mark.parametrize(
    ("file", "damage"),
    [
        pytest.param(file, damage, marks=() if (file, damage) in FAST else pytest.mark.slow)
        for file in FILES
        for damage in DAMAGES
    ],
)
def test_a_damaged_file_is_never_served_and_the_same_command_makes_it_again(
    whole_folder: Path, tmp_path: Path, file: str, damage: Callable[[Path], None]
) -> None:
    shutil.copytree(whole_folder, tmp_path, dirs_exist_ok=True)
    folder = tmp_path / "outputs" / "small"
    damage(folder / file)
    code, _, said = commanded("status", folder, "--verify")
    assert code == 2
    if file != SUMS:
        assert [line.split(": ")[1] for line in said.splitlines()] == [str(folder / file)]
    if file not in (*DRAWN, SUMS):
        for command in ("report", folder), ("export", folder, "--design", "best"), ("compare", folder, folder):
            if file != "audit.parquet" or command[0] == "report":
                code, out, said = commanded(*command)
                assert (code, out) == (2, ""), command
                assert file in said
    assert commanded("run", tmp_path / "small.yaml", "--output", folder.parent, "--jobs", 1)[0] == 0
    assert same_tables(folder, whole_folder / "outputs" / "small")
    assert commanded("status", folder, "--verify")[0] == 0
    assert not (folder / PARTS).exists()


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_run_whose_run_json_is_damaged_is_read_with_a_note_and_repaired(
    whole_folder: Path, tmp_path: Path, damage: Callable[[Path], None]
) -> None:
    shutil.copytree(whole_folder, tmp_path, dirs_exist_ok=True)
    folder = tmp_path / "outputs" / "small"
    damage(folder / RUN)
    code, _, said = commanded("status", folder)
    assert (code, said.count("\n"), "run.json: is damaged; `sweep run`" in said) == (2, 1, True)
    for command in ("report", folder), ("export", folder, "--design", "best"), ("compare", folder, folder):
        code, out, _ = commanded(*command)
        assert (code, f"Note: not verified, since lists of {folder} are damaged: run.json;" in out) == (0, True), (
            command
        )
    code, _, said = commanded("run", tmp_path / "small.yaml", "--output", folder.parent, "--jobs", 1)
    assert (code, "nothing was computed" in said) == (0, True)
    assert same_tables(folder, whole_folder / "outputs" / "small")
    code, out, _ = commanded("status", folder, "--verify")
    assert (code, "ok: its" in out) == (0, True)
    assert RUN in Inventory(folder).files


@pytest.mark.usefixtures("plain_pictures")
def test_an_emptied_list_hides_no_finished_run(whole_folder: Path, tmp_path: Path) -> None:
    shutil.copytree(whole_folder, tmp_path, dirs_exist_ok=True)
    folder = tmp_path / "outputs" / "small"
    emptied(folder / SUMS)
    code, out, _ = commanded("export", folder, "--design", "best")
    assert (code, "Note: not verified" in out, "results.parquet" in out) == (0, True, True)
    assert commanded("run", tmp_path / "small.yaml", "--output", folder.parent, "--jobs", 1)[0] == 0
    assert same_tables(folder, whole_folder / "outputs" / "small")
    assert commanded("status", folder, "--verify")[0] == 0
    assert RUN in Inventory(folder).files


@pytest.mark.usefixtures("plain_pictures")
@pytest.mark.parametrize(
    ("name", "other"), [("figures/chart.png", "figures/other.png"), ("pareto.png", "pareto-9.png")]
)
def test_a_renamed_entry_of_the_list_loses_no_figure(whole_folder: Path, tmp_path: Path, name: str, other: str) -> None:
    shutil.copytree(whole_folder, tmp_path, dirs_exist_ok=True)
    folder = tmp_path / "outputs" / "small"
    before = (folder / SUMS).read_text()
    assert before.count(f"  {name}\n") == 1
    (folder / SUMS).write_text(before.replace(f"  {name}\n", f"  {other}\n"))
    assert commanded("status", folder, "--verify")[0] == 2
    assert commanded("run", tmp_path / "small.yaml", "--output", folder.parent, "--jobs", 1)[0] == 0
    assert (folder / name).read_bytes()
    assert commanded("status", folder, "--verify")[0] == 0
    assert Inventory(folder).files.keys() == {line.split()[1] for line in before.splitlines()}


def test_a_run_of_which_nothing_is_known_is_not_touched(whole_folder: Path, tmp_path: Path) -> None:
    shutil.copytree(whole_folder, tmp_path, dirs_exist_ok=True)
    folder = tmp_path / "outputs" / "small"
    for name in (RUN, SUMS, "provenance.json"):
        emptied(folder / name)
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    for command in ("status", folder), ("report", folder), ("run", tmp_path / "small.yaml", "--output", folder.parent):
        code, _, said = commanded(*command)
        assert (code, said.count("\n")) == (2, 1)
        assert "run.json: is damaged, so that nothing is known of the run" in said
    assert {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()} == before


def test_parts_whose_names_are_swapped_are_computed_again(plain: Study, whole: pd.DataFrame, tmp_path: Path) -> None:
    parts = half_done(plain, tmp_path).paths("parquet")
    first, second = parts[:2]
    keys, digests = zip(*(path.stem.split("-") for path in (first, second)), strict=True)
    assert len({*keys}) == len({*digests}) == 2
    first.rename(first.with_name("kept"))
    second.rename(second.with_name(f"{keys[0]}-{digests[1]}.parquet"))
    first.with_name("kept").rename(first.with_name(f"{keys[1]}-{digests[0]}.parquet"))
    ran(plain, tmp_path, 1)
    pd.testing.assert_frame_equal(rows(tmp_path), whole)
    assert (tmp_path / "provenance.json").read_text().count("was damaged on the disk and is computed again") == 2


def test_the_list_of_digests_is_in_the_form_of_sha256sum(whole_folder: Path) -> None:
    folder = whole_folder / "outputs" / "small"
    done = subprocess.run(["sha256sum", "--strict", "-c", SUMS], cwd=folder, capture_output=True, check=False)
    assert done.returncode == 0, done.stderr
    assert len(done.stdout.splitlines()) == len(Inventory(folder).files) > 15


@pytest.mark.usefixtures("plain_pictures")
def test_an_intact_run_is_not_touched_again(whole_folder: Path, tmp_path: Path) -> None:
    shutil.copytree(whole_folder, tmp_path, dirs_exist_ok=True)
    folder = tmp_path / "outputs" / "small"
    before = {path: path.stat().st_mtime_ns for path in folder.rglob("*") if path.is_file() and path.name != ".lock"}
    code, _, said = commanded("run", tmp_path / "small.yaml", "--output", folder.parent, "--jobs", 1)
    assert (code, "nothing was computed" in said) == (0, True)
    assert {p: p.stat().st_mtime_ns for p in folder.rglob("*") if p.is_file() and p.name != ".lock"} == before


def test_a_cut_study_says_how_to_mend_it(whole_folder: Path, tmp_path: Path) -> None:
    shutil.copytree(whole_folder, tmp_path, dirs_exist_ok=True)
    folder = tmp_path / "outputs" / "small"
    path = folder / "study.resolved.yaml"
    path.write_text(path.read_text().split("objective:")[0])
    listed_anew(folder)
    with pytest.raises(OutputError, match="lacks objective; delete it, and `sweep run` of the study makes it again"):
        read_output(folder)


def test_damaged_parts_are_computed_again_and_named(plain: Study, whole: pd.DataFrame, tmp_path: Path) -> None:
    parts = half_done(plain, tmp_path)
    large = [path for path in parts.paths("parquet") if path.stat().st_size > 10_000]
    flipped(large[0])
    cut(large[1])
    (tmp_path / PARTS / ".tmp-1-0123456789abcdef.parquet").write_bytes(b"x")
    ran(plain, tmp_path, 1)
    pd.testing.assert_frame_equal(rows(tmp_path), whole)
    assert (tmp_path / "provenance.json").read_text().count("was damaged on the disk and is computed again") == 2
    assert not (tmp_path / PARTS).exists()


def test_an_output_that_cannot_be_written_is_one_line(plain: Study, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    for folder in (tmp_path / "file" / "out", Path("/proc/nothing"), tmp_path / ("long" * 100)):
        assert output_folder(folder, run_facts(plain)) == (folder, None)
        with pytest.raises(OutputError, match="cannot be written"):
            ran(plain, folder, 1)


def test_a_run_of_another_version_names_it(whole_folder: Path, tmp_path: Path) -> None:
    shutil.copytree(whole_folder, tmp_path, dirs_exist_ok=True)
    folder = tmp_path / "outputs" / "small"
    facts = json.loads((folder / "provenance.json").read_text()) | {"model_version": "20"}
    (folder / "provenance.json").write_text(json.dumps(facts))
    listed_anew(folder)
    with pytest.raises(OutputError, match=r"model_version: made by another version of sweep \(got '20'\)"):
        read_output(folder)


def test_without_run_json_files_of_a_run_s_names_are_others(whole_folder: Path, tmp_path: Path) -> None:
    shutil.copytree(whole_folder, tmp_path, dirs_exist_ok=True)
    folder = tmp_path / "outputs" / "small"
    for name in (RUN, SUMS):
        (folder / name).unlink()
    study = load_study(tmp_path / "small.yaml")
    assert output_folder(folder, run_facts(study))[0] == folder.with_name("small-2")
    with pytest.raises(OutputError, match="file not created by sweep"):
        run_study(study, folder, 1, lambda *_: pytest.fail("something was computed"))
    assert commanded("status", folder)[0] == 2


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Study:
    path = study_file(tmp_path_factory.mktemp("study"), 2)
    text = path.read_text().replace("count: 51", "count: 2").replace("max_evaluations: 200", "max_evaluations: 12")
    path.write_text(text.replace("  dim: {exposure: {kind: fixed, exposure_s: 0.002}}\n", ""))
    return load_study(path)


@pytest.fixture(scope="module")
def expected(small: Study, tmp_path_factory: pytest.TempPathFactory) -> pd.DataFrame:
    folder = tmp_path_factory.mktemp("expected")
    ran(small, folder, 1)
    return rows(folder)


def interrupted(study: Study, folder: Path) -> list[Path]:
    """Parts of a run that was broken off: rows and answers of the search."""

    def stop(phase: str, done: int, _: int) -> None:
        if phase == "designs" and done >= 3:
            raise StoppedError

    with pytest.raises(StoppedError):
        run_study(study, folder, 1, stop)
    parts = sorted((folder / PARTS).iterdir())
    assert {path.suffix for path in parts} == {".json", ".parquet"}
    return parts


def planted(path: Path, content: bytes) -> None:
    """Other content under a part's key, with its right digest."""
    path.unlink()
    key = path.name.split("-")[0]
    digest = hashlib.sha256(key.encode() + content).hexdigest()[:32]
    path.with_name(f"{key}-{digest}{path.suffix}").write_bytes(content)


class Bomb:
    def __reduce__(self) -> tuple[Any, ...]:
        return os.system, ("touch ran-something",)


def pickles(path: Path, _: Path, __: int) -> None:
    planted(path, pickle.dumps(Bomb()))


def other_content(path: Path, _: Path, at: int) -> None:
    contents = hostile()
    planted(path, contents[at % len(contents)])


def links(path: Path, outside: Path, _: int) -> None:
    path.unlink()
    path.symlink_to(outside)


def pipes(path: Path, _: Path, __: int) -> None:
    path.unlink()
    os.mkfifo(path)


def terabytes(path: Path, _: Path, __: int) -> None:
    with suppress(OSError):  # a disk that has no holes in files
        os.truncate(path, 2**40)


@pytest.mark.parametrize("attack", [pickles, other_content, links, pipes, terabytes])
def test_hostile_parts_run_nothing_and_give_the_right_rows(
    small: Study,
    expected: pd.DataFrame,
    tmp_path: Path,
    attack: Callable[[Path, Path, int], None],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    outside, folder = tmp_path / "outside", tmp_path / "out"
    outside.write_text("precious")
    for at, part in enumerate(interrupted(small, folder)):
        attack(part, outside, at)
    ran(small, folder, 1)
    pd.testing.assert_frame_equal(rows(folder), expected)
    assert outside.read_text() == "precious"
    assert not (tmp_path / "ran-something").exists()


def test_names_in_the_list_that_lead_out_of_the_folder_are_not_followed(small: Study, tmp_path: Path) -> None:
    outside, folder = tmp_path / "outside", tmp_path / "out"
    outside.write_text("precious")
    ran(small, folder, 1)
    digest = hashlib.sha256(b"precious").hexdigest()
    with (folder / SUMS).open("a") as sums:
        sums.write(f"{digest}  ../outside\n{digest}  {outside}\n{digest}  figures/../../outside\n\xff")
    assert not [name for name in Inventory(folder).files if "outside" in name]
    make_report(read_output(folder))
    assert outside.read_text() == "precious"
    assert status_of(folder, verify=True).lines[-1].startswith("ok")


def test_a_link_for_the_folder_of_parts_is_refused(small: Study, tmp_path: Path) -> None:
    folder, elsewhere = tmp_path / "out", tmp_path / "elsewhere"
    folder.mkdir()
    elsewhere.mkdir()
    (folder / PARTS).symlink_to(elsewhere)
    with pytest.raises(OutputError, match=f"{PARTS}: folder not created by sweep"):
        Parts(folder)
    with pytest.raises(OutputError, match=f"{PARTS}: folder not created by sweep"):
        ran(small, folder, 1)
    assert list(elsewhere.iterdir()) == []
