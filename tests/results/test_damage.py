"""Damaged files in the folder of a run: named in a line, and mended by the same command."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pyarrow.parquet as pq
import pytest

from sweep.base.errors import OutputError
from sweep.commands.status import status_lines
from sweep.report import read_output
from sweep.results.journal import SHARDS, Journal
from sweep.run import output_folder
from sweep.run.rows import rules_of
from sweep.run.stop import Stop
from sweep.run.sweep import Sweep
from sweep.run.workers import Workers
from sweep.study import Study

from ..build import ran
from ..mischief import half_done, rows
from ..tampering import listed_anew


@pytest.fixture(scope="module")
def finished(plain: Study, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("finished")
    ran(plain, folder, 1)
    return folder


def cut(content: bytes) -> bytes:
    return content[: len(content) // 2]


def without_trade_off(content: bytes) -> bytes:
    return content.replace(b"trade_off", b"trade_of")


@pytest.mark.parametrize(
    ("file", "damage", "computed"),
    [
        ("results.parquet", cut, True),
        pytest.param("curves.parquet", cut, False, marks=pytest.mark.slow),
        pytest.param("points.parquet", None, False, marks=pytest.mark.slow),
        pytest.param("provenance.json", cut, False, marks=pytest.mark.slow),
        pytest.param("provenance.json", without_trade_off, False, marks=pytest.mark.slow),
        pytest.param("study.resolved.yaml", None, False, marks=pytest.mark.slow),
    ],
)
def test_a_damaged_result_is_one_line_and_the_same_command_mends_it(
    plain: Study,
    whole: pd.DataFrame,
    finished: Path,
    tmp_path: Path,
    file: str,
    damage: Callable[[bytes], bytes] | None,
    computed: bool,
) -> None:
    folder = tmp_path / "out"
    shutil.copytree(finished, folder)
    if damage is None:
        (folder / file).unlink()
    else:
        (folder / file).write_bytes(damage((folder / file).read_bytes()))
    for look in (status_lines, read_output):
        with pytest.raises(OutputError, match=file):
            look(folder)
    seen = ran(plain, folder, 1)
    assert any(phase == "designs" for phase, *_ in seen) == computed  # what stands in the table is not computed again
    pd.testing.assert_frame_equal(rows(folder), whole)
    read_output(folder)
    assert status_lines(folder)[0].startswith("finished")


def test_a_cut_study_says_how_to_mend_it(plain: Study, finished: Path, tmp_path: Path) -> None:
    folder = tmp_path / "out"
    shutil.copytree(finished, folder)
    path = folder / "study.resolved.yaml"
    path.write_text(path.read_text().split("objective:")[0])
    listed_anew(folder)
    with pytest.raises(OutputError, match="lacks objective; delete it, and `sweep run` of the study makes it again"):
        read_output(folder)
    path.unlink()
    ran(plain, folder, 1)
    read_output(folder)


def test_a_finished_run_gives_its_chunks_back(plain: Study, tmp_path: Path) -> None:
    named = next(space for space in plain.spaces if space.kind == "design")
    best = replace(named, axes=((606.0,), (5.0,), (690.0,), (5.0,), (1.0,)))  # dominates swept designs
    study = replace(plain, spaces=tuple(best if space is named else space for space in plain.spaces))
    journal = half_done(study, tmp_path)
    kept = {entry.key: pq.read_table(tmp_path / SHARDS / entry.file) for entry in journal.entries.values()}
    ran(study, tmp_path, 1)
    study, journal = study.with_plans(), Journal(tmp_path)
    sweep = Sweep(study, rules_of(study), journal, Workers(1, Stop()))
    sweep.refill(tmp_path / "results.parquet")
    whole = pq.read_table(tmp_path / "results.parquet")
    fewer = 0
    for key, table in kept.items():
        again = journal.table(key, table.schema, table.num_rows)
        assert again is not None
        assert again.equals(table)
        ids = table["design_id"].to_pylist()
        fewer += sum(table["pareto"].to_pylist()) - sum(whole["pareto"].to_pylist()[ids[0] : ids[-1] + 1])
    assert fewer > 0


def test_damaged_shards_are_computed_again_and_named(plain: Study, whole: pd.DataFrame, tmp_path: Path) -> None:
    journal = half_done(plain, tmp_path)
    large = [tmp_path / SHARDS / entry.file for entry in journal.entries.values() if entry.rows > 1000]
    content = bytearray(large[0].read_bytes())
    content[len(content) // 2] ^= 0xFF
    large[0].write_bytes(content)
    large[1].write_bytes(large[1].read_bytes()[:-7])
    (tmp_path / SHARDS / ".tmp-1-00000007-0123456789abcdef.parquet").write_bytes(b"x")
    ran(plain, tmp_path, 1)
    pd.testing.assert_frame_equal(rows(tmp_path), whole)
    said = (tmp_path / "provenance.json").read_text()
    assert said.count("was damaged on the disk and is computed again") == 1  # the torn one was missed from the start
    assert not (tmp_path / SHARDS).exists()


@pytest.mark.slow
@pytest.mark.parametrize("cut", [1, 20, 200])
def test_a_torn_journal_costs_its_last_line_alone(plain: Study, whole: pd.DataFrame, tmp_path: Path, cut: int) -> None:
    known = len(half_done(plain, tmp_path).entries)
    path = tmp_path / SHARDS / "_journal.jsonl"
    path.write_bytes(path.read_bytes()[:-cut])
    left = len(Journal(tmp_path).entries)
    assert left == (known if cut == 1 else known - 1)
    ran(plain, tmp_path, 1)
    pd.testing.assert_frame_equal(rows(tmp_path), whole)


def test_an_output_that_cannot_be_written_is_one_line(plain: Study, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    for folder in (tmp_path / "file" / "out", Path("/proc/nothing"), tmp_path / ("long" * 100)):
        assert output_folder(folder, plain) == (folder, None)
        with pytest.raises(OutputError, match="cannot be written"):
            ran(plain, folder, 1)


@pytest.mark.slow
def test_other_folders_beside_the_chunks_stay(plain: Study, whole: pd.DataFrame, tmp_path: Path) -> None:
    (tmp_path / SHARDS / ".ipynb_checkpoints").mkdir(parents=True)
    ran(plain, tmp_path, 1)
    pd.testing.assert_frame_equal(rows(tmp_path), whole)
    assert [path.name for path in (tmp_path / SHARDS).iterdir()] == [".ipynb_checkpoints"]
