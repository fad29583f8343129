"""Reading files that a user names: plain ones, also by a link, no larger than their kind can be. Faults name the file.

What stands in the tool's own folders, where a link is not to be followed, is read by `disk`.
"""

from __future__ import annotations

import codecs
import os
import stat
from pathlib import Path

from .disk import opened
from .errors import Fault, SweepError

NO_UTF_16 = "UTF-8; UTF-16? save as UTF-8"
"""What to allow where a text seems to be UTF-16."""


def read_input(path: Path, most_bytes: int, refused: type[SweepError]) -> bytes:
    """The content of a regular file of at most `most_bytes`.

    Raises `refused` for what is absent, larger or no file (a pipe, a device, a folder), before anything of it is read:
    such a thing may block forever, or never end.
    """
    try:
        if not stat.S_ISREG(path.stat().st_mode):
            raise refused(Fault("not a file", str(path), allowed="a file on a disk; no folder, pipe or device"))
        with opened(path, links=True) as handle:  # a pipe may have come to its place
            size = os.fstat(handle.fileno()).st_size
            content = handle.read(most_bytes + 1) if size <= most_bytes else b""
    except (OSError, ValueError) as error:  # a ValueError: NUL in a path
        reason = (error.strerror if isinstance(error, OSError) else None) or error
        raise refused(Fault(f"cannot be read: {reason}", str(path))) from None
    size = max(size, len(content))  # what the kernel makes up as it is read has no size
    if size > most_bytes:
        raise refused(Fault("the file is too large", str(path), None, None, f"{size:,} bytes", f"up to {most_bytes:,}"))
    return content


def not_utf8(content: bytes, error: UnicodeDecodeError) -> tuple[str, bool]:
    """What is wrong with a text that is not UTF-8, and whether it begins as UTF-16 does."""
    wide = content[:2] in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
    return f"not UTF-8 text ({error.reason} at byte {error.start})", wide


def is_file(path: Path) -> bool:
    """Whether there is such a file; False also for a path that no file system takes."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def is_folder(path: Path) -> bool:
    """Whether there is such a folder; False also for a path that no file system takes."""
    try:
        return path.is_dir()
    except (OSError, ValueError):
        return False
