"""Reading files: plain ones alone, no larger than their kind can be.

In the tool's own folders, where others may have put something, links are not followed. Files that a user names may be
links; issues name the file.
"""

from __future__ import annotations

import codecs
import errno
import hashlib
import json
import os
import stat
from io import BufferedReader
from pathlib import Path
from typing import Any

from .errors import SweepError, ValidationIssue

MOST_FACTS = 64 * 2**20
"""Bytes of a JSON file that is read at once."""
NO_UTF_16 = "UTF-8; UTF-16? save as UTF-8"
"""Allowed values for a text that seems to be UTF-16."""


# These are False, not an error, for a path that no file system takes.
is_file, is_folder, is_link = os.path.isfile, os.path.isdir, os.path.islink


def is_real_folder(path: Path) -> bool:
    """Return whether a folder, and no link to one, exists."""
    return is_folder(path) and not is_link(path)


def opened(path: Path, *, links: bool = False) -> BufferedReader:
    """Open a regular file; pipes, devices and folders are never read.

    Raises OSError if the path is no regular file, or a link and `links` is False.
    """
    # Without O_NONBLOCK, opening a pipe would wait for who writes into it. Windows has other flags, and no such files.
    flags = os.O_RDONLY | (0 if links else getattr(os, "O_NOFOLLOW", 0))
    flags |= getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_BINARY", 0)
    number = os.open(path, flags)
    if not stat.S_ISREG(os.fstat(number).st_mode):
        os.close(number)
        raise OSError(errno.EINVAL, "not a plain file", str(path))
    return os.fdopen(number, "rb")


def read_plain(path: Path, most: int) -> bytes:
    """Read a regular file of at most `most` bytes.

    `most`: largest size, in bytes. Raises OSError if the path is no regular file, is larger or cannot be read.
    """
    with opened(path) as file:
        content = file.read(most + 1)
    if len(content) > most:
        raise OSError(errno.EFBIG, "larger than expected", str(path))
    return content


def digest_of(path: Path) -> str:
    """Return the SHA-256 digest of a regular file.

    Raises OSError if the path is no regular file or cannot be read.
    """
    with opened(path) as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def read_facts(path: Path) -> dict[str, Any]:
    """Read a JSON mapping.

    Empty if there is no regular file with one.
    """
    try:
        return parsed_facts(read_plain(path, MOST_FACTS))
    except OSError:
        return {}


def parsed_facts(content: bytes) -> dict[str, Any]:
    """Parse a JSON mapping.

    Empty if the text holds anything else.
    """
    try:
        facts = json.loads(content)
    except (ValueError, RecursionError):
        return {}
    return facts if isinstance(facts, dict) else {}


def read_input(path: Path, most_bytes: int, refused: type[SweepError]) -> bytes:
    """Read a user's file of at most `most_bytes`.

    Pipes, devices and folders are refused before they are opened, as reading them may never end.

    `most_bytes`: largest size, in bytes. Raises SweepError of class `refused`, if the file is missing, too large or no
    regular file.
    """
    try:
        if not stat.S_ISREG(path.stat().st_mode):
            raise refused(
                ValidationIssue("not a file", str(path), allowed="a file on a disk; no folder, pipe or device")
            )
        with opened(path, links=True) as handle:  # a pipe may have come to its place
            size = os.fstat(handle.fileno()).st_size
            content = handle.read(most_bytes + 1) if size <= most_bytes else b""
    except (OSError, ValueError) as error:  # a ValueError: NUL in a path
        reason = (error.strerror if isinstance(error, OSError) else None) or error
        raise refused(ValidationIssue(f"cannot be read: {reason}", str(path))) from None
    size = max(size, len(content))  # virtual files have no size
    if size > most_bytes:
        raise refused(
            ValidationIssue("the file is too large", str(path), None, None, f"{size:,} bytes", f"up to {most_bytes:,}")
        )
    return content


def not_utf8(content: bytes, error: UnicodeDecodeError) -> tuple[str, bool]:
    """Describe a text that is not UTF-8.

    Returns the problem with its position, and whether the text starts like UTF-16.
    """
    wide = content[:2] in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
    return f"not UTF-8 text ({error.reason} at byte {error.start})", wide
