"""Numba's compiler, whose machine code is kept until the source of any kernel changes.

Numba itself looks at the file of a kernel alone, and keeps what the kernel took from other files as it was.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import time
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import numba
from platformdirs import user_cache_path

_ROOT = Path(__file__).parent.parent
_NAMES = ("compiled", "nearest", "vectorized")
"""What the names of files with kernels begin with."""
_FORGOTTEN_S = 7 * 24 * 3600.0
"""Seconds after which code of other sources is removed."""

_SETTINGS: Any = numba.config
_F = TypeVar("_F", bound=Callable[..., Any])


def sources() -> list[Path]:
    """Files with kernels, in order."""
    found = []
    for folder, folders, names in os.walk(_ROOT):
        folders[:] = [name for name in folders if name != "__pycache__"]
        found += [Path(folder) / name for name in names if name.startswith(_NAMES) and name.endswith(".py")]
    return sorted(found)


def njit(**options: Any) -> Callable[[_F], _F]:
    """`numba.njit`, kept by what all kernels are made of."""

    def decorated(function: _F) -> _F:
        before = _SETTINGS.CACHE_DIR
        _SETTINGS.CACHE_DIR = str(_kept_in(before))
        try:
            made: _F = numba.njit(**options)(function)
        finally:
            _SETTINGS.CACHE_DIR = before
        return made

    return decorated


@cache
def _kept_in(asked: str) -> Path:
    """The folder of the machine code: in the one that is asked for, beside the package, or the user's."""
    digest = hashlib.sha256(numba.__version__.encode())
    for path in sources():
        digest.update(path.relative_to(_ROOT).as_posix().encode() + b"\0" + path.read_bytes())
    beside = _ROOT / "__pycache__"
    places = Path(asked) if asked else beside if os.access(_ROOT, os.W_OK) else user_cache_path("sweep")
    found = places / f"kernels-{digest.hexdigest()[:16]}"
    if not found.exists():
        for other in places.glob("kernels-*"):
            with suppress(OSError):
                if time.time() - other.stat().st_mtime > _FORGOTTEN_S:
                    shutil.rmtree(other, ignore_errors=True)
    return found
