"""Read files of curves: wide CSV (`wavelength_nm`, one column per curve) and ISETCam `.mat` files."""

from __future__ import annotations

import codecs
import csv
import hashlib
import io
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .arrays import FloatArray
from .errors import DataError, Fault, nearest
from .spectra import Curves, check_samples

WAVELENGTH = "wavelength_nm"
NO_UTF_16 = "UTF-8; UTF-16? save as UTF-8"
"""What is allowed where the text of a file looks like that."""
_DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?")


def digest(path: Path) -> str:
    """SHA-256 of a file's bytes, hexadecimal; raises DataError when it cannot be read."""
    return hashlib.sha256(_read_bytes(path)).hexdigest()


@dataclass(frozen=True)
class Scan:
    """A file of curves, read as far as it can be.

    `wavelength_nm`: ndarray[n_samples] as the file has it. `values`: ndarray[n_samples, n_curves], a column per name.
    What is not a number is NaN in both. `faults`: what is wrong, in groups; `read_curves` stops at the first group.
    """

    wavelength_nm: FloatArray
    names: tuple[str, ...]
    values: FloatArray
    faults: tuple[tuple[Fault, ...], ...]


def read_curves(path: Path) -> Curves:
    """Read every curve of a CSV or `.mat` file, unscaled and in the file's own quantity.

    Raises DataError (file, line, column, value) on anything that is not clean: see `spectra.check_samples`.
    """
    scan = scan_curves(path)
    if scan.faults:
        raise DataError(scan.faults[0])
    return Curves(scan.wavelength_nm, dict(zip(scan.names, scan.values.T, strict=True)), str(path))


def scan_curves(path: Path) -> Scan:
    """Read a CSV or `.mat` file as far as possible, and say everything that is wrong with it.

    Raises DataError where nothing can be read at all: no file, an unknown kind, no numbers.
    """
    suffix = path.suffix.casefold()
    if suffix == ".csv":
        return _scan_csv(path)
    if suffix == ".mat":
        return _scan_mat(path)
    raise DataError(Fault("unknown kind of curve file", str(path), value=path.suffix, allowed=".csv, .mat"))


