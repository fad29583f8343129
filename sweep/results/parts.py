"""Finished work of a running or interrupted run: part files.

A part is written under a hidden name, synced and renamed, by the worker that computed it if that is on this machine.
Its name holds the key of the work, and the SHA-256 of key and bytes: a part that is missing, damaged or of other work
is computed again.
"""

from __future__ import annotations

import hashlib
import os
import re
from contextlib import suppress
from pathlib import Path

from ..base.disk import is_real_folder, read_plain
from ..base.errors import OutputError, ValidationIssue
from .atomic import write_bytes

PARTS = "parts"
ROWS, ANSWER = "parquet", "json"
"""Kinds of parts: rows of designs, and the answer to a call of a search."""
_DIGITS = 32
_NAME = re.compile(rf"([0-9a-f]{{{_DIGITS}}})-([0-9a-f]{{{_DIGITS}}})\.(?:{ROWS}|{ANSWER})")
_MOST_BYTES = 2**30
"""Bytes of a part, at most."""


def _digest(key: str, content: bytes) -> str:
    return hashlib.sha256(key[:_DIGITS].encode() + content).hexdigest()[:_DIGITS]


def write_part(folder: Path, key: str, kind: str, content: bytes) -> str:
    """Write a part and return its name; raises OutputError when the disk refuses."""
    name = f"{key[:_DIGITS]}-{_digest(key, content)}.{kind}"
    write_bytes(content, folder / name)
    return name


class Parts:
    """Part files in the folder of a run.

    Raises OutputError if something else has the name of the folder of parts.
    """

    def __init__(self, output: Path) -> None:
        self.folder = output / PARTS
        self._names: dict[str, str] = {}
        if os.path.lexists(self.folder) and not is_real_folder(self.folder):
            raise OutputError(ValidationIssue("folder not created by sweep; move it", str(self.folder)))
        for path in sorted(self.folder.iterdir()) if is_real_folder(self.folder) else ():
            self.add(path.name)

    def __contains__(self, key: str) -> bool:
        return key[:_DIGITS] in self._names

    def add(self, name: str) -> None:
        """Register a part that was written; other names are ignored."""
        if named := _NAME.fullmatch(name):
            self._names[named.group(1)] = name

    def save(self, key: str, kind: str, content: bytes) -> None:
        """Write a part."""
        self.add(write_part(self.folder, key, kind, content))

    def paths(self, kind: str) -> list[Path]:
        """Return the files of a kind."""
        return [self.folder / name for name in self._names.values() if name.endswith(f".{kind}")]

    def read(self, key: str) -> bytes | None:
        """Return the content of a part.

        None, and the part is removed, if it is missing or damaged.
        """
        name = self._names.get(key[:_DIGITS])
        if name is None:
            return None
        with suppress(OSError):
            content = read_plain(self.folder / name, _MOST_BYTES)
            if name[_DIGITS + 1 :].startswith(_digest(key, content)):
                return content
        self.forget(key)
        return None

    def forget(self, key: str) -> None:
        """Remove a part, so that its work is done again."""
        name = self._names.pop(key[:_DIGITS], None)
        if name is not None:
            with suppress(OSError):
                (self.folder / name).unlink()

    def remove(self) -> None:
        """Remove all parts, after the result table has their rows; files of others stay."""
        for key in list(self._names):
            self.forget(key)
        with suppress(OSError):
            self.folder.rmdir()
