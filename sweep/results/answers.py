"""Answers of a running or interrupted search, a file each as soon as it is there; they go with the end of the run."""

from __future__ import annotations

import hashlib
import os
import re
from contextlib import suppress
from pathlib import Path

from ..base.disk import is_real_folder, read_plain
from ..base.errors import OutputError, ValidationIssue
from .atomic import write_bytes

ANSWERS = "answers"
_NAME = re.compile(r"[0-9a-f]{64}\.json")
_MOST_BYTES = 2**30


class Answers:
    """Answers in the folder of a run, by key; a file has the digest of its key and text before its text.

    Raises OutputError if something else has the name of their folder.
    """

    def __init__(self, output: Path) -> None:
        self.folder = output / ANSWERS
        if os.path.lexists(self.folder) and not is_real_folder(self.folder):
            raise OutputError(ValidationIssue("folder not created by sweep; move it", str(self.folder)))

    def __len__(self) -> int:
        return len(self._paths())

    def _paths(self) -> list[Path]:
        paths = [*self.folder.iterdir()] if is_real_folder(self.folder) else []
        return [path for path in paths if _NAME.fullmatch(path.name)]

    def save(self, key: str, text: bytes) -> None:
        """Write an answer."""
        write_bytes(_digest(key, text) + text, self._path(key))

    def read(self, key: str) -> bytes | None:
        """Return an answer; None if it is missing or damaged."""
        with suppress(OSError):
            content = read_plain(self._path(key), _MOST_BYTES)
            text = content[len(_digest("", b"")) :]
            if content == _digest(key, text) + text:
                return text
        return None

    def forget(self, key: str) -> None:
        """Remove an answer, so that its work is done again."""
        with suppress(OSError):
            self._path(key).unlink()

    def remove(self) -> None:
        """Remove all answers; files of others stay."""
        for path in self._paths():
            with suppress(OSError):
                path.unlink()
        with suppress(OSError):
            self.folder.rmdir()

    def _path(self, key: str) -> Path:
        return self.folder / f"{key}.json"


def _digest(key: str, text: bytes) -> bytes:
    return hashlib.sha256(key.encode() + text).hexdigest().encode() + b"\n"
