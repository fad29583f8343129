"""Read files of curves: wide CSV (`wavelength_nm`, one column per curve) and ISETCam `.mat` files."""

from __future__ import annotations

import csv
import hashlib
import io
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from .errors import DataError, Fault, nearest
from .spectra import Curves, check_samples

WAVELENGTH = "wavelength_nm"


def digest(path: Path) -> str:
    """SHA-256 of a file's bytes, hexadecimal; raises DataError when it cannot be read."""
    return hashlib.sha256(_read_bytes(path)).hexdigest()


def read_curves(path: Path) -> Curves:
    """Read every curve of a CSV or `.mat` file, unscaled and in the file's own quantity.

    Raises DataError (file, line, column, value) on anything that is not clean: see `spectra.check_samples`.
    """
    suffix = path.suffix.casefold()
    if suffix == ".csv":
        return _read_csv(path)
    if suffix == ".mat":
        return _read_mat(path)
    raise DataError(Fault("unknown kind of curve file", str(path), value=path.suffix, allowed=".csv, .mat"))


def _read_bytes(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise DataError(Fault(f"cannot be read: {error.strerror or error}", str(path))) from None


def _read_csv(path: Path) -> Curves:
    try:
        text = _read_bytes(path).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise DataError(Fault(f"not UTF-8 text ({error.reason} at byte {error.start})", str(path))) from None
    reader = csv.reader(io.StringIO(text, newline=None))
    try:
        rows = [(reader.line_num, row) for row in reader if any(c.strip() for c in row) and not row[0].startswith("#")]
    except csv.Error as error:
        raise DataError(Fault(f"not a readable CSV: {error}", str(path), reader.line_num)) from None
    if not rows:
        raise DataError(
            Fault("the file is empty", str(path), allowed=f"a header `{WAVELENGTH},...` and rows of numbers")
        )
    header_line, header = rows[0][0], [cell.strip() for cell in rows[0][1]]
    faults = _header_faults(str(path), header_line, header)
    if faults:
        raise DataError(faults)
    values = np.full((len(rows) - 1, len(header)), np.nan)
    for index, (line, row) in enumerate(rows[1:]):
        if len(row) != len(header):
            faults.append(Fault("wrong number of columns", str(path), line, value=len(row), allowed=str(len(header))))
            continue
        for column, cell in enumerate(row):
            number = _number(cell)
            if number is None or (column > 0 and number < 0):
                faults.append(
                    Fault("not a usable number", str(path), line, header[column], cell.strip(), "finite, >= 0")
                )
            else:
                values[index, column] = number
        if index and values[index, 0] <= values[index - 1, 0]:
            problem = (
                "wavelength occurs twice" if values[index, 0] == values[index - 1, 0] else "wavelengths are not sorted"
            )
            faults.append(Fault(problem, str(path), line, WAVELENGTH, values[index, 0].item(), "strictly increasing"))
    if faults:
        raise DataError(faults)
    return _checked(path, values[:, 0], header[1:], values[:, 1:])


def _header_faults(file: str, line: int, header: list[str]) -> list[Fault]:
    if header[0] != WAVELENGTH:
        unit = "wrong unit of " if header[0].startswith("wavelength_") and ";" not in header[0] else "no column "
        return [Fault(f"{unit}wavelength", file, line, header[0], header[0], f"`{WAVELENGTH}` as the first column")]
    faults = [
        Fault("column occurs twice", file, line, name) for index, name in enumerate(header) if name in header[:index]
    ]
    if "" in header:
        faults.append(Fault("a column has no name", file, line, value=header))
    if len(header) < 2:
        faults.append(Fault("the file has no curve", file, line, allowed="one column or more beside the wavelength"))
    return faults


def _number(cell: str) -> float | None:
    try:
        number = float(cell)
    except ValueError:
        return None
    return number if math.isfinite(number) else None


def _read_mat(path: Path) -> Curves:
    """ISETCam color filters and spectra: `wavelength`, `data` (a column per curve), `filterNames` if there.

    Version 5 files are read by SciPy as plain arrays; nothing in them is executed.
    """
    from scipy.io import loadmat  # noqa: PLC0415  (slow to import, seldom needed)
    from scipy.io.matlab import MatReadError  # noqa: PLC0415

    content = _read_bytes(path)
    try:
        fields = loadmat(io.BytesIO(content), squeeze_me=False, chars_as_strings=True)
    except NotImplementedError:
        raise DataError(
            Fault("a version 7.3 (HDF5) .mat file", str(path), allowed="version 5: save with -v6 or -v7")
        ) from None
    except (MatReadError, ValueError, TypeError, KeyError, IndexError, EOFError, OSError) as error:
        raise DataError(Fault(f"not a readable .mat file: {error}", str(path))) from None
    names = [name for name in fields if not name.startswith("__")]
    for needed in ("wavelength", "data"):
        if needed not in fields:
            raise DataError(Fault(f"no variable `{needed}`", str(path), value=names, nearest=nearest(needed, names)))
    try:
        wave = np.asarray(fields["wavelength"], dtype=float).ravel()
        data = np.atleast_2d(np.asarray(fields["data"], dtype=float))
    except (TypeError, ValueError):
        raise DataError(Fault("`wavelength` and `data` must be numbers", str(path))) from None
    if data.shape[0] != wave.size and data.shape[1] == wave.size:
        data = data.T
    if data.ndim != 2 or data.shape[0] != wave.size or not data.size:
        raise DataError(
            Fault("`data` does not fit `wavelength`", str(path), value=data.shape, allowed=f"({wave.size}, n)")
        )
    return _checked(path, wave, _mat_names(fields.get("filterNames"), data.shape[1]), data)


def _mat_names(raw: object, count: int) -> list[str]:
    items = [] if raw is None else [np.asarray(item).ravel() for item in np.asarray(raw, dtype=object).ravel()]
    names = [str(item[0]).strip() if item.size else "" for item in items]
    if len(names) == count and len(set(names)) == count and all(names):
        return names
    return [f"curve_{index + 1}" for index in range(count)]


def _checked(path: Path, wave: np.ndarray, names: Sequence[str], data: np.ndarray) -> Curves:
    values = {}
    for index, name in enumerate(names):
        try:
            wave, values[name] = check_samples(wave, data[:, index])
        except DataError as error:
            raise DataError(
                [Fault(f.problem, str(path), None, name, f.value, f.allowed) for f in error.faults]
            ) from None
    return Curves(wave, values, str(path))
