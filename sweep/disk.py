"""Reading files in the tool's own folders, where others may have put something: plain files alone, no links, no more
bytes than expected. What a user names, links included, is read by `inputs`.
"""

from __future__ import annotations

import errno
import hashlib
import json
import os
import stat
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

MOST_FACTS = 64 * 2**20
"""Bytes of a JSON file that is read at once."""
_BLOCK = 2**20


@dataclass(frozen=True)
class Digest:
    """What a file holds: SHA-256 of its bytes in hexadecimal, and how many there are (None: not known)."""

    sha256: str
    size: int | None


def is_link(path: Path) -> bool:
    """Whether a symbolic link stands there."""
    return stat.S_ISLNK(_mode(path))


def is_real_folder(path: Path) -> bool:
    """Whether a folder stands there, and no link to one."""
    return stat.S_ISDIR(_mode(path))


def _mode(path: Path) -> int:
    try:
        return path.lstat().st_mode
    except OSError:  # nothing there, or nothing can be there
        return 0


def opened(path: Path, flags: int = os.O_RDONLY, mode: str = "rb", *, links: bool = False) -> IO[bytes]:
    """Open a plain file; raises OSError for folders, pipes, devices and, but for `links`, links: none is read."""
    # Without O_NONBLOCK, opening a pipe would wait for who writes into it.
    number = os.open(path, flags | (0 if links else os.O_NOFOLLOW) | os.O_NONBLOCK | os.O_CLOEXEC, 0o666)
    if not stat.S_ISREG(os.fstat(number).st_mode):
        os.close(number)
        raise OSError(errno.EINVAL, "not a plain file", str(path))
    return os.fdopen(number, mode)


def read_plain(path: Path, most: int) -> bytes:
    """A plain file of at most `most` bytes; raises OSError when it is none, longer, or cannot be read."""
    with opened(path) as file:
        content = file.read(most + 1)
    if len(content) > most:
        raise OSError(errno.EFBIG, "larger than expected", str(path))
    return content


def digest_of(path: Path) -> Digest:
    """What a plain file holds; raises OSError when it is none or cannot be read."""
    digest, size = hashlib.sha256(), 0
    with opened(path) as file:
        while block := file.read(_BLOCK):
            digest.update(block)
            size += len(block)
    return Digest(digest.hexdigest(), size)


def read_facts(path: Path) -> dict[str, Any]:
    """A JSON mapping; an empty one where there is no plain file with one."""
    try:
        return parsed_facts(read_plain(path, MOST_FACTS))
    except OSError:
        return {}


def parsed_facts(content: bytes) -> dict[str, Any]:
    """A JSON mapping; an empty one where the text is something else."""
    try:
        found = json.loads(content)
    except (ValueError, RecursionError):
        return {}
    return found if isinstance(found, dict) else {}
