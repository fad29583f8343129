"""Rows that a worker writes under a hidden name, and the journal names."""

from __future__ import annotations

import hashlib
import pickle
from pathlib import Path

import pyarrow as pa
import pytest

from sweep.base.errors import OutputError
from sweep.results.journal import Hidden, Journal, Shard
from sweep.results.lock import LOCK, locked
from sweep.results.tables import encoded

KEY = hashlib.sha256(b"some work").hexdigest()
ROWS = 50_000


def table() -> pa.Table:
    status = pa.array(["ok"] * (ROWS - 2) + ["error: no such filter"] * 2).dictionary_encode()
    return pa.table({"design_id": pa.array(range(ROWS)), "status": status})


def test_a_worker_gives_back_the_name_of_what_it_wrote_and_no_rows(tmp_path: Path) -> None:
    journal = Journal(tmp_path)
    shard = Shard.of(table(), 0.25, journal.path(KEY, 3))
    assert isinstance(shard.file, Hidden)
    assert len(pickle.dumps(shard)) < 1000 < len(encoded(table()))
    assert [path.name for path in journal.folder.iterdir()] == [shard.file.path.name]
    assert journal.content(KEY) is None  # not named yet
    journal.save(KEY, 3, shard)
    assert sorted(path.name for path in journal.folder.iterdir()) == [f"00000003-{KEY[:16]}.parquet", "_journal.jsonl"]
    for known in (journal, Journal(tmp_path)):
        assert known.content(KEY) == known.content(KEY, just_kept=True) == encoded(table())
        entry = known.entries[KEY]
        assert (entry.rows, entry.failed, entry.seconds) == (ROWS, 2, 0.25)


def test_bytes_are_kept_as_a_worker_keeps_them(tmp_path: Path) -> None:
    journals = [Journal(tmp_path / name) for name in ("sent", "written")]
    journals[0].save(KEY, 0, Shard.of(table(), 1.0))
    journals[1].save(KEY, 0, Shard.of(table(), 1.0, journals[1].path(KEY, 0)))
    sent, written = (journal.entries[KEY] for journal in journals)
    assert (sent.file, sent.sha256, sent.size, sent.rows) == (written.file, written.sha256, written.size, written.rows)


def test_what_no_longer_has_its_size_is_not_given_back(tmp_path: Path) -> None:
    journal = Journal(tmp_path)
    journal.save(KEY, 0, Shard.of(table(), 1.0))
    path = journal.path(KEY, 0)
    path.write_bytes(path.read_bytes()[:-1])
    assert journal.content(KEY, just_kept=True) is None


def test_a_disk_that_refuses_is_named_by_the_file_that_was_to_be(tmp_path: Path) -> None:
    path = Journal(tmp_path).path(KEY, 0)
    path.parent.write_text("no folder")
    with pytest.raises(OutputError, match=rf"{path.name}: cannot be written") as refused:
        Shard.of(table(), 1.0, path)
    again = pickle.loads(pickle.dumps(refused.value))  # as it comes from a worker
    assert str(again) == str(refused.value)


def test_what_a_worker_wrote_and_nobody_named_is_removed_at_the_end(tmp_path: Path) -> None:
    def stopped() -> None:
        with locked(tmp_path):
            shard = Shard.of(table(), 1.0, Journal(tmp_path).path(KEY, 0))
            assert isinstance(shard.file, Hidden)
            assert shard.file.path.exists()
            raise ValueError("stopped")

    with pytest.raises(ValueError, match="stopped"):
        stopped()
    assert [path.name for path in tmp_path.rglob("*") if path.is_file()] == [LOCK]
