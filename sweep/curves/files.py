"""Read files of curves: wide CSV (`wavelength_nm`, one column per curve) and ISETCam `.mat` files."""

from __future__ import annotations

import csv
import hashlib
import io
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..disk import NO_UTF_16, not_utf8, read_input
from ..errors import DataError, Fault, nearest
from ..types import FloatArray
from .mat_files import DamagedError, read_variables
from .spectrum import LARGEST, Curves, check_samples

WAVELENGTH = "wavelength_nm"
MOST_BYTES = 40_000_000
MOST_CURVES = 2_000
MOST_SAMPLES = 100_000
MOST_VALUES = 2_000_000
"""Limits of a file of curves: 2,000 curves of 1,000 samples are read in a second or two."""
_MOST_CELL_FAULTS = 10_000
_MAT_VARIABLES = ("wavelength", "data", "filterNames")
_NUMBER = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?")
_ODD = re.compile(r"[^0-9eE+\-. \t]")
_DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?")


def digest(path: Path) -> str:
    """SHA-256 of a file's bytes, hexadecimal; raises DataError when it cannot be read."""
    return hashlib.sha256(read_input(path, MOST_BYTES, DataError)).hexdigest()


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

    Raises DataError (file, line, column, value) on anything that is not clean: see `spectrum.check_samples`.
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


def _decoded(path: Path) -> tuple[str, list[Fault]]:
    """A file's text, and the fault of one that is not UTF-8."""
    content = read_input(path, MOST_BYTES, DataError)
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        problem, wide = not_utf8(content, error)
        fault = Fault(problem, str(path), allowed=NO_UTF_16 if wide else None)
        return content.decode("utf-16" if wide else "latin-1", errors="replace"), [fault]
    if "\0" in text:
        return text.replace("\0", ""), [Fault("NUL characters in the text", str(path), allowed=NO_UTF_16)]
    return text, []


def _scan_csv(path: Path) -> Scan:
    text, layout = _decoded(path)
    file = str(path)
    lines = (line for line in io.StringIO(text, newline=None) if line.strip() and not line.startswith("#"))
    first = next(lines, "")
    delimiter = next((mark for mark in (",", ";", "\t") if mark in first), ",")
    _check_size(file, None, sum(1 for _ in lines), first.count(delimiter))  # before all is taken apart
    reader = csv.reader(io.StringIO(text, newline=None), delimiter=delimiter)
    try:
        rows = [(reader.line_num, row) for row in reader if any(c.strip() for c in row) and not row[0].startswith("#")]
    except csv.Error as error:
        raise DataError([*layout, Fault(f"not a readable CSV: {error}", file, reader.line_num)]) from None
    if not rows:
        raise DataError(
            [*layout, Fault("the file is empty", file, allowed=f"a header `{WAVELENGTH},...` and rows of numbers")]
        )
    line, header = rows[0][0], [cell.strip() for cell in rows[0][1]]
    _check_size(file, line, len(rows) - 1, len(header) - 1)
    if delimiter != ",":
        problem, allowed = "columns are not separated by commas", "`,` between columns, `.` in numbers"
        layout.append(Fault(problem, file, line, value=delimiter, allowed=allowed))
    layout += _header_faults(file, line, header)
    table, cells = _Cells(file, header, decimal="," if delimiter != "," else ".").read(rows[1:])
    wave, values, names = table[:, 0], table[:, 1:], distinct(header[1:])
    clean = not layout and not cells
    samples = _sample_faults(path, wave, names, values) if clean else _unit_faults(path, wave)
    return Scan(wave, names, values, tuple(tuple(group) for group in (layout, cells, *samples) if group))


def _check_size(file: str, line: int | None, n_samples: int, n_curves: int) -> None:
    """Refuse what would take minutes to read, before it is read."""
    for what, count, most in (
        ("curves", n_curves, MOST_CURVES),
        ("samples", n_samples, MOST_SAMPLES),
        ("values", n_samples * n_curves, MOST_VALUES),
    ):
        if count > most:
            raise DataError(Fault(f"too many {what} in one file", file, line, None, count, f"at most {most:,}"))


