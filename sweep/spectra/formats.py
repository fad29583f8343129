"""Files of curves by the ending of their names, as rows of cells: text, ISETCam, rawtoaces and spreadsheets."""

from __future__ import annotations

import hashlib
import io
import json
import math
import warnings
import zipfile
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ..base.disk import is_folder, read_input
from ..base.errors import DataError, ValidationIssue, nearest
from .clean import several
from .layouts import WAVELENGTH
from .read_table import MOST_CURVES, MOST_VALUES, Scan, check_size, curves_of
from .read_text import MOST_BYTES, Sheet, text_sheet
from .spectrum import Curves

_MAT_VARIABLES = ("wavelength", "data", "filterNames")
_MAT_NUMBERS = ("double", "single", *(f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)))
_MOST_UNPACKED = 200_000_000
_MOST_FILES = 500


def is_curve_file(name: str) -> bool:
    """Return whether a name has the ending of a file of curves."""
    return Path(name).suffix.casefold() in READERS


def files_in(folder: Path) -> list[Path]:
    """Return the files of curves of a folder, in the order of their names. Raises DataError for too many or none."""
    try:
        files = sorted(file for file in folder.iterdir() if is_curve_file(file.name) and not file.name.startswith("."))
    except OSError as error:
        raise DataError(ValidationIssue(f"cannot be read: {error.strerror}", str(folder))) from None
    if not 0 < len(files) <= _MOST_FILES:
        allowed = f"1 to {_MOST_FILES} files of {', '.join(READERS)}"
        raise DataError(
            ValidationIssue(
                "a folder without files of curves" if not files else "too many files",
                str(folder),
                value=len(files),
                allowed=allowed,
            )
        )
    return files


def digest(path: Path) -> str:
    """Return the SHA-256 of a file's bytes, or of the names and bytes of a folder's files of curves."""
    if not is_folder(path):
        return hashlib.sha256(read_input(path, MOST_BYTES, DataError)).hexdigest()
    parts = (
        file.name.encode() + b"\0" + hashlib.sha256(read_input(file, MOST_BYTES, DataError)).digest()
        for file in files_in(path)
    )
    return hashlib.sha256(b"".join(parts)).hexdigest()


def read_curves(path: Path) -> Curves:
    """Read every curve of a file or folder, as it stands there. Raises DataError with file, line, column and value."""
    scan = scan_curves(path)
    if scan.issues:
        raise DataError(scan.issues[0])
    return curves_from(scan, path)


def curves_from(scan: Scan, path: Path) -> Curves:
    """Return the curves of a scan without issues."""
    names = scan.names
    return Curves(
        scan.wavelength_nm,
        dict(zip(names, scan.values.T, strict=True)),
        str(path),
        notes=scan.notes,
        units=dict(zip(names, scan.units, strict=True)),
    )


def scan_curves(path: Path) -> Scan:
    """Read a file or folder as far as possible. Raises DataError if nothing can be read."""
    if is_folder(path):
        return _joined({file: scan_curves(file) for file in files_in(path)})
    reader = READERS.get(path.suffix.casefold())
    if reader is None:
        raise DataError(
            ValidationIssue("unknown kind of curve file", str(path), value=path.suffix, allowed=", ".join(READERS))
        )
    sheet = reader(path)
    sheet.name = sheet.name or ("" if reader is _mat_sheet else path.stem)
    return curves_of(sheet)


def _joined(scans: Mapping[Path, Scan]) -> Scan:
    """Join the curves of files; the only one of a file is called like the file."""
    grid = np.unique(np.concatenate([scan.wavelength_nm for scan in scans.values()]))
    count = sum(len(scan.names) for scan in scans.values())
    check_size(str(next(iter(scans)).parent), None, grid.size, count)
    values = np.full((grid.size, count), np.nan)
    names: list[str] = []
    for file, scan in scans.items():
        for name, own in zip(scan.names, scan.values.T, strict=True):
            known = np.isfinite(own)
            if known.any():
                values[:, len(names)] = np.interp(grid, scan.wavelength_nm[known], own[known], np.nan, np.nan)
            names.append(file.stem if len(scan.names) == 1 else f"{file.stem} {name}")
    units = tuple(replace(unit, group=file.name) for file, scan in scans.items() for unit in scan.units)
    issues = tuple(group for scan in scans.values() for group in scan.issues)
    said: dict[str, list[str]] = {}
    for file, scan in scans.items():
        for note in scan.notes:
            said.setdefault(note, []).append(file.name)
    notes = [f"{several(files)}: {note}" for note, files in said.items()]
    return Scan(grid, tuple(names), values, units, issues, (f"{len(scans)} files of a folder were read", *notes))


