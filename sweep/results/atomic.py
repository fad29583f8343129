"""Atomic files: written under a hidden name, synced and renamed."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from ..base.errors import OutputError, ValidationIssue

LEFT_OVER = r"\.tmp-\d+-.*"
"""Names of files that are being written: hidden, outside of a dataset, and without its ending."""


@contextmanager
def atomic(path: Path) -> Iterator[Path]:
    """Give a hidden name beside a path, or its dataset; on success it is synced and renamed to the path, else removed.

    A symbolic link at the path is replaced, not followed. A reader sees the old file or the new one, never a part.

    Raises OutputError if the disk refuses (full, read-only, no permission).
    """
    home = path.parent.parent if path.parent.suffix == ".parquet" else path.parent
    hidden = home / f".tmp-{os.getpid()}-{path.name}~"
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        hidden.unlink(missing_ok=True)
        hidden.touch(exist_ok=False)  # a new file, not what a link of this name leads to
        yield hidden
        with hidden.open("rb+") as handle:
            os.fsync(handle.fileno())
        with suppress(OSError):  # an empty folder in its place goes
            path.rmdir()
        hidden.replace(path)
    except OSError as error:
        raise OutputError(ValidationIssue(f"cannot be written: {error.strerror or error}", str(path))) from None
    finally:
        with suppress(OSError):
            hidden.unlink()


def write_bytes(content: bytes, path: Path) -> None:
    """Write one file atomically."""
    with atomic(path) as hidden:
        hidden.write_bytes(content)


def write_text(text: str, path: Path) -> None:
    """Write one UTF-8 text file atomically."""
    write_bytes(text.encode("utf-8"), path)
