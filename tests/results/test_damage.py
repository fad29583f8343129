"""Damaged, foreign and hostile files in the folder of a run: never taken for results, and mended by the same command."""

from __future__ import annotations

import hashlib
import json
import os
import pickle
import shutil
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import pandas as pd
import pyarrow.parquet as pq
import pytest

from sweep.base.errors import OutputError
from sweep.report import make_report, read_output
from sweep.results.answers import ANSWERS
from sweep.results.dataset import part_name, part_paths
from sweep.results.identity import run_facts
from sweep.results.manifest import Manifest
from sweep.runs import output_folder, run_study
from sweep.runs.status import status
from sweep.study import Study, load_study

from ..build import ran, stopband_study, study_file
from ..commanded import COMMANDS, commanded
from ..conftest import draw_nothing
from ..mischief import StoppedError, rows
from ..tampering import listed_anew

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
    cfas="[RGGB, RYYCy, RYNCy]",
)
FIRST, SECOND, PART = map(part_name, range(3))
DRAWN = ("report.html", "pareto.png", "pareto.svg", "paper_comparison.parquet")
FILES = (
    *(
        PART,
        "designs.parquet",
        "pareto.parquet",
        "search.parquet",
        "search_front.parquet",
        "curves.parquet",
        "points.parquet",
    ),
    *("audit.parquet", "study.resolved.yaml", "provenance.json", *DRAWN),
)


def cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def flipped(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[len(content) // 3] ^= 1
    path.write_bytes(content)


def emptied(path: Path) -> None:
    path.write_bytes(b"")


def of_another(path: Path) -> None:
    """Of as many rows, so that only its keys tell that it is of other work."""
    other = path.parent.parent / SECOND
    assert pq.read_metadata(other).num_rows == pq.read_metadata(path).num_rows
    path.write_bytes(other.read_bytes())


def other_bits(path: Path) -> None:
    """A file that PyArrow reads as before, since it does not look at its first bytes."""
    path.write_bytes(b"Q" + path.read_bytes()[1:])


def removed(path: Path) -> None:
    path.unlink()


DAMAGES = (cut, flipped, emptied, removed)
COMPUTED_AGAIN = "was damaged on the disk and is computed again"
FAST = {(PART, flipped), (PART, removed), ("points.parquet", cut), ("report.html", emptied)}


@pytest.fixture(scope="module")
def whole_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a study of every table, and its finished and audited run in `outputs/small`."""
    base = tmp_path_factory.mktemp("whole")
    (base / "small.yaml").write_text(EVERY_TABLE)
    with pytest.MonkeyPatch.context() as patch:
        draw_nothing(patch)
        assert commanded("run", base / "small.yaml", "--output", base / "outputs", "--jobs", 1)[0] == 0
        assert commanded("audit", base / "outputs" / "small")[0] == 0
    assert {*FILES} <= Manifest(base / "outputs" / "small").files.keys()
    return base


@pytest.fixture
def folder(whole_folder: Path, tmp_path: Path) -> Path:
    """A copy of that run; the study lies in the test's own folder."""
    shutil.copytree(whole_folder, tmp_path, dirs_exist_ok=True)
    return tmp_path / "outputs" / "small"


def tables(folder: Path) -> dict[str, bytes]:
    """Rows and tables of a run; an audit goes with rows that are made again."""
    found = [path for path in folder.rglob("*.parquet") if path.is_file() and path.name != "audit.parquet"]
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in found}


@pytest.mark.usefixtures("plain_pictures")
@pytest.mark.parametrize(
    ("file", "damage"),
    [
        pytest.param(file, damage, marks=() if (file, damage) in FAST else pytest.mark.slow)
        for file in FILES
        for damage in DAMAGES
    ]
    + [(FIRST, of_another), (PART, other_bits)],
)
def test_a_damaged_file_is_never_served_and_the_same_command_makes_it_again(
    folder: Path, whole_folder: Path, tmp_path: Path, file: str, damage: Callable[[Path], None]
) -> None:
    damage(folder / file)
    code, _, said = commanded("status", folder, "--verify")
    assert code == 1
    assert [line.split(": ")[1] for line in said.splitlines()] == [str(folder / file)]
    if file == PART:
        for command in ("audit", folder), ("export", folder, "--design", "7"):
            code, out, said = commanded(*command)
            assert command[0] not in COMMANDS or (code, out, "results.parquet" in said) == (2, "", True), command
    elif file not in (*DRAWN, FIRST):
        for command in ("report", folder), ("export", folder, "--design", "best"), ("compare", folder, folder):
            if file != "audit.parquet" or command[0] == "report":
                code, out, said = commanded(*command)
                assert command[0] not in COMMANDS or (code, out, file in said) == (2, "", True), command
    assert commanded("run", tmp_path / "small.yaml", "--output", folder.parent, "--jobs", 1)[0] == 0
    assert tables(folder) == tables(whole_folder / "outputs" / "small")
    if file in (FIRST, PART) and damage is not removed:
        assert COMPUTED_AGAIN in (folder / "provenance.json").read_text()
    assert commanded("status", folder, "--verify")[0] == 0


def test_an_output_that_cannot_be_written_is_one_line(plain: Study, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    for folder in (tmp_path / "file" / "out", Path("/proc/nothing"), tmp_path / ("long" * 100)):
        assert output_folder(folder, run_facts(plain)) == (folder, None)
        with pytest.raises(OutputError, match="cannot be written"):
            ran(plain, folder, 1)


def test_a_run_of_another_version_names_it(folder: Path) -> None:
    facts = json.loads((folder / "provenance.json").read_text()) | {"model_version": "20"}
    (folder / "provenance.json").write_text(json.dumps(facts))
    listed_anew(folder)
    with pytest.raises(OutputError, match="model_version: made by another version"):
        read_output(folder)


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Study:
    path = study_file(tmp_path_factory.mktemp("study"), 2)
    text = path.read_text().replace("count: 51", "count: 2").replace("max_evaluations: 200", "max_evaluations: 12")
    path.write_text(text)
    return load_study(path)


@pytest.fixture(scope="module")
def expected(small: Study, tmp_path_factory: pytest.TempPathFactory) -> pd.DataFrame:
    folder = tmp_path_factory.mktemp("expected")
    ran(small, folder, 1)
    return rows(folder)


def interrupted(study: Study, folder: Path) -> list[Path]:
    """Parts of a run that was broken off: rows and answers of the search."""

    def stop(phase: str, done: int, _: int) -> None:
        if phase == "designs" and done and len(part_paths(folder)) > 1:
            raise StoppedError

    with pytest.raises(StoppedError):
        run_study(study, folder, 1, stop)
    parts, answers = part_paths(folder), sorted((folder / ANSWERS).iterdir())
    assert parts
    assert answers
    return [*parts, *answers]


def planted(path: Path, content: bytes) -> None:
    """Other content in the place of a part, or of an answer with its right digest."""
    digest = hashlib.sha256(path.stem.encode() + content).hexdigest().encode() + b"\n"
    path.write_bytes(content if path.suffix == ".parquet" else digest + content)


class Bomb:
    def __reduce__(self) -> tuple[Any, ...]:
        return os.system, ("touch ran-something",)


def pickles(path: Path, _: Path, __: int) -> None:
    planted(path, pickle.dumps(Bomb()))


def links(path: Path, outside: Path, _: int) -> None:
    path.unlink()
    path.symlink_to(outside)


def pipes(path: Path, _: Path, __: int) -> None:
    path.unlink()
    os.mkfifo(path)


def exchanges(path: Path, _: Path, at: int) -> None:
    """The last part, which the list does not name yet, has the rows of the first, as many."""
    if at and path.suffix == ".parquet":
        path.write_bytes(part_paths(path.parent.parent)[0].read_bytes())


def terabytes(path: Path, _: Path, __: int) -> None:
    """The first of a folder: to read as much of one as is allowed takes a second."""
    if path == min(path.parent.iterdir()):
        with suppress(OSError):  # a disk that has no holes in files
            os.truncate(path, 2**40)


@pytest.mark.parametrize("attack", [pickles, links, pipes, exchanges, terabytes])
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
    names = ("../outside", f"{outside}", "results.parquet/../../outside")
    Manifest(folder).add(dict.fromkeys(names, hashlib.sha256(b"precious").hexdigest()))
    make_report(read_output(folder))
    cut(folder / part_name(0))
    ran(small, folder, 1)
    make_report(read_output(folder))
    assert outside.read_text() == "precious"
    assert status(folder, verify=True).lines[-1].startswith("ok")
