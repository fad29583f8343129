"""Finished work of a run that is not whole yet: shards of rows and kept answers, listed in a journal.

A shard is written to a hidden file and synced, by the worker that computed it where that is on this machine. Then it is
renamed, and a line of the journal names it with the SHA-256 of its bytes, and is synced. What the journal does not
list, or what no longer has its digest, is computed again.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
import re
import time
from collections.abc import Iterable
from concurrent.futures import Executor
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa

from ..base.disk import Digest, is_link, is_real_folder, opened, read_plain
from ..base.errors import Fault, OutputError
from .atomic import refused_by_disk, write_bytes, write_hidden
from .tables import decoded, encoded, holds

SHARDS = "shards"
_JOURNAL = "_journal.jsonl"
"""Readers of Parquet folders skip names that begin so."""
_SHARD, _ANSWER = "{index:08d}-{key}.parquet", "_answer-{key}.json"
_NAMES = re.compile(r"(?:\d{8,}-([0-9a-f]{16})\.parquet|_answer-([0-9a-f]{16})\.json)")
"""Names that a journal gives, by which its files are known; 16 digits of the key are part of them."""
_MOST_BYTES, _MOST_LINE = 2**30, 4096
"""Of a file and of a line of the journal, more than any has; what is larger is not read."""
_MOST_ROWS, _MOST_SECONDS = 2**40, 1e12


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

    @staticmethod
    def of(line: bytes) -> Entry | None:
        """The entry of a line; None unless it is one that a journal writes, of a file beside it."""
        try:
            held = json.loads(line)
            entry = Entry(**held)
        except (ValueError, TypeError, RecursionError):
            return None
        return entry if entry.is_sound() else None

    def is_sound(self) -> bool:
        """Whether every field is of its type and range, and the file's name follows from the key."""
        if not all(isinstance(text, str) for text in (self.key, self.file, self.sha256)):
            return False
        counts = ((self.size, _MOST_BYTES), (self.rows, _MOST_ROWS), (self.failed, self.rows))
        if not all(type(n) is int and type(most) is int and 0 <= n <= most for n, most in counts):
            return False
        times = (self.seconds, self.at)
        if not all(type(t) in (int, float) and abs(t) <= _MOST_SECONDS and math.isfinite(t) for t in times):
            return False
        named = _NAMES.fullmatch(self.file)
        if named is None or re.fullmatch("[0-9a-f]{64}", self.key) is None:
            return False
        return self.key[:16] in named.groups()


@dataclass(frozen=True)
class Hidden:
    """A synced file that has no name of the journal's yet, and what it holds."""

    path: Path
    digest: Digest


@dataclass(frozen=True)
class Shard:
    """Finished rows as a Parquet file: how many, how many of them failed, and the seconds that they took.

    `file`: its bytes, or where they stand.
    """

    file: bytes | Hidden
    rows: int
    failed: int
    seconds: float

    @staticmethod
    def of(table: pa.Table, seconds: float, path: Path | None = None) -> Shard:
        """A table, encoded; where a path is given, hidden beside it. Raises OutputError when the disk refuses."""
        content, failed = encoded(table), int(np.count_nonzero(~holds(table, "status", "ok")))
        file = content if path is None else Hidden(write_hidden(content, path), _digest(content))
        return Shard(file, table.num_rows, failed, seconds)


def _digest(content: bytes) -> Digest:
    return Digest(hashlib.sha256(content).hexdigest(), len(content))


