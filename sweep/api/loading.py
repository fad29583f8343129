"""Studies from files, from names and from Python values; finished runs."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeGuard

import numpy as np
from pydantic import BaseModel

from .. import study as studies_of_files
from ..base.errors import DataError, StudyError, ValidationIssue
from ..spectra import LightUnit
from ..spectra.light_files import lights_file
from ..spectra.spectrum import Curves
from ..study.shipped import shipped_names, study_path
from .channels import sensor_file
from .inline_curves import CurveLike, columns_of, only_column, table_to_curves, to_curves
from .objects import FinishedRun, LoadedStudy

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class CurveSource:
    """A sensor or lights for `make_study`: keys of a study, and curves that are in no file."""

    keys: Mapping[str, Any]
    curves: Mapping[str, Curves] = field(default_factory=dict)


def load_study(name: Path | str, data: Path | str | None = None, *, allow_code: bool = False) -> LoadedStudy:
    """Load and check a study.

    Parameters
    ----------
    name : path-like
        A study file, or the name of a study in ``studies/`` or of one that comes with the package.
    data : path-like, optional
        Folder in which the study's files are looked for first.
    allow_code : bool
        Permit the Python files and installed plug-ins that the study names to run.

    Returns
    -------
    LoadedStudy
        The checked study.

    Raises
    ------
    SweepError
        With one line per issue: file, line, key, value, allowed values and nearest name.

    Examples
    --------
    >>> import sweep
    >>> sweep.load_study("stopband")
    <study stopband: 116,286 designs on RGGB, RCCC, RCCB, RYYCy, RYNCy>
    """
    folder = None if data is None else Path(data)
    return LoadedStudy(studies_of_files.load_study(study_path(Path(name)), folder, allow_code=allow_code))


def read_run(folder: Path | str, data: Path | str | None = None, *, allow_code: bool = False) -> FinishedRun:
    """Open the folder of a finished run.

    Parameters
    ----------
    folder : path-like
        Output folder of the study, such as ``outputs/stopband``.
    data : path-like, optional
        Folder of the study's files; needed for `FinishedRun.study` if user code made the run.
    allow_code : bool
        Permit the code that the run was made with to run; needed in the same case.

    Returns
    -------
    FinishedRun
        Tables, curves, summary and study of the run.

    Raises
    ------
    SweepError
        If files are missing or differ from those that the run wrote.

    Examples
    --------
    >>> import sweep
    >>> sweep.read_run("outputs/stopband").best.cfa  # doctest: +SKIP
    'RYNCy'
    """
    from ..results.folder import run_folder  # noqa: PLC0415  (slow to import, and a study needs none)

    return FinishedRun(run_folder(folder), None if data is None else Path(data), allow_code=allow_code)


def studies() -> list[str]:
    """List the studies that come with the package.

    Returns
    -------
    list of str
        Names that `load_study` takes.

    Examples
    --------
    >>> import sweep
    >>> "stopband" in sweep.studies()
    True
    """
    return shipped_names()


def make_study(
    study: str = "python", *, sensor: Any = "ar0820", lights: Any = "tl16", allow_code: bool = False, **keys: Any
) -> LoadedStudy:
    """Make a study without a file.

    Parameters
    ----------
    study : str
        Name of the study.
    sensor, lights : str, mapping, or result of `sensor` or `lights`
        QE curves and traffic lights.
    allow_code : bool
        Permit the code that the study names to run.
    **keys
        Further keys of a study file. Sections such as ``pixel`` are mappings or objects such as `Pixel`. A filter in
        ``boxes`` is one of which `evaluate` takes parameters.

    Returns
    -------
    LoadedStudy
        The checked study.

    Raises
    ------
    SweepError
        With one line per issue, as for a study file.

    Examples
    --------
    >>> import sweep
    >>> mine = sweep.make_study(cfas=["RGGB", "RYYCy"], pixel=sweep.Pixel(bits=10))
    >>> mine.evaluate().csd_yellow_red.round().tolist()
    [35.0, 8.0]
    >>> edges = {"cfa": "RYNCy", "channel": "N", "base": "Y", "to": "G"}
    >>> stopband = sweep.make_study(cfas=["RGGB", "RYNCy"], boxes={"edges": edges})
    >>> stopband.evaluate(left_nm=613, right_nm=651, left_width_nm=6, right_width_nm=6).csd_yellow_red.round().tolist()
    [234.0]
    """
    document = {"study": study, "sensor": sensor, "lights": lights, **keys}
    curves: dict[str, Curves] = {}
    for source in (sensor, lights):
        curves |= source.curves if isinstance(source, CurveSource) else {}
    try:
        plain = {key: _plain(value) for key, value in document.items()}
        return LoadedStudy(studies_of_files.study_of_keys(plain, Path.cwd(), curves, allow_code=allow_code))
    except RecursionError:
        raise StudyError("a value of the study holds itself, or is nested too deep") from None


def sensor(
    source: Path | str | pd.DataFrame | None = None,
    *,
    relative_to: str | None = None,
    name: str | None = None,
    clear: str | None = None,
    **channels: CurveLike,
) -> CurveSource:
    """Describe a sensor for `make_study`.

    Parameters
    ----------
    source : path-like or pandas.DataFrame, optional
        A built-in sensor, a file of QE curves, or a table with one column per curve and nm as its index. Columns of a
        file are matched to channels by their names.
    relative_to : str, optional
        The values of `channels` are transmissions, to be multiplied by this curve of the sensor.
    name : str, optional
        Name of the sensor.
    clear : str, optional
        Curve of a pixel without a filter.
    **channels : CurveLike
        Further curves by name: a Series over nm, (nm, values), or a file with one curve. QE, from 0 to 1.

    Returns
    -------
    CurveSource
        For the argument `sensor` of `make_study`.

    Raises
    ------
    SweepError
        If a curve cannot be used.

    Examples
    --------
    >>> import sweep
    >>> import numpy as np
    >>> nm = np.arange(400, 701)
    >>> sensor = sweep.sensor("ar0820", N=(nm, np.where(abs(nm - 630) < 15, 0.2, 1)), relative_to="Y")
    >>> study = sweep.make_study(sensor=sensor, cfas=["RYYCy", "RYNCy"])
    >>> study.evaluate().csd_yellow_red.round().tolist()
    [31.0, 193.0]
    """
    if source is None or isinstance(source, Path | str):
        return sensor_source(source, channels, relative_to=relative_to, name=name, clear=clear)
    if not _is_table(source):
        allowed = "a built-in sensor, a file, or a table with nm as its index"
        raise DataError(ValidationIssue("no sensor", value=type(source).__name__, allowed=allowed))
    return sensor_source(None, columns_of(source) | channels, relative_to=relative_to, name=name, clear=clear)


def sensor_source(
    source: Path | str | None,
    channels: Mapping[str, CurveLike],
    *,
    relative_to: str | None = None,
    name: str | None = None,
    clear: str | None = None,
) -> CurveSource:
    """Describe a sensor whose channels are in a mapping."""
    keys: dict[str, Any] = {"files": []}
    if source is not None and os.path.lexists(source):
        keys = sensor_file(Path(source)).keys(lambda path: str(path.absolute()))
    elif source is not None:
        keys["builtin"] = str(source)
    curves, relative = dict[str, Curves](), {} if relative_to is None else {"relative_to": relative_to}
    for channel, curve in channels.items():
        if isinstance(curve, Path | str):
            file, column = str(Path(curve).absolute()), only_column(channel, Path(curve))[1]
        else:
            file, column = f"curve {channel}", channel
            curves[file] = to_curves(channel, curve)
        keys["files"].append({"file": file, "columns": {channel: column}, **relative})
    if not keys["files"] and name is None and clear is None:
        return CurveSource(keys)
    return CurveSource(keys | {k: v for k, v in {"name": name, "clear": clear}.items() if v is not None}, curves)


def lights(
    source: Path | str | pd.DataFrame,
    *,
    quantity: LightUnit | None = None,
    types: Mapping[str, list[str]] | None = None,
) -> CurveSource:
    """Describe traffic lights for `make_study`.

    Parameters
    ----------
    source : path-like or pandas.DataFrame
        A built-in data set, a file of spectra, or a table with one column per light and nm as its index.
    quantity : {'energy', 'photons'}, optional
        Unit of the values: energy or photons per nm, relative. Left out, what the heads of a file say, else energy.
    types : mapping of str to list of str, optional
        Columns of each signal type. Left out, columns of a file are assigned by their chromaticity.

    Returns
    -------
    CurveSource
        For the argument `lights` of `make_study`.

    Raises
    ------
    SweepError
        If a spectrum cannot be used, or if a table has no `types`.

    Examples
    --------
    >>> import sweep
    >>> import numpy as np, pandas as pd
    >>> nm = np.arange(400, 701)
    >>> leds = pd.DataFrame({k: np.exp(-((nm - c) / 12.0) ** 2) for k, c in [("amber", 592), ("ruby", 636)]}, index=nm)
    >>> lights = sweep.lights(leds, types={"yellow": ["amber"], "red": ["ruby"]})
    >>> sweep.make_study(lights=lights, cfas=["RGGB"]).evaluate().csd_yellow_red.round().tolist()
    [182.0]
    """
    texts = [kind for kind, columns in (types or {}).items() if isinstance(columns, str)]
    if texts:
        raise DataError(ValidationIssue("columns of a type", key=f"types.{texts[0]}", allowed="a list of names"))
    signals = None if types is None else {kind: list(columns) for kind, columns in types.items()}
    if _is_table(source):
        if signals is None:
            raise DataError(
                ValidationIssue("signal types of a table are missing", key="types", allowed="{type: [column, ...]}")
            )
        entry = {"file": "lights given", "quantity": quantity or "energy", "signals": signals}
        return CurveSource({"files": [entry]}, {"lights given": table_to_curves(source)})
    if not isinstance(source, Path | str):
        allowed = "built-in lights, a file, or a table with nm as its index"
        raise DataError(ValidationIssue("no lights", value=type(source).__name__, allowed=allowed))
    path = Path(source)
    if not os.path.lexists(path):
        if types is not None or quantity is not None:
            key = "quantity" if types is None else "types"
            raise DataError(ValidationIssue("built-in lights have their own", key=key, allowed="a file or table"))
        return CurveSource({"builtin": str(source)})
    if signals is None:
        return CurveSource(lights_file(path, quantity).keys(lambda place: str(place.absolute())))
    stated = {} if quantity is None else {"quantity": quantity}
    return CurveSource({"files": [{"file": str(path.absolute()), **stated, "signals": signals}]})


def _is_table(source: object) -> TypeGuard[pd.DataFrame]:
    if source is None or isinstance(source, Path | str):
        return False
    import pandas as pd  # noqa: PLC0415  (slow to import: kept off the start-up path)

    return isinstance(source, pd.DataFrame)


def _plain(value: Any) -> Any:
    """Return a value as a study file could hold it."""
    if isinstance(value, CurveSource):
        return _plain(value.keys)
    if isinstance(value, BaseModel):
        return _plain(value.model_dump(mode="json", by_alias=True, exclude_unset=True))
    if isinstance(value, Mapping):
        return {str(key): _plain(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(inner) for inner in value]
    if isinstance(value, np.ndarray | np.generic):
        return _plain(value.tolist())
    return str(value) if isinstance(value, Path) else value
