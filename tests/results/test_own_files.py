"""A run replaces, removes and follows only what is its own; a disk that refuses loses nothing that is finished."""

from __future__ import annotations

import errno
import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest

from sweep.base.errors import OutputError
from sweep.features.audit.audit import audit
from sweep.report import make_report, read_output
from sweep.results.answers import ANSWERS
from sweep.results.dataset import rows_in
from sweep.results.identity import run_facts
from sweep.results.lock import LOCK, locked
from sweep.results.manifest import Manifest
from sweep.results.tables import RESULTS, is_drawn, is_of_run
from sweep.runs import output_folder, run_study
from sweep.runs.status import status
from sweep.study import Study, load_study

from ..build import ran, study_file
from ..cases import thinned
from ..conftest import FinishedFolder
from ..mischief import rows

NAMES = (
    *("results.parquet", "curves.parquet", "provenance.json", "designs.parquet", "study.resolved.yaml"),
    *("report.html", "pareto.png", "pareto.svg", "audit.parquet", "paper_comparison.csv", "search.parquet"),
)


@pytest.fixture(scope="module")
def few(tmp_path_factory: pytest.TempPathFactory) -> Study:
    """Twelve designs, no search."""
    path = study_file(tmp_path_factory.mktemp("study"), 3)
    path.write_text(path.read_text().split("constraints:")[0].replace("count: 51", "count: 2"))
    return load_study(path)


@pytest.fixture(scope="module")
def expected(few: Study, tmp_path_factory: pytest.TempPathFactory) -> pd.DataFrame:
    folder = tmp_path_factory.mktemp("expected")
    ran(few, folder, 1)
    return rows(folder)


@pytest.mark.parametrize("name", thinned(NAMES, 4))
def test_a_foreign_file_is_reported_and_stays(few: Study, tmp_path: Path, name: str) -> None:
    base = tmp_path / "tiny"
    (base / name).parent.mkdir(parents=True, exist_ok=True)
    (base / name).write_text("mine")

    with pytest.raises(OutputError, match=f"{name}: file not created by sweep") as caught:
        run_study(few, base, 1, lambda *_: pytest.fail("something was computed"))
    assert len(caught.value.issues) == 1
    assert (base / name).read_text() == "mine"
    folder, note = output_folder(base, run_facts(few))  # the command goes beside it, and says why
    assert folder == tmp_path / "tiny-2"
    assert note is not None
    assert name in note


def outside(tmp_path: Path) -> Path:
    target = tmp_path / "outside"
    target.mkdir()
    (target / "precious.txt").write_text("precious")
    return target


@pytest.mark.usefixtures("plain_pictures")
@pytest.mark.parametrize("name", [LOCK, ANSWERS, RESULTS])
def test_a_link_in_the_place_of_a_run_folder_is_reported(few: Study, tmp_path: Path, name: str) -> None:
    target, folder = outside(tmp_path), tmp_path / "out"
    folder.mkdir()
    (folder / name).symlink_to(target / "precious.txt" if name == LOCK else target)

    def reported() -> None:
        ran(few, folder, 1)
        make_report(read_output(folder))

    with pytest.raises(OutputError, match=f"{name}: (file|folder) not created by sweep"):
        reported()
    assert [path.name for path in target.iterdir()] == ["precious.txt"]
    assert (target / "precious.txt").read_text() == "precious"


def test_a_lock_that_says_something_else_stays(few: Study, tmp_path: Path) -> None:
    for content in (b"my notes", b"process 1 on me\nand more", b"x" * 100_000):
        (tmp_path / LOCK).write_bytes(content)
        with pytest.raises(OutputError, match=f"{LOCK}: file not created by sweep"):
            ran(few, tmp_path, 1)
        assert (tmp_path / LOCK).read_bytes() == content
    (tmp_path / LOCK).unlink()
    os.mkfifo(tmp_path / LOCK)  # opening it would wait for ever
    with pytest.raises(OutputError, match=f"{LOCK}: file not created by sweep"):
        ran(few, tmp_path, 1)


