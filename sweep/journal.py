"""Finished work of a run that is not whole yet: shards of rows and kept answers, listed in a journal.

A shard is written to a hidden file, synced and renamed; then a line of the journal names it with the SHA-256 of its
bytes, and is synced. What the journal does not list, or what no longer has its digest, is computed again.
"""

from __future__ import annotations

import fcntl
import hashlib
import json
import os
import pickle
import socket
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from .errors import Fault, OutputError
from .store import encoded, holds, write_bytes

SHARDS = "shards"
_JOURNAL = "_journal.jsonl"
"""Readers of Parquet folders skip names that begin so."""
LOCK = ".lock"
_ATTEMPTS, _PAUSE_S = 5, 0.02


@dataclass(frozen=True)
class Entry:
    """A finished piece of work: `key` says what it is, `sha256` and `size` what its file holds.

    `failed`: rows with a fault; `at`: seconds since 1970.
    """

    key: str
    file: str
    sha256: str
    size: int
    rows: int
    failed: int
    seconds: float
    at: float


@dataclass(frozen=True)
class Shard:
    """Finished rows as a Parquet file's bytes: how many, how many of them failed, and the seconds that they took."""

    content: bytes
    rows: int
    failed: int
    seconds: float

    @staticmethod
    def of(table: pa.Table, seconds: float) -> Shard:
        """A table, encoded."""
        failed = int(np.count_nonzero(~holds(table, "status", "ok")))
        return Shard(encoded(table), table.num_rows, failed, seconds)

    def table(self) -> pa.Table:
        """The rows."""
        return pq.read_table(pa.BufferReader(self.content))


class Journal:
    """The finished work in the folder of a run, as far as this process knows it."""

    def __init__(self, output: Path) -> None:
        self.folder = output / SHARDS
        self.entries: dict[str, Entry] = {}
        self._torn = False
        self._read()

    def _read(self) -> None:
        """Every whole line; a later one replaces an earlier one of its key. A line that a kill cut is ignored."""
        path = self.folder / _JOURNAL
        if not path.is_file():
            return
        try:
            content = path.read_bytes()
        except OSError as error:
            raise OutputError(Fault(f"cannot be read: {error.strerror or error}", str(path))) from None
        self._torn = bool(content) and not content.endswith(b"\n")
        for line in content.splitlines():
            try:
                entry = Entry(**json.loads(line))
            except (ValueError, TypeError):
                continue
            self.entries[entry.key] = entry

    def check(self) -> None:
        """Forget what is missing or has another size; a file of the right size is checked when it is used."""
        sizes = {item.name: item.stat().st_size for item in os.scandir(self.folder)} if self.folder.is_dir() else {}
        self.entries = {key: entry for key, entry in self.entries.items() if sizes.get(entry.file) == entry.size}

    def save(self, key: str, index: int, shard: Shard) -> None:
        """Keep finished rows under `key`; raises OutputError when the disk refuses."""
        self._keep(key, f"{index:08d}-{key[:16]}.parquet", shard.content, shard.rows, shard.failed, shard.seconds)

    def keep(self, key: str, answer: object, seconds: float) -> None:
        """Keep any finished answer under `key`; errors as for `save`."""
        self._keep(key, f"_answer-{key[:16]}.pickle", pickle.dumps(answer), 0, 0, seconds)

    def table(self, key: str, schema: pa.Schema) -> pa.Table | None:
        """The table kept under `key`; None, and forgotten, when it is missing, damaged or has another schema."""
        content = self._intact(key)
        if content is not None:
            table = pq.read_table(pa.BufferReader(content))
            if table.schema.equals(schema):
                return table
        self.entries.pop(key, None)
        return None

    def answer(self, key: str) -> Any:
        """The answer kept under `key`, or None. Only a file whose digest the journal holds is unpickled."""
        content = self._intact(key)
        return None if content is None else pickle.loads(content)

    def forget(self, key: str) -> None:
        """Do not use a finished piece again."""
        self.entries.pop(key, None)

    def remove(self) -> None:
        """Drop all of it, after the rows stand in the result table; the journal goes last."""
        if self.folder.is_dir():
            for path in sorted(self.folder.iterdir(), key=lambda path: path.name == _JOURNAL):
                if not path.is_dir():  # what someone else put there stays
                    path.unlink()
            with suppress(OSError):
                self.folder.rmdir()
        self.entries.clear()

    def _intact(self, key: str) -> bytes | None:
        """What is kept under `key`, or None when its file is missing or does not hold what was written."""
        entry = self.entries.get(key)
        if entry is None:
            return None
        try:
            content = (self.folder / entry.file).read_bytes()
        except OSError:
            return None
        return content if hashlib.sha256(content).hexdigest() == entry.sha256 else None

    def _keep(self, key: str, file: str, content: bytes, rows: int, failed: int, seconds: float) -> None:
        write_bytes(content, self.folder / file)
        digest = hashlib.sha256(content).hexdigest()
        entry = Entry(key, file, digest, len(content), rows, failed, round(seconds, 4), round(time.time(), 3))
        line = ("\n" if self._torn else "") + json.dumps(asdict(entry)) + "\n"
        self._torn = True  # until the whole line is on the disk
        journal = self.folder / _JOURNAL
        try:
            with journal.open("a", encoding="utf-8") as handle:
                handle.write(line)
                handle.flush()
                os.fsync(handle.fileno())
        except OSError as error:
            raise OutputError(Fault(f"cannot be written: {error.strerror or error}", str(journal))) from None
        self._torn = False
        self.entries[key] = entry


@contextmanager
def locked(output: Path) -> Iterator[None]:
    """Hold the output folder for one run; raises OutputError, naming the other run, when it is in use.

    The kernel drops the lock with its process, so a lock cannot go stale. Hidden files that a killed run left behind
    are removed.
    """
    lock = output / LOCK
    try:
        output.mkdir(parents=True, exist_ok=True)
        handle: IO[str] = lock.open("a+", encoding="utf-8")
    except OSError as error:
        raise OutputError(Fault(f"cannot be written: {error.strerror or error}", str(output))) from None
    with handle:
        for attempt in range(_ATTEMPTS):
            try:
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
                break
            except OSError:
                if attempt == _ATTEMPTS - 1:
                    raise OutputError(Fault(f"in use by another run ({_said(handle)})", str(output))) from None
                time.sleep(_PAUSE_S)  # someone may just be looking who holds it
        _say(handle, output)
        for left_over in output.rglob(".tmp-*"):
            left_over.unlink(missing_ok=True)
        yield


def holder(output: Path) -> str | None:
    """Which run holds the folder, in words; None when none does."""
    try:
        handle = (output / LOCK).open("r", encoding="utf-8")
    except OSError:
        return None
    with handle:
        try:
            fcntl.flock(handle, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except OSError:
            return _said(handle)
        return None


def _say(handle: IO[str], output: Path) -> None:
    """Write into the lock who holds it; raises OutputError when the disk refuses."""
    try:
        os.ftruncate(handle.fileno(), 0)
        os.write(handle.fileno(), f"process {os.getpid()} on {socket.gethostname()}".encode())
    except OSError as error:
        raise OutputError(Fault(f"cannot be written: {error.strerror or error}", str(output))) from None


def _said(handle: IO[str]) -> str:
    handle.seek(0)
    return handle.read().strip() or "process ?"
