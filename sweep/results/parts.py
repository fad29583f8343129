"""Finished work of a run that is not whole yet: part files.

A part is written under a hidden name, synced and renamed, by the worker that computed it where that is on this machine.
Its name has the key of the work and the SHA-256 of its bytes: what is missing or damaged is computed again.
"""

from __future__ import annotations

import hashlib
import os
import re
from contextlib import suppress
from pathlib import Path

from ..base.disk import is_real_folder, read_plain
from ..base.errors import Fault, OutputError
from .atomic import write_bytes

PARTS = "parts"
ROWS, ANSWER = "parquet", "json"
"""Kinds of parts: rows of designs, and the answer to a call of a search."""
_DIGITS = 32
_NAME = re.compile(rf"([0-9a-f]{{{_DIGITS}}})-([0-9a-f]{{{_DIGITS}}})\.(?:{ROWS}|{ANSWER})")
_MOST_BYTES = 2**30
"""Bytes of a part, at most."""


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:_DIGITS]


def write_part(folder: Path, key: str, kind: str, content: bytes) -> str:
    """Write a part and return its name; raises OutputError when the disk refuses.

    Parameters
    ----------
    folder : Path
        That of the parts.
    key : str
        SHA-256 of everything that the work depends on.
    kind : {'parquet', 'json'}
        What it holds.
    content : bytes
        The file.
    """
    name = f"{key[:_DIGITS]}-{_digest(content)}.{kind}"
    write_bytes(content, folder / name)
    return name


class Parts:
    """The part files in the folder of a run; raises OutputError where something else has its name."""

    def __init__(self, output: Path) -> None:
        self.folder = output / PARTS
        self._names: dict[str, str] = {}
        if os.path.lexists(self.folder) and not is_real_folder(self.folder):
            raise OutputError(Fault("is no folder of this run; move it away", str(self.folder)))
        for path in sorted(self.folder.iterdir()) if is_real_folder(self.folder) else ():
            self.add(path.name)

    def __contains__(self, key: str) -> bool:
        return key[:_DIGITS] in self._names

    def add(self, name: str) -> None:
        """Register a part that was written; other names are left alone."""
        if named := _NAME.fullmatch(name):
            self._names[named.group(1)] = name

    def save(self, key: str, kind: str, content: bytes) -> None:
        """Write a part; raises OutputError when the disk refuses."""
        self.add(write_part(self.folder, key, kind, content))

    def paths(self, kind: str) -> list[Path]:
        """Return the files of the parts of a kind."""
        return [self.folder / name for name in self._names.values() if name.endswith(f".{kind}")]

    def read(self, key: str) -> bytes | None:
        """Return the content of a part; None, and it is removed, where it is missing or not what was written."""
        name = self._names.get(key[:_DIGITS])
        if name is None:
            return None
        with suppress(OSError):
            content = read_plain(self.folder / name, _MOST_BYTES)
            if name[_DIGITS + 1 :].startswith(_digest(content)):
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
        """Remove all parts, after the result table has their rows. Files of others stay."""
        for key in list(self._names):
            self.forget(key)
        with suppress(OSError):
            self.folder.rmdir()
