"""Numba's compiler, whose machine code is kept until the source of any kernel changes.

Numba itself looks at the file of a kernel alone, and keeps what the kernel took from other files as it was; and a file
of machine code that is damaged ends the process, or is run. Here each one has a digest before what it holds, a damaged
one is as one that is missing, and none lies in a folder that others may write: they could have their own code run.
"""

# mypy: disable-error-code="no-untyped-call"
from __future__ import annotations

import hashlib
import os
import pickle
import shutil
import stat
import tempfile
import time
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
from numba.core import caching
from platformdirs import user_cache_path

from .errors import SweepError, ValidationIssue

_ROOT = Path(__file__).parent.parent
_NAMES = "kernels.py"
"""How names of files with kernels end."""
_FORGOTTEN_S = 7 * 24 * 3600.0
"""Seconds after which code of other sources is removed."""
_FORM = "each file after its SHA-256"
"""Name of the form of the files, another one for another form: neither reads files of the other."""
_DIGEST_BYTES = hashlib.sha256().digest_size

_SETTINGS: Any = numba.config
_F = TypeVar("_F", bound=Callable[..., Any])


def sources() -> list[Path]:
    """Return the files with kernels, in order."""
    return sorted(path for path in _ROOT.rglob("*.py") if path.name.endswith(_NAMES))


def njit(**options: Any) -> Callable[[_F], _F]:
    """`numba.njit`, kept by what all kernels are made of where `cache` is true and a folder can be written.

    Raises SweepError where others may write that folder.
    """
    is_cached = options.pop("cache", False)

    def decorated(function: _F) -> _F:
        kernel: Any = numba.njit(**options)(function)
        if is_cached:
            with suppress(RuntimeError):  # numba's, where the folder cannot be written
                kernel._cache = _Cache(function)
        return cast(_F, kernel)

    return decorated


class _Files(caching.IndexDataCacheFile):
    """The machine code of a kernel for each key: a file that lists them, and a file for each."""

    def load(self, key: Any) -> Any:
        """Load the code; None where there is none, or that of another key: two processes may have chosen one name."""
        entry = super().load(key)
        return entry[1] if entry is not None and entry[0] == key else None

    def save(self, key: Any, data: Any) -> None:
        """Keep the code."""
        super().save(key, (key, data))

    def _load_index(self) -> Any:
        try:
            stamp, names = self._load_data(self._index_name)
        except Exception:  # whatever unpickling raises
            return {}
        return names if stamp == self._source_stamp else {}

    def _save_index(self, overloads: Any) -> None:
        self._save_data(self._index_name, (self._source_stamp, overloads))

    def _load_data(self, name: str) -> Any:
        """Load a file; raises OSError if it is damaged."""
        content = Path(self._data_path(name)).read_bytes()
        digest, held = content[:_DIGEST_BYTES], content[_DIGEST_BYTES:]
        if hashlib.sha256(held).digest() != digest:
            raise OSError(f"{name} is damaged")
        return pickle.loads(held)

    def _dump(self, obj: Any) -> bytes:
        held: bytes = super()._dump(obj)
        return hashlib.sha256(held).digest() + held


class _Folder:
    """Locator of the machine code of a file's kernels, in a folder of the user's own; see Numba's `_CacheLocator`.

    It has no base class, since Numba's have other names in other versions.
    """

    def __init__(self, function: Any, file: str) -> None:
        self._file, self._line = Path(file), function.__code__.co_firstlineno
        self._own = _kept_in(_SETTINGS.CACHE_DIR)
        named = hashlib.sha256(str(self._file.parent.resolve()).encode()).hexdigest()[:16]
        self._path = self._own / f"{self._file.parent.name}_{named}"

    @classmethod
    def from_function(cls, function: Any, file: str) -> _Folder | None:
        """Return the locator; None where its folder cannot be written."""
        locator = cls(function, file)
        try:
            locator.ensure_cache_path()
        except OSError:
            return None
        return locator

    def get_cache_path(self) -> str:
        """Return the folder of the files."""
        return str(self._path)

    def get_source_stamp(self) -> str:
        """Return the digest of the kernel's source file."""
        return hashlib.sha256(self._file.read_bytes()).hexdigest()

    def get_disambiguator(self) -> str:
        """Return the line, by which kernels of one name in a file differ."""
        return str(self._line)

    def ensure_cache_path(self) -> None:
        """Make the folders; raises OSError where that fails, and SweepError where others may write one."""
        for folder in (self._own, self._path):
            _make_private(folder)
        tempfile.TemporaryFile(dir=self._path).close()


class _Code(caching.CompileResultCacheImpl):
    _locator_classes = [_Folder]


class _Cache(caching.FunctionCache):
    """The machine code of a kernel on the disk. Damaged code is compiled and kept anew."""

    _impl_class = _Code

    def __init__(self, function: Any) -> None:
        super().__init__(function)
        stamp = self._impl.locator.get_source_stamp()
        self._cache_file = _Files(self._cache_path, self._impl.filename_base, stamp)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Load the code of a signature; None where there is none that can be used."""
        try:
            return super().load_overload(sig, target_context)
        except Exception:  # of pickle, of numba or of LLVM
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep the code of a signature, if it can be written."""
        with suppress(OSError):
            super().save_overload(sig, data)


@cache
def _kept_in(requested: str) -> Path:
    """Return the folder of the machine code: in the one that is asked for, beside the package, or the user's."""
    digest = hashlib.sha256(f"{_FORM}\0{numba.__version__}\0".encode())
    for path in sources():
        digest.update(path.relative_to(_ROOT).as_posix().encode() + b"\0" + path.read_bytes())
    beside = _ROOT / "__pycache__"
    places = Path(requested) if requested else beside if os.access(_ROOT, os.W_OK) else user_cache_path("sweep")
    folder = places / f"kernels-{digest.hexdigest()[:16]}"
    if not folder.exists():
        for other in places.glob("kernels-*"):
            with suppress(OSError):
                if time.time() - other.stat().st_mtime > _FORGOTTEN_S:
                    shutil.rmtree(other, ignore_errors=True)
    return folder


def _make_private(folder: Path) -> None:
    """Make a folder that the user alone may write; raises SweepError where it is there, and others may."""
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    if not hasattr(os, "geteuid"):
        return
    status = folder.lstat()
    others = status.st_mode & (stat.S_IWGRP | stat.S_IWOTH)
    if not stat.S_ISDIR(status.st_mode) or status.st_uid != os.geteuid() or others:
        allowed = "one that is yours, and that no one else may write: remove it, or set NUMBA_CACHE_DIR to another one"
        raise SweepError(
            ValidationIssue("a folder of machine code that others may change", str(folder), allowed=allowed)
        )
