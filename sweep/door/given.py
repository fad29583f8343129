"""Curves as people have them in Python: a series over wavelength, two arrays, values on the grid, a file."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from ..base.errors import DataError, Fault
from ..base.types import FloatArray
from ..curves.files import read_curves
from ..curves.spectrum import Curves, WavelengthGrid, check_samples, resample

if TYPE_CHECKING:
    import pandas as pd

CurveLike: TypeAlias = "pd.Series | FloatArray | tuple[Any, Any] | Path | str"
"""A series whose index is nm, values on a study's grid, (nm, values), or a file with one curve."""
_FORMS = "a series whose index is nm, (nm, values), or a file with one curve"


def curves_table(file: Path | str) -> pd.DataFrame:
    """The curves of a file, a column each; the index is nm.

    >>> import sweep
    >>> curves = sweep.read_curves("my_filter.csv")  # doctest: +SKIP
    >>> curves["N"].max()  # doctest: +SKIP
    0.61

    The values are the file's own: nothing is scaled. Raises SweepError with file and line for what is not clean.
    """
    read = read_curves(Path(file))
    return over_nm(read.wavelength_nm, read.values)


def over_nm(wavelength_nm: FloatArray, columns: Mapping[Any, FloatArray]) -> pd.DataFrame:
    """A table with a column per curve; the index is nm."""
    import pandas as pd  # noqa: PLC0415  (slow to import: kept off the start-up path)

    return pd.DataFrame(dict(columns), index=pd.Index(wavelength_nm, name="wavelength_nm"))


def as_curves(name: str, curve: CurveLike) -> Curves:
    """One curve with its samples, under a name of its own; raises DataError for what is none."""
    if isinstance(curve, Path | str):
        return _of_file(name, Path(curve))
    if isinstance(curve, tuple) and len(curve) == 2:
        wave, values = np.asarray(curve[0]), np.asarray(curve[1])
    else:
        import pandas as pd  # noqa: PLC0415  (slow to import: kept off the start-up path)

        if not isinstance(curve, pd.Series):
            raise DataError(Fault("no curve over wavelength", key=name, value=type(curve).__name__, allowed=_FORMS))
        wave, values = curve.index.to_numpy(), curve.to_numpy()
    try:
        return Curves(*_checked(name, wave, values), source=name)
    except (TypeError, ValueError):
        raise DataError(Fault("a curve's samples are numbers", key=name, allowed=_FORMS)) from None


def curves_of_table(table: pd.DataFrame) -> Curves:
    """A table with a column per curve and nm as its index; raises DataError for curves that are not clean."""
    columns = {str(name): as_curves(str(name), column) for name, column in table.items()}
    if not columns:
        raise DataError(Fault("a table without curves", allowed="a column per curve, nm as the index"))
    nodes_nm = next(iter(columns.values())).wavelength_nm
    return Curves(nodes_nm, {name: curves.values[name] for name, curves in columns.items()}, "table")


def _checked(name: str, wave: Any, values: Any) -> tuple[FloatArray, Mapping[str, FloatArray]]:
    try:
        nodes_nm, samples = check_samples(np.asarray(wave, dtype=float), np.asarray(values, dtype=float))
    except DataError as error:
        raise DataError([Fault(f.problem, None, None, name, f.value, f.allowed) for f in error.faults]) from None
    return nodes_nm, {name: samples}


def _of_file(name: str, path: Path) -> Curves:
    read = read_curves(path)
    if len(read.values) != 1:
        shown = ", ".join(list(read.values)[:10])
        allowed = f'one of them: sweep.read_curves("{path}")["NAME"]'
        raise DataError(Fault("a file of several curves", str(path), None, name, shown, allowed))
    (values,) = read.values.values()
    return Curves(read.wavelength_nm, {name: values}, str(path))


def on_grid(name: str, curve: CurveLike, grid: WavelengthGrid) -> FloatArray:
    """Curves on a study's grid, ndarray[n_designs, n_wavelengths].

    Arrays have their values there already, one curve or a row for each; others are brought there linearly. Raises
    DataError for what is no curve, is not clean, or does not cover the grid.
    """
    if isinstance(curve, np.ndarray):
        rows = np.atleast_2d(np.asarray(curve, dtype=float))
        if rows.ndim != 2 or rows.shape[1] != grid.size:
            allowed = f"{grid.size} values, on the study's wavelengths, or rows of these; or {_FORMS}"
            raise DataError(Fault("an array that does not fit the grid", key=name, value=curve.shape, allowed=allowed))
        for row in rows:
            _checked(name, grid.nodes_nm, row)
        return rows
    read = as_curves(name, curve)
    try:
        return resample(read.wavelength_nm, read.values[name], grid)[None]
    except DataError as error:
        raise DataError([Fault(f.problem, None, None, name, f.value, f.allowed) for f in error.faults]) from None