def test_the_folder_itself_may_be_a_link(few: Study, expected: pd.DataFrame, tmp_path: Path) -> None:
    (tmp_path / "disk").mkdir()
    (tmp_path / "out").symlink_to(tmp_path / "disk")
    ran(few, tmp_path / "out", 1)
    pd.testing.assert_frame_equal(rows(tmp_path / "disk"), expected)


@pytest.mark.parametrize("study", ["stopband", pytest.param("distance", marks=pytest.mark.slow)])
def test_names_that_reports_give_are_known(finished: FinishedFolder, study: str) -> None:
    """A picture of a new name is to be added to the names of a run's files."""
    folder = finished(study)
    drawn = [path for path in folder.rglob("*") if path.suffix in (".png", ".svg", ".html")]
    assert {path.name for path in drawn} >= {"report.html"}
    assert all(is_drawn(path.relative_to(folder).as_posix()) for path in drawn)
    assert all(map(is_of_run, Manifest(folder).files))


@pytest.mark.usefixtures("plain_pictures")
def test_a_report_in_use_is_one_line(few: Study, tmp_path: Path) -> None:
    ran(few, tmp_path, 1)
    output = read_output(tmp_path)
    with locked(tmp_path):
        for write in (lambda: ran(few, tmp_path, 1), lambda: make_report(output), lambda: audit(tmp_path, None)):
            with pytest.raises(OutputError, match="in use by another command"):
                write()


def refusing(monkeypatch: pytest.MonkeyPatch, at: int, number: int) -> list[str]:
    """From the `at`-th on, no file takes its name; says which ones asked."""
    requested: list[str] = []
    replaced: Callable[[Path, Path], Path] = Path.replace

    def replace_or_refuse(hidden: Path, path: Path) -> Path:
        requested.append(path.name)
        if len(requested) > at:
            raise OSError(number, os.strerror(number))
        return replaced(hidden, path)

    monkeypatch.setattr(Path, "replace", replace_or_refuse)
    return requested


@pytest.mark.parametrize("step", thinned([9, 1]))
def test_wherever_the_disk_refuses_nothing_finished_is_lost(
    few: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, step: int
) -> None:
    study = replace(few, scenarios={"chart": few.scenarios["chart"]})
    ran(study, tmp_path / "expected", 1)
    with monkeypatch.context() as patch:
        written = refusing(patch, 10**6, 0)
        ran(study, tmp_path / "counted", 1)
    assert len(written) > 15
    for at in range(0, len(written), step):
        folder = tmp_path / f"refused-{at}"
        with monkeypatch.context() as patch:
            refusing(patch, at, (errno.ENOSPC, errno.EROFS)[at % 2])
            with pytest.raises(OutputError, match="cannot be written") as caught:
                ran(study, folder, 1)
        assert len(caught.value.issues) == 1
        assert not list(folder.rglob(".tmp-*"))
        kept, _ = rows_in(folder)
        seen = ran(study, folder, 1)
        counts = [done for phase, done, _ in seen if phase == "designs"]
        assert counts[:1] in ([], [kept])
        assert not (folder / ANSWERS).exists()
        pd.testing.assert_frame_equal(rows(folder), rows(tmp_path / "expected"))
        assert not Manifest(folder).wrong()


@pytest.mark.slow
@pytest.mark.usefixtures("plain_pictures")
def test_a_report_that_the_disk_refuses_loses_no_result(
    few: Study, expected: pd.DataFrame, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    ran(few, tmp_path, 1)
    make_report(read_output(tmp_path))
    with monkeypatch.context() as patch:
        refusing(patch, 2, errno.ENOSPC)
        with pytest.raises(OutputError, match="cannot be written: No space left"):
            make_report(read_output(tmp_path))
    (tmp_path / "report.html").unlink()
    pd.testing.assert_frame_equal(rows(tmp_path), expected)
    with pytest.raises(OutputError, match=r"report\.html: is missing"):
        status(tmp_path)
    make_report(read_output(tmp_path), repair=True)
    assert status(tmp_path, verify=True).lines[-1].startswith("ok")
