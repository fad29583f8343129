"""Curves given in Python: a pandas Series, two arrays, values on the wavelength grid, or a file."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from ..base.errors import DataError, ValidationIssue
from ..base.types import Array, Float, FloatArray, PerSample, PerWavelength
from ..spectra import formats
from ..spectra.spectrum import Curves, WavelengthGrid, check_samples, resample
from ..spectra.units import FITTING, Use, used_as

if TYPE_CHECKING:
    import pandas as pd

CurveLike: TypeAlias = "pd.Series | FloatArray | tuple[Any, Any] | Path | str"
"""A Series over nm, values on a study's wavelength grid, a pair (nm, values), or a file with one curve."""
_FORMS = "a series whose index is nm, (nm, values), or a file with one curve"


def read_curves(file: Path | str) -> pd.DataFrame:
    """Read the curves of a file.

    Parameters
    ----------
    file : path-like
        A file with one or more curves (text of any table or instrument, spreadsheet, ISETCam ``.mat``, rawtoaces
        ``.json``), or a folder of such files.

    Returns
    -------
    pandas.DataFrame
        One column per curve; the index is the wavelength, nm. Values are those of the file, without scaling, and NaN
        beyond the samples of a curve; ``attrs["units"]`` has what the heads say, ``attrs["notes"]`` how it was read.

    Raises
    ------
    SweepError
        If the file cannot be read or has samples that are not clean, with file and line.

    Examples
    --------
    >>> import sweep
    >>> curves = sweep.read_curves("my_filter.csv")  # doctest: +SKIP
    >>> curves["N"].max()  # doctest: +SKIP
    0.61
    """
    curves = formats.read_curves(Path(file))
    table = wavelength_table(curves.wavelength_nm, curves.values)
    table.attrs["units"] = {name: unit.words for name, unit in curves.units.items()}
    table.attrs["notes"] = list(curves.notes)
    return table


def wavelength_table(wavelength_nm: PerWavelength, columns: Mapping[Any, PerWavelength]) -> pd.DataFrame:
    """Return a table with one column per curve over wavelength."""
    import pandas as pd  # noqa: PLC0415  (slow to import: kept off the start-up path)

    return pd.DataFrame(dict(columns), index=pd.Index(wavelength_nm, name="wavelength_nm"))


def to_curves(name: str, curve: CurveLike) -> Curves:
    """Convert one curve to samples over its own wavelengths."""
    if isinstance(curve, Path | str):
        curves, column = only_column(name, Path(curve))
        units = {name: curves.units[column]}
        return Curves(curves.wavelength_nm, {name: curves.values[column]}, str(curve), units=units)
    if isinstance(curve, tuple) and len(curve) == 2:
        wavelength_nm, values = curve
    else:
        import pandas as pd  # noqa: PLC0415  (slow to import: kept off the start-up path)

        if not isinstance(curve, pd.Series):
            raise DataError(
                ValidationIssue("no curve over wavelength", key=name, value=type(curve).__name__, allowed=_FORMS)
            )
        wavelength_nm, values = curve.index.to_numpy(), curve.to_numpy()
    return Curves(*_checked(name, wavelength_nm, values), source=name)


def columns_of(table: pd.DataFrame) -> dict[str, pd.Series]:
    """Return the columns of a table by their names as texts; raises DataError for one name twice."""
    names = [str(name) for name in table.columns]
    if twice := [name for at, name in enumerate(names) if name in names[:at]]:
        raise DataError(ValidationIssue("column occurs twice", key=twice[0], allowed="names that differ as texts"))
    return {name: table.iloc[:, at] for at, name in enumerate(names)}


def table_to_curves(table: pd.DataFrame) -> Curves:
    """Return the columns of a table, indexed by nm, as `Curves`."""
    columns = {name: to_curves(name, column) for name, column in columns_of(table).items()}
    if not columns:
        raise DataError(ValidationIssue("a table without curves", allowed="a column per curve, nm as the index"))
    nodes_nm = next(iter(columns.values())).wavelength_nm
    return Curves(nodes_nm, {name: curves.values[name] for name, curves in columns.items()}, "table")


def on_grid(
    name: str, curve: CurveLike, grid: WavelengthGrid, use: Use = "sensor"
) -> Float[Array, "curves wavelengths"]:
    """Bring one or more curves to a study's wavelength grid."""
    if isinstance(curve, np.ndarray):
        rows = np.atleast_2d(_numbers(name, curve))
        if rows.ndim != 2 or rows.shape[1] != grid.size:
            allowed = f"{grid.size} values, on the study's wavelengths, or rows of these; or {_FORMS}"
            raise DataError(
                ValidationIssue("an array that does not fit the grid", key=name, value=curve.shape, allowed=allowed)
            )
        for row in rows:
            _checked(name, grid.nodes_nm, row)
        return rows
    curves = to_curves(name, curve)
    if curves.units:
        curves = used_as(curves, [name], use)
    try:
        return resample(*curves.samples(name), grid)[None]
    except DataError as error:
        raise _named(error, name) from None


def filter_on_grid(
    name: str, curve: CurveLike, grid: WavelengthGrid, base: PerWavelength, relative_to: PerWavelength | None
) -> Float[Array, "curves wavelengths"]:
    """Bring filters to a grid as QE: a file of no QE has transmissions, of the curve that the filter replaces (`base`).

    `relative_to`: all values are transmissions of this curve.
    """
    if relative_to is not None:
        return on_grid(name, curve, grid, "filter") * relative_to
    if isinstance(curve, str | Path):
        told = to_curves(name, curve).units[name].quantity
        if told not in FITTING["sensor"]:
            return on_grid(name, curve, grid, "filter") * base
    return on_grid(name, curve, grid)


def _checked(name: str, wavelength_nm: Any, values: Any) -> tuple[PerSample, Mapping[str, PerSample]]:
    try:
        nodes_nm, samples = check_samples(_numbers(name, wavelength_nm), _numbers(name, values))
    except DataError as error:
        raise _named(error, name) from None
    return nodes_nm, {name: samples}


def _numbers(name: str, values: Any) -> FloatArray:
    """Return a copy of real numbers, so that what the user does with the array afterwards changes nothing."""
    try:
        array = np.array(values)
        if array.dtype.kind not in "fiu" or np.ma.is_masked(values):
            raise ValueError(array.dtype)
        return array.astype(float)
    except (TypeError, ValueError):
        allowed = f"real numbers, none of them masked; {_FORMS}"
        raise DataError(ValidationIssue("a curve's samples are numbers", key=name, allowed=allowed)) from None


def _named(error: DataError, name: str) -> DataError:
    return DataError([ValidationIssue(f.problem, None, None, name, f.value, f.allowed) for f in error.issues])


def only_column(name: str, path: Path) -> tuple[Curves, str]:
    """Return the curve of a file with its column; raises DataError if it has several."""
    curves = formats.read_curves(path)
    if len(curves.values) != 1:
        shown = ", ".join(list(curves.values)[:10])
        allowed = f'one of them: sweep.read_curves("{path}")["NAME"]'
        raise DataError(ValidationIssue("a file of several curves", str(path), None, name, shown, allowed))
    return curves, next(iter(curves.values))