@dataclass
class _Cells:
    """The numbers of a CSV, and the faults of its cells and rows: at most MOST_CELL_FAULTS."""

    file: str
    header: list[str]
    decimal: str
    faults: list[Fault] = field(default_factory=list)

    def read(self, rows: list[tuple[int, list[str]]]) -> tuple[FloatArray, list[Fault]]:
        """ndarray[n_samples, n_columns], NaN where a cell is no number; and the faults, row by row."""
        values = np.full((len(rows), len(self.header)), np.nan)
        before = np.nan
        for index, (line, row) in enumerate(rows):
            if len(self.faults) >= _MOST_CELL_FAULTS:
                self.faults.append(Fault("too many faults; what follows was not read", self.file, line))
                break
            if len(row) != len(self.header):
                self.add("wrong number of columns", line, None, len(row), str(len(self.header)))
                before = np.nan
                continue
            values[index] = self.row(line, row)
            if values[index, 0] <= before:
                same = values[index, 0] == before
                problem = "wavelength occurs twice" if same else "wavelengths are not sorted"
                self.add(problem, line, WAVELENGTH, values[index, 0].item(), "strictly increasing")
            before = values[index, 0]
        return values, self.faults

    def row(self, line: int, row: list[str]) -> list[float]:
        """The numbers of a row, NaN for what is none."""
        try:
            if not any(map(_ODD.search, row)):
                numbers = list(map(float, row))
                if min(numbers[1:], default=0.0) >= 0 and max(numbers) <= LARGEST:
                    return [number + 0.0 for number in numbers]
        except ValueError:
            pass  # which cell it is, is found below
        return [
            self.cell(line, name, cell, first=index == 0)
            for index, (name, cell) in enumerate(zip(self.header, row, strict=True))
        ]

    def cell(self, line: int, name: str, cell: str, *, first: bool) -> float:
        """One cell's number, NaN when it is none."""
        number = _number(cell.replace(self.decimal, "."))
        if number is None:
            comma = "; a decimal comma? use a point" if _DECIMAL_COMMA.fullmatch(cell.strip()) else ""
            self.add("not a usable number", line, name, cell.strip(), f"finite, >= 0{comma}")
            return math.nan
        if not first and number < 0:
            self.add("negative value", line, name, cell.strip(), "finite, >= 0")
        if number > LARGEST:
            self.add("value too large", line, name, cell.strip(), f"0 to {LARGEST:g}")
        return number

    def add(self, problem: str, line: int, key: str | None, value: object, allowed: str) -> None:
        """Add a fault."""
        self.faults.append(Fault(problem, self.file, line, key, value, allowed))


def distinct(names: Sequence[str]) -> tuple[str, ...]:
    """Column names, numbered where one is empty or occurs twice."""
    found: dict[str, None] = {}
    for index, name in enumerate(names):
        own = name or f"column ({index + 2})"
        while own in found:
            own = f"{own} ({index + 2})"
        found[own] = None
    return tuple(found)


def _header_faults(file: str, line: int, header: list[str]) -> list[Fault]:
    if header[0] != WAVELENGTH:
        unit = "wrong unit of " if header[0].startswith("wavelength_") and ";" not in header[0] else "no column "
        return [Fault(f"{unit}wavelength", file, line, header[0], header[0], f"`{WAVELENGTH}` as the first column")]
    seen: set[str] = set()
    twice = [name for name in header if name in seen or seen.add(name)]  # type: ignore[func-returns-value]
    faults = [Fault("column occurs twice", file, line, name) for name in twice]
    if "" in header:
        faults.append(Fault("a column has no name", file, line, value=header))
    if len(header) < 2:
        faults.append(Fault("the file has no curve", file, line, allowed="one column or more beside the wavelength"))
    return faults


def _number(cell: str) -> float | None:
    """A finite number as tables have it; Python's own underscores and other scripts' digits are none."""
    number = float(cell) if _NUMBER.fullmatch(cell.strip()) else math.nan
    return number + 0.0 if math.isfinite(number) else None


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
    _check_size(file, None, *data.shape)
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
