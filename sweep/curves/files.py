"""Read files of curves: tables of text, ISETCam's `.mat`, IES TM-27's `.spdx`, rawtoaces' JSON, Speos' `.spectrum`."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path

import numpy as np

from ..base.disk import read_input
from ..base.errors import DataError, Fault, nearest
from .instrument_files import scan_json, scan_spdx
from .mat_files import DamagedError, read_variables
from .scan import MOST_BYTES, Scan, check_size
from .spectrum import Curves, sample_faults
from .speos import scan_speos
from .text_tables import scan_text

_MAT_VARIABLES = ("wavelength", "data", "filterNames")


def is_curve_file(name: str) -> bool:
    """Whether a name ends like one of a file of curves."""
    return Path(name).suffix.casefold() in _KINDS


def digest(path: Path) -> str:
    """SHA-256 of a file's bytes, hexadecimal; raises DataError when it cannot be read."""
    return hashlib.sha256(read_input(path, MOST_BYTES, DataError)).hexdigest()


def read_curves(path: Path) -> Curves:
    """Read every curve of a file, unscaled and in the file's own quantity.

    Raises DataError (file, line, column, value) on anything that is not clean: see `spectrum.check_samples`.
    """
    scan = scan_curves(path)
    if scan.faults:
        raise DataError(scan.faults[0])
    return Curves(scan.wavelength_nm, dict(zip(scan.names, scan.values.T, strict=True)), str(path), notes=scan.notes)


def scan_curves(path: Path) -> Scan:
    """Read a file as far as possible, say everything that is wrong with it, and how it was read.

    Raises DataError where nothing can be read at all: no file, an unknown kind, no numbers.
    """
    kind = _KINDS.get(path.suffix.casefold())
    if kind is None:
        raise DataError(Fault("unknown kind of curve file", str(path), value=path.suffix, allowed=", ".join(_KINDS)))
    return kind(path)


def _scan_mat(path: Path) -> Scan:
    """ISETCam color filters and spectra: `wavelength`, `data` (a column per curve), `filterNames` if there.

    Version 5 files are read by SciPy as plain arrays; nothing in them is executed.
    """
    file = str(path)
    try:
        fields, names = read_variables(read_input(path, MOST_BYTES, DataError), _MAT_VARIABLES, MOST_BYTES)
    except NotImplementedError:
        raise DataError(
            Fault("a version 7.3 (HDF5) .mat file", file, allowed="version 5: save with -v6 or -v7")
        ) from None
    except DamagedError as error:
        raise DataError(Fault(f"not a readable .mat file: {error}", file)) from None
    for needed in ("wavelength", "data"):
        if needed not in names:
            raise DataError(Fault(f"no variable `{needed}`", file, value=names, nearest=nearest(needed, names)))
    if "filterNames" in names and "filterNames" not in fields:
        raise DataError(Fault("`filterNames` must be texts", file))
    try:
        if any(np.iscomplexobj(fields[needed]) for needed in ("wavelength", "data")):
            raise TypeError
        wave = np.asarray(fields["wavelength"], dtype=float).ravel()
        data = np.atleast_2d(np.asarray(fields["data"], dtype=float)) + 0.0
    except (TypeError, ValueError, KeyError):
        raise DataError(Fault("`wavelength` and `data` must be real numbers", file)) from None
    if data.shape[0] != wave.size and data.shape[-1] == wave.size:
        data = data.T
    if data.ndim != 2 or data.shape[0] != wave.size or not data.size:
        raise DataError(Fault("`data` does not fit `wavelength`", file, value=data.shape, allowed=f"({wave.size}, n)"))
    check_size(file, None, *data.shape)
    columns = _mat_names(fields.get("filterNames"), data.shape[1])
    return Scan(wave, columns, data, tuple(map(tuple, sample_faults(file, wave, columns, data))))


def _mat_names(raw: object, count: int) -> tuple[str, ...]:
    items = [] if raw is None else [np.asarray(item).ravel() for item in np.asarray(raw, dtype=object).ravel()]
    names = tuple(str(item[0]).strip() if item.size else "" for item in items)
    if len(names) == count and len(set(names)) == count and all(names):
        return names
    return tuple(f"curve_{index + 1}" for index in range(count))


_KINDS: dict[str, Callable[[Path], Scan]] = {
    **dict.fromkeys((".csv", ".tsv", ".txt", ".dat"), scan_text),
    ".mat": _scan_mat,
    ".spdx": scan_spdx,
    ".json": scan_json,
    ".spectrum": scan_speos,
}
"""Readers by the ending of a file's name."""