class Journal:
    """The finished work in the folder of a run, as far as this process knows it."""

    def __init__(self, output: Path) -> None:
        self.folder = output / SHARDS
        self.entries: dict[str, Entry] = {}
        self._torn = False
        if os.path.lexists(self.folder) and not is_real_folder(self.folder):
            raise OutputError(Fault("is no folder of this run; move it away", str(self.folder)))
        self._read()

    def _read(self) -> None:
        """Every whole line; a later one replaces an earlier one of its key.

        A line that a kill cut, or that no journal writes, is ignored, and so is a journal that is no plain file.
        """
        path = self.folder / _JOURNAL
        if not path.is_file() or is_link(path):
            return
        try:
            with opened(path) as file:
                if os.fstat(file.fileno()).st_size > _MOST_BYTES:
                    return
                while line := file.readline(_MOST_LINE):
                    self._torn = not line.endswith(b"\n")
                    entry = Entry.of(line)
                    if entry is not None:
                        self.entries[entry.key] = entry
        except OSError as error:
            raise OutputError(Fault(f"cannot be read: {error.strerror or error}", str(path))) from None

    def check(self) -> None:
        """Forget what is missing or has another size; a file of the right size is checked when it is used."""
        sizes: dict[str, int] = {}
        for item in list(os.scandir(self.folder)) if is_real_folder(self.folder) else []:
            with suppress(FileNotFoundError):  # a run that is under way has just removed it
                if item.is_file(follow_symlinks=False):
                    sizes[item.name] = item.stat().st_size
        self.entries = {key: entry for key, entry in self.entries.items() if sizes.get(entry.file) == entry.size}

    def path(self, key: str, index: int) -> Path:
        """Where finished rows stand that are kept under `key`."""
        return self.folder / _SHARD.format(index=index, key=key[:16])

    def save(self, key: str, index: int, shard: Shard) -> None:
        """Keep finished rows under `key`; raises OutputError when the disk refuses."""
        path, counts = self.path(key, index), (shard.rows, shard.failed, shard.seconds)
        if isinstance(shard.file, Hidden):
            with refused_by_disk(path):
                shard.file.path.replace(path)
            self._list(key, path.name, shard.file.digest, *counts)
        else:
            self._keep(key, path.name, shard.file, *counts)

    def keep(self, key: str, answer: bytes, seconds: float) -> None:
        """Keep the text of any finished answer under `key`; errors as for `save`."""
        self._keep(key, _ANSWER.format(key=key[:16]), answer, 0, 0, seconds)

    def table(self, key: str, schema: pa.Schema, rows: int) -> pa.Table | None:
        """The table kept under `key`; None, and forgotten, when it is missing, damaged or of other columns or size."""
        content = self.content(key)
        table = None if content is None else decoded(content, schema, rows)
        if table is None:
            self.entries.pop(key, None)
        return table

    def forget(self, key: str) -> None:
        """Do not use a finished piece again."""
        self.entries.pop(key, None)

    def drop(self, key: str) -> None:
        """Forget a finished piece for good: no later run finds it."""
        entry = self.entries.pop(key, None)
        if entry is not None:
            self._unlink([entry.file])

    def leave(self, keys: Iterable[str], aside: Executor) -> None:
        """Finished pieces that stand elsewhere now: their files are removed `aside`, for which this does not wait."""
        aside.submit(self._unlink, [self.entries.pop(key).file for key in keys if key in self.entries])

    def _unlink(self, names: Iterable[str]) -> None:
        for name in names:
            with suppress(OSError):
                (self.folder / name).unlink()

    def remove(self) -> None:
        """Drop all of it, after the rows stand in the result table; the journal goes last. Files of others stay."""
        if is_real_folder(self.folder):
            own = [path.name for path in self.folder.iterdir() if _NAMES.fullmatch(path.name)]
            for name in (*own, _JOURNAL):
                with suppress(IsADirectoryError, FileNotFoundError):
                    (self.folder / name).unlink()
            with suppress(OSError):
                self.folder.rmdir()
        self.entries.clear()

    def content(self, key: str, *, just_kept: bool = False) -> bytes | None:
        """The bytes kept under `key`, or None when their file is missing or does not hold what was written.

        What was kept a moment ago has its size, and its digest is not looked at.
        """
        entry = self.entries.get(key)
        if entry is None:
            return None
        try:
            content = read_plain(self.folder / entry.file, entry.size)
        except OSError:
            return None
        if just_kept:
            return content if len(content) == entry.size else None
        return content if _digest(content).sha256 == entry.sha256 else None

    def _keep(self, key: str, file: str, content: bytes, rows: int, failed: int, seconds: float) -> None:
        write_bytes(content, self.folder / file)
        self._list(key, file, _digest(content), rows, failed, seconds)

    def _list(self, key: str, file: str, digest: Digest, rows: int, failed: int, seconds: float) -> None:
        """Name a finished file in the journal."""
        assert digest.size is not None
        entry = Entry(key, file, digest.sha256, digest.size, rows, failed, round(seconds, 4), round(time.time(), 3))
        line = ("\n" if self._torn else "") + json.dumps(asdict(entry)) + "\n"
        self._torn = True  # until the whole line is on the disk
        journal = self.folder / _JOURNAL
        try:
            if is_link(journal):
                journal.unlink()  # the link alone
            with opened(journal, os.O_WRONLY | os.O_APPEND | os.O_CREAT, "ab") as handle:
                handle.write(line.encode("utf-8"))
                handle.flush()
                os.fsync(handle.fileno())
        except OSError as error:
            raise OutputError(Fault(f"cannot be written: {error.strerror or error}", str(journal))) from None
        self._torn = False
        self.entries[key] = entry
