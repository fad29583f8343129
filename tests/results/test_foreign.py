"""What a run's folder holds beside the run: named, never read as its own, never deleted; and readers of others."""

from __future__ import annotations

import errno
import fcntl
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pandas as pd
import pyarrow.dataset as ds
import pytest

import sweep
from sweep.results import lock
from sweep.results.lock import in_use, locked
from sweep.results.manifest import Manifest
from sweep.results.tables import MANIFEST, PROVENANCE, REPORT
from sweep.runs import run_study
from sweep.runs.workers import workers
from sweep.study import load_study

from ..build import study_file
from ..commanded import commanded
from ..conftest import draw_nothing
from ..late import Late

duckdb, polars = Late("duckdb"), Late("polars")

STRANGE = ("part-00000000 (1).parquet", "extra.parquet", "kind=x/a.parquet", ".hidden.parquet", "part-00000009.parquet")
READERS: dict[str, Callable[[Path], int]] = {
    "pandas": lambda path: len(pd.read_parquet(path)),
    "pyarrow": lambda path: ds.dataset(path).count_rows(),
    "polars": lambda path: polars.read_parquet(path).height,
    "DuckDB": lambda path: len(duckdb.sql(f"select design_id from '{path}/*.parquet'").fetchall()),
}


@pytest.fixture(scope="module")
def finished_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study without a search, and its finished run in `outputs/tiny`."""
    base = tmp_path_factory.mktemp("finished")
    study = study_file(base, 2)
    study.write_text(study.read_text().split("constraints:")[0].replace("count: 51", "count: 2"))
    with pytest.MonkeyPatch.context() as patch:
        draw_nothing(patch)
        assert commanded("run", study, "--output", base / "outputs", "--jobs", 1)[0] == 0
    return base


@pytest.fixture
def base(finished_run: Path, tmp_path: Path) -> Path:
    shutil.copytree(finished_run, tmp_path, dirs_exist_ok=True)
    return tmp_path


@pytest.mark.usefixtures("plain_pictures")
def test_what_a_reader_takes_for_rows_is_named_and_stays(base: Path) -> None:
    folder = base / "outputs" / "tiny"
    rows, before = folder / "results.parquet", len(sweep.read_run(folder).table)
    for name in STRANGE:
        (rows / name).parent.mkdir(exist_ok=True)
        shutil.copy(rows / "part-00000000.parquet", rows / name)
    (rows / ".DS_Store").write_bytes(b"read by nobody")
    code, out, _ = commanded("status", folder)
    assert (code, out.count("is not of this run")) == (0, len(STRANGE))
    code, _, err = commanded("status", "--verify", folder)
    assert (code, {line.split(": ")[1] for line in err.splitlines()}) == (1, {str(rows / name) for name in STRANGE})
    code, _, err = commanded("run", base / "tiny.yaml", "--output", base / "outputs")
    assert (code, err.count("is not of this run")) == (0, len(STRANGE))
    assert all((rows / name).exists() for name in STRANGE)
    with pytest.warns(UserWarning, match="is not of this run"):
        assert len(sweep.read_run(folder).table) == before


def test_readers_of_others_read_a_folder_at_any_moment(tmp_path: Path) -> None:
    study, folder, counts = load_study(study_file(tmp_path, 2)), tmp_path / "out", list[set[int]]()

    def read(phase: str, done: int, _: int) -> None:
        rows = folder / "results.parquet"
        if phase == "designs" and done and any(rows.glob("*.parquet")):
            (folder / ".tmp-1-part-00000077.parquet~").write_bytes(b"half of a file of a killed run")
            counts.append({reader(rows) for reader in READERS.values()})

    run_study(study, folder, 1, read)
    assert len(counts) > 1
    assert all(len(of_readers) == 1 for of_readers in counts)
    assert not list(folder.rglob(".tmp-*"))


@pytest.mark.usefixtures("plain_pictures")
@pytest.mark.parametrize("damage", [b"", b"{", None])
def test_a_damaged_list_is_told_and_written_again(base: Path, damage: bytes | None) -> None:
    folder = base / "outputs" / "tiny"
    path = folder / MANIFEST
    before = path.read_bytes()
    path.write_bytes(before.replace(b"fingerprint", b"fingerprinu", 1) if damage is None else damage)
    code, out, _ = commanded("status", folder)
    assert (code, f"{path} is damaged" in out) == (0, True)
    assert commanded("status", "--verify", folder)[0] == 1
    with pytest.warns(UserWarning, match="is damaged"):
        assert len(sweep.read_run(folder).table) > 0
    code, _, err = commanded("run", base / "tiny.yaml", "--output", base / "outputs")
    assert (code, "was damaged, and is written again" in err, "nothing was computed" in err) == (0, True, True)
    assert commanded("status", "--verify", folder)[0] == 0
    path.write_bytes(b"")
    (folder / PROVENANCE).unlink()  # nothing tells which run it is: not touched
    for command in ("status", folder), ("run", base / "tiny.yaml", "--output", base / "outputs"):
        assert commanded(*command)[0] == 2
    assert path.read_bytes() == b""


@pytest.mark.usefixtures("plain_pictures")
def test_a_lost_report_is_told(base: Path) -> None:
    folder = base / "outputs" / "tiny"
    Manifest(folder).remove([REPORT])
    code, out, _ = commanded("status", folder)
    assert (code, "sweep report" in out) == (0, True)
    code, _, err = commanded("status", "--verify", folder)
    assert (code, f"{REPORT}: is not drawn" in err) == (1, True)


def test_an_unfinished_run_says_so(base: Path) -> None:
    folder = base / "outputs" / "tiny"
    Manifest(folder).remove([PROVENANCE])
    with pytest.raises(sweep.SweepError, match="interrupted"):
        sweep.read_run(folder)
    with locked(folder), pytest.raises(sweep.SweepError, match="goes on"):
        sweep.read_run(folder)


def test_a_lock_is_held_only_if_it_is_held(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(*_: object) -> None:
        raise OSError(errno.EROFS, "Read-only file system")

    with locked(tmp_path):
        pass
    monkeypatch.setattr(lock, "_acquired", refused)
    assert not in_use(tmp_path)
    with (tmp_path / lock.LOCK).open() as held:
        fcntl.flock(held, fcntl.LOCK_EX)
        assert in_use(tmp_path)


@pytest.mark.skipif(not os.access("/dev/shm", os.W_OK), reason="no shared memory here")
def test_what_others_left_stays(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tempfile.gettempdir", lambda: str(tmp_path))
    dead = subprocess.Popen([sys.executable, "-c", ""])
    dead.wait()
    left = [
        Path("/dev/shm") / f"sem.loky-{dead.pid}-a1b2",  # of another host or container, perhaps, that has this number
        tmp_path / f"joblib_memmapping_folder_{dead.pid}_x",
        tmp_path / "sweep-abcd",
    ]
    try:
        left[0].touch()
        for folder in left[1:]:
            folder.mkdir()
        with workers(1):
            pass
        assert all(path.exists() for path in left)
        assert len(list(tmp_path.iterdir())) == len(left) - 1
    finally:
        left[0].unlink(missing_ok=True)
