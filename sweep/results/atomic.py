"""Files that are whole or not there: written under a hidden name, synced and renamed."""

from __future__ import annotations

import os
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Protocol

from ..base.disk import Digest
from ..base.errors import Fault, OutputError


class Seal(Protocol):
    """Sees a file that is written to its end, before it takes its name."""

    def __call__(self, hidden: Path, digest: Digest | None = None, /) -> None:
        """`digest`: of what the file holds, where it is known."""


def unsealed(hidden: Path, digest: Digest | None = None) -> None:
    """Nothing is noted of a file before it takes its name."""


@contextmanager
def refused_by_disk(path: Path) -> Iterator[None]:
    """Raises OutputError where the disk refuses (full, read-only, no permission) what is written for `path`."""
    try:
        yield
    except OSError as error:
        raise OutputError(Fault(f"cannot be written: {error.strerror or error}", str(path))) from None


def _sync(path: Path) -> None:
    with path.open("rb") as handle:
        os.fsync(handle.fileno())


def _hidden_name(path: Path) -> Path:
    return path.with_name(f".tmp-{os.getpid()}-{path.name}")


def _begin(hidden: Path) -> None:
    """Make a new file, not what a link of this name leads to."""
    hidden.parent.mkdir(parents=True, exist_ok=True)
    hidden.unlink(missing_ok=True)
    hidden.touch(exist_ok=False)


@contextmanager
def hidden_beside(path: Path, seal: Seal = unsealed) -> Iterator[Path]:
    """Give a hidden name beside `path`; on success it is synced and takes the name of `path`, else it is removed.

    `seal` sees the whole hidden file before it takes its name. A symbolic link at `path` is replaced, not followed.
    A reader sees the old file or the new one, never a part. Raises OSError.
    """
    hidden = _hidden_name(path)
    try:
        _begin(hidden)
        yield hidden
        if seal is unsealed:
            _sync(hidden)
        else:
            with ThreadPoolExecutor(1) as aside:  # to read a large file takes about as long as to sync it
                synced = aside.submit(_sync, hidden)
                seal(hidden)
                synced.result()
        hidden.replace(path)
    finally:
        with suppress(OSError):  # where it could not be made, for example below a file
            hidden.unlink()


@contextmanager
def atomic(path: Path, seal: Seal = unsealed) -> Iterator[Path]:
    """`hidden_beside`, with one error: OutputError when the disk refuses."""
    with refused_by_disk(path), hidden_beside(path, seal) as hidden:
        yield hidden


def write_bytes(content: bytes, path: Path, seal: Seal = unsealed) -> None:
    """Write one file atomically; `seal` and errors as for `atomic`."""
    with atomic(path, seal) as hidden:
        hidden.write_bytes(content)


def write_hidden(content: bytes, path: Path) -> Path:
    """Write a file beside `path`, synced, under a hidden name that is given back; errors as for `atomic`."""
    hidden = _hidden_name(path)
    with refused_by_disk(path):
        try:
            _begin(hidden)
            hidden.write_bytes(content)
            _sync(hidden)
        except OSError:
            with suppress(OSError):
                hidden.unlink()
            raise
    return hidden


def write_text(text: str, path: Path) -> None:
    """Write one UTF-8 text file atomically; errors as for `atomic`."""
    write_bytes(text.encode("utf-8"), path)
