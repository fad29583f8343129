"""Read files of curves: tables of text and ISETCam's `.mat`."""

from __future__ import annotations

import hashlib
import io
import math
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np

from ..base.disk import read_input
from ..base.errors import DataError, ValidationIssue, nearest
from .spectrum import Curves, sample_issues
from .text_tables import MOST_BYTES, MOST_VALUES, Scan, check_size, scan_text

_MAT_VARIABLES = ("wavelength", "data", "filterNames")
_MAT_NUMBERS = ("double", "single", *(f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)))


def is_curve_file(name: str) -> bool:
    """Return whether a name has the extension of a file of curves.

    Parameters
    ----------
    name : str
        File name.

    Returns
    -------
    bool
        True if it has.
    """
    return Path(name).suffix.casefold() in _KINDS


def digest(path: Path) -> str:
    """Return the SHA-256 of a file's bytes.

    Parameters
    ----------
    path : Path
        File.

    Returns
    -------
    str
        Hexadecimal digest.

    Raises
    ------
    DataError
        If the file cannot be read.
    """
    return hashlib.sha256(read_input(path, MOST_BYTES, DataError)).hexdigest()


def read_curves(path: Path) -> Curves:
    """Read every curve of a file, unscaled and in the file's own quantity.

    Parameters
    ----------
    path : Path
        File.

    Returns
    -------
    Curves
        Curves.

    Raises
    ------
    DataError
        If the file cannot be read or is not clean, with file, line, column and value.
    """
    scan = scan_curves(path)
    if scan.issues:
        raise DataError(scan.issues[0])
    return Curves(scan.wavelength_nm, dict(zip(scan.names, scan.values.T, strict=True)), str(path), notes=scan.notes)


def scan_curves(path: Path) -> Scan:
    """Read a file as far as possible, with everything that is wrong with it.

    Parameters
    ----------
    path : Path
        File.

    Returns
    -------
    Scan
        Curves and issues.

    Raises
    ------
    DataError
        If nothing can be read: no file, an unknown kind, no numbers.
    """
    kind = _KINDS.get(path.suffix.casefold())
    if kind is None:
        raise DataError(
            ValidationIssue("unknown kind of curve file", str(path), value=path.suffix, allowed=", ".join(_KINDS))
        )
    return kind(path)


def _scan_mat(path: Path) -> Scan:
    """Read ISETCam color filters and spectra: `wavelength`, `data` (a column per curve), optionally `filterNames`.

    SciPy reads plain arrays; nothing in them is executed.
    """
    from scipy.io import loadmat, whosmat  # noqa: PLC0415  (slow to import, seldom needed)

    file, content = str(path), read_input(path, MOST_BYTES, DataError)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # it only warns of a variable that it cannot read
            _check_mat(file, whosmat(io.BytesIO(content)))
            fields = loadmat(io.BytesIO(content), variable_names=_MAT_VARIABLES)
        wave, data = fields["wavelength"].ravel(), np.atleast_2d(fields["data"])
    except DataError:
        raise
    except NotImplementedError:
        raise DataError(
            ValidationIssue("a version 7.3 (HDF5) .mat file", file, allowed="version 5: save with -v6 or -v7")
        ) from None
    except Exception as error:  # of damaged bytes SciPy's decoders raise whatever they meet first
        raise DataError(ValidationIssue(f"not a readable .mat file: {error or type(error).__name__}", file)) from None
    if np.iscomplexobj(wave) or np.iscomplexobj(data):
        raise DataError(ValidationIssue("`wavelength` and `data` must be real numbers", file))
    if data.shape[0] != wave.size and data.shape[-1] == wave.size:
        data = data.T
    if data.ndim != 2 or data.shape[0] != wave.size or not data.size:
        raise DataError(
            ValidationIssue("`data` does not fit `wavelength`", file, value=data.shape, allowed=f"({wave.size}, n)")
        )
    check_size(file, None, *data.shape)
    wave, data = wave.astype(float), data.astype(float) + 0.0
    columns = _mat_names(fields.get("filterNames"), data.shape[1])
    return Scan(wave, columns, data, tuple(map(tuple, sample_issues(file, wave, columns, data))))


def _check_mat(file: str, variables: list[tuple[str, tuple[int, ...], str]]) -> None:
    """Refuse a .mat file by names, shapes and kinds of its variables, before their values are read."""
    kinds = {name: kind for name, _, kind in variables}
    for needed in ("wavelength", "data"):
        if needed not in kinds:
            raise DataError(
                ValidationIssue(f"no variable `{needed}`", file, value=[*kinds], nearest=nearest(needed, kinds))
            )
        if kinds[needed] not in _MAT_NUMBERS:
            raise DataError(ValidationIssue("`wavelength` and `data` must be real numbers", file))
    if kinds.get("filterNames", "cell") not in ("cell", "char"):
        raise DataError(ValidationIssue("`filterNames` must be texts", file))
    for name, shape, _ in variables:
        if name in _MAT_VARIABLES and (min(shape, default=0) < 0 or math.prod(shape) > MOST_VALUES):
            raise DataError(
                ValidationIssue("not a size of curves", file, None, name, shape, f"at most {MOST_VALUES:,} values")
            )


def _mat_names(raw: object, count: int) -> tuple[str, ...]:
    items = [] if raw is None else [np.asarray(item).ravel() for item in np.asarray(raw, dtype=object).ravel()]
    names = tuple(str(item[0]).strip() if item.size else "" for item in items)
    if len(names) == count and len(set(names)) == count and all(names):
        return names
    return tuple(f"curve_{index + 1}" for index in range(count))


_KINDS: dict[str, Callable[[Path], Scan]] = {
    **dict.fromkeys((".csv", ".tsv", ".txt", ".dat"), scan_text),
    ".mat": _scan_mat,
}
"""Readers by the ending of a file's name."""