def _mat_sheet(path: Path) -> Sheet:
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
    names = _mat_names(fields.get("filterNames"), data.shape[1])
    return _sheet_of(file, wave.tolist(), dict(zip(names, data.T.tolist(), strict=True)))


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


def _mat_names(raw: object, count: int) -> list[str]:
    items = [] if raw is None else [np.asarray(item).ravel() for item in np.asarray(raw, dtype=object).ravel()]
    names = [str(item[0]).strip() if item.size else "" for item in items]
    return (
        names if len(names) == len(set(names)) == count and all(names) else [f"curve_{at + 1}" for at in range(count)]
    )


def _sheet_of(file: str, wave: list[Any], curves: Mapping[str, list[Any]], unit: str = "") -> Sheet:
    """Return numbers as the rows of a table."""
    rows = [
        (1, [WAVELENGTH, *curves]),
        *(
            (at, [repr(float(value)) for value in row])
            for at, row in enumerate(zip(wave, *curves.values(), strict=True), 2)
        ),
    ]
    return Sheet(file, rows, unit=unit)


def _json_sheet(path: Path) -> Sheet:
    """Read `spectral_data` of rawtoaces: cameras, whose response is per energy, and lights."""
    file = str(path)
    allowed = "the JSON of rawtoaces: `spectral_data: {index: {main: [R, G, B]}, data: {main: {'380': [...]}}}`"
    try:
        held = json.loads(read_input(path, MOST_BYTES, DataError))
        spectral = held["spectral_data"]
        (group, rows), *_ = spectral["data"].items()
        names = [str(name) for name in spectral["index"][group]]
        pairs = sorted((float(wave), [float(value) for value in values]) for wave, values in rows.items())
        check_size(file, None, len(pairs), len(names))
        curves = {name: [values[at] for _, values in pairs] for at, name in enumerate(names)}
        stated = str(spectral.get("units", ""))
    except DataError:
        raise
    except (ValueError, KeyError, TypeError, AttributeError, IndexError, RecursionError):
        raise DataError(ValidationIssue("not a JSON of curves", file, allowed=allowed)) from None
    camera = len(names) > 1
    sheet = _sheet_of(
        file,
        [wave for wave, _ in pairs],
        curves,
        "response per energy" if camera else stated if stated.casefold() != "relative" else "",
    )
    sheet.notes.append(
        "a camera of rawtoaces: its curves are taken as responses per energy"
        if camera
        else "spectral data of rawtoaces"
    )
    return sheet


def _excel_sheet(path: Path) -> Sheet:
    """Read the first sheet of a spreadsheet that has a table."""
    file, content = str(path), read_input(path, MOST_BYTES, DataError)
    import pandas as pd  # noqa: PLC0415  (slow to import)

    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            size = sum(item.file_size for item in archive.infolist())
        if size > _MOST_UNPACKED:
            raise DataError(
                ValidationIssue(
                    "too large a spreadsheet", file, value=size, allowed=f"at most {_MOST_UNPACKED:,} bytes unpacked"
                )
            )
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of styles and such
            frames = pd.read_excel(
                io.BytesIO(content),
                sheet_name=None,
                header=None,
                engine="openpyxl",
                dtype=object,
                nrows=MOST_VALUES // 10,
            )
    except DataError:
        raise
    except Exception as error:  # of damaged archives the reader raises whatever it meets first
        raise DataError(ValidationIssue(f"not a readable spreadsheet: {type(error).__name__}", file)) from None
    refused: DataError | None = None
    for name, frame in frames.items():
        check_size(file, None, len(frame), min(frame.shape[1], MOST_CURVES + 1))
        rows = [
            (at, [_cell(value) for value in row]) for at, row in enumerate(frame.itertuples(index=False, name=None), 1)
        ]
        sheet = Sheet(file, [(at, row) for at, row in rows if any(row)], [f"sheet {name!r} of a spreadsheet"])
        try:
            curves_of(Sheet(file, sheet.rows))
        except DataError as error:
            refused = refused or error
            continue
        return sheet
    raise refused or DataError(ValidationIssue("the file is empty", file))


def _cell(value: Any) -> str:
    """Return a cell of a spreadsheet as text."""
    if value is None or value != value:  # noqa: PLR0124  (NaN)
        return ""
    return repr(float(value)) if isinstance(value, int | float) and not isinstance(value, bool) else str(value)


READERS: dict[str, Callable[[Path], Sheet]] = {
    **dict.fromkeys((".csv", ".tsv", ".txt", ".dat", ".asc", ".isd", ".prn"), text_sheet),
    ".mat": _mat_sheet,
    ".json": _json_sheet,
    ".xlsx": _excel_sheet,
}
"""Readers by the ending of a file's name."""