def _read_bytes(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise DataError(Fault(f"cannot be read: {error.strerror or error}", str(path))) from None


def _decoded(path: Path) -> tuple[str, list[Fault]]:
    """A file's text, and the fault of one that is not UTF-8."""
    content = _read_bytes(path)
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        wide = content[:2] in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
        problem = f"not UTF-8 text ({error.reason} at byte {error.start})"
        fault = Fault(problem, str(path), allowed=NO_UTF_16 if wide else None)
        return content.decode("utf-16" if wide else "latin-1", errors="replace"), [fault]
    if "\0" in text:
        return text.replace("\0", ""), [Fault("NUL characters in the text", str(path), allowed=NO_UTF_16)]
    return text, []


def _scan_csv(path: Path) -> Scan:
    text, layout = _decoded(path)
    first = next((line for line in text.splitlines() if line.strip() and not line.startswith("#")), "")
    delimiter = next((mark for mark in (",", ";", "\t") if mark in first), ",")
    reader = csv.reader(io.StringIO(text, newline=None), delimiter=delimiter)
    try:
        rows = [(reader.line_num, row) for row in reader if any(c.strip() for c in row) and not row[0].startswith("#")]
    except csv.Error as error:
        raise DataError([*layout, Fault(f"not a readable CSV: {error}", str(path), reader.line_num)]) from None
    if not rows:
        raise DataError(
            [*layout, Fault("the file is empty", str(path), allowed=f"a header `{WAVELENGTH},...` and rows of numbers")]
        )
    line, header = rows[0][0], [cell.strip() for cell in rows[0][1]]
    if delimiter != ",":
        problem, allowed = "columns are not separated by commas", "`,` between columns, `.` in numbers"
        layout.append(Fault(problem, str(path), line, value=delimiter, allowed=allowed))
    layout += _header_faults(str(path), line, header)
    table, cells = _scan_cells(str(path), header, rows[1:], decimal="," if delimiter != "," else ".")
    wave, values, names = table[:, 0], table[:, 1:], distinct(header[1:])
    clean = not layout and not cells
    samples = _sample_faults(path, wave, names, values) if clean else _unit_faults(path, wave)
    return Scan(wave, names, values, tuple(tuple(group) for group in (layout, cells, *samples) if group))


def _scan_cells(
    file: str, header: list[str], rows: list[tuple[int, list[str]]], decimal: str
) -> tuple[FloatArray, list[Fault]]:
    """The numbers, ndarray[n_samples, n_columns], NaN where a cell is none; and the faults of cells and rows."""
    faults = []
    values = np.full((len(rows), len(header)), np.nan)
    for index, (line, row) in enumerate(rows):
        if len(row) != len(header):
            faults.append(Fault("wrong number of columns", file, line, value=len(row), allowed=str(len(header))))
            continue
        for column, cell in enumerate(row):
            number = _number(cell.replace(decimal, "."))
            if number is None:
                comma = "; a decimal comma? use a point" if _DECIMAL_COMMA.fullmatch(cell.strip()) else ""
                allowed = f"finite, >= 0{comma}"
                faults.append(Fault("not a usable number", file, line, header[column], cell.strip(), allowed))
                continue
            values[index, column] = number
            if column > 0 and number < 0:
                faults.append(Fault("negative value", file, line, header[column], cell.strip(), "finite, >= 0"))
        if index and values[index, 0] <= values[index - 1, 0]:
            problem = (
                "wavelength occurs twice" if values[index, 0] == values[index - 1, 0] else "wavelengths are not sorted"
            )
            faults.append(Fault(problem, file, line, WAVELENGTH, values[index, 0].item(), "strictly increasing"))
    return values, faults


def distinct(names: Sequence[str]) -> tuple[str, ...]:
    """Column names, numbered where one is empty or occurs twice."""
    found: list[str] = []
    for index, name in enumerate(names):
        own = name or f"column ({index + 2})"
        while own in found:
            own = f"{own} ({index + 2})"
        found.append(own)
    return tuple(found)


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


def _scan_mat(path: Path) -> Scan:
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
        if any(np.iscomplexobj(fields[needed]) for needed in ("wavelength", "data")):
            raise TypeError
        wave = np.asarray(fields["wavelength"], dtype=float).ravel()
        data = np.atleast_2d(np.asarray(fields["data"], dtype=float))
    except (TypeError, ValueError):
        raise DataError(Fault("`wavelength` and `data` must be real numbers", str(path))) from None
    if data.shape[0] != wave.size and data.shape[1] == wave.size:
        data = data.T
    if data.ndim != 2 or data.shape[0] != wave.size or not data.size:
        raise DataError(
            Fault("`data` does not fit `wavelength`", str(path), value=data.shape, allowed=f"({wave.size}, n)")
        )
    columns = _mat_names(fields.get("filterNames"), data.shape[1])
    return Scan(wave, columns, data, tuple(map(tuple, _sample_faults(path, wave, columns, data))))


def _mat_names(raw: object, count: int) -> tuple[str, ...]:
    items = [] if raw is None else [np.asarray(item).ravel() for item in np.asarray(raw, dtype=object).ravel()]
    names = tuple(str(item[0]).strip() if item.size else "" for item in items)
    if len(names) == count and len(set(names)) == count and all(names):
        return names
    return tuple(f"curve_{index + 1}" for index in range(count))


def _sample_faults(path: Path, wave: FloatArray, names: Sequence[str], data: FloatArray) -> list[list[Fault]]:
    """What `check_samples` refuses, a group for each curve."""
    found = []
    for index, name in enumerate(names):
        try:
            check_samples(wave, data[:, index])
        except DataError as error:
            found.append([Fault(f.problem, str(path), None, name, f.value, f.allowed) for f in error.faults])
    return found


def _unit_faults(path: Path, wave: FloatArray) -> list[list[Fault]]:
    """What is wrong with the wavelengths beside faults that have a line of their own."""
    sorted_nm = np.unique(wave[np.isfinite(wave)])
    return _sample_faults(path, sorted_nm, [WAVELENGTH], np.zeros((sorted_nm.size, 1)))
