"""Studies from files, from names and from values of Python."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeGuard

import numpy as np
from pydantic import BaseModel

from ..base.disk import is_file
from ..base.errors import DataError, Fault
from ..curves.light_files import lights_file
from ..curves.light_unit import LightUnit
from ..curves.spectrum import Curves
from ..study import load_study, study_of_keys
from ..study.shipped import shipped_names, study_path
from .channels import sensor_file
from .given import CurveLike, as_curves, curves_of_table
from .objects import FinishedRun, LoadedStudy

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class Given:
    """A sensor or lights for `make_study`: what a study says of them, and curves that stand in no file."""

    keys: Mapping[str, Any]
    curves: Mapping[str, Curves] = field(default_factory=dict)


def opened_study(name: Path | str, data: Path | str | None = None, *, allow_code: bool = False) -> LoadedStudy:
    """Load and check a study: a file, or the name of one in `studies/` or of one that comes with the package.

    >>> import sweep
    >>> sweep.load_study("stopband")
    <study stopband: 116,286 designs on RGGB, RCCC, RCCB, RYYCy, RYNCy>

    `data`: folder that its files are looked for in first. `allow_code`: code that the study names may run.
    Raises SweepError with a line for each thing that is wrong.
    """
    folder = None if data is None else Path(data)
    return LoadedStudy(load_study(study_path(Path(name)), folder, allow_code=allow_code))


def finished_run(folder: Path | str, data: Path | str | None = None, *, allow_code: bool = False) -> FinishedRun:
    """A finished run's folder as an object; raises SweepError where files are missing or not as the run wrote them.

    >>> import sweep
    >>> sweep.read_run("outputs/stopband").best.cfa  # doctest: +SKIP
    'RYNCy'

    `data`: folder of its files, `allow_code`: the code that it was made with may run; its `.study` needs both where a
    Python file made it.
    """
    return FinishedRun(Path(folder), None if data is None else Path(data), allow_code=allow_code)


def studies() -> list[str]:
    """Names of the studies that come with the package.

    >>> import sweep
    >>> "stopband" in sweep.studies()
    True
    """
    return shipped_names()


def made_study(
    study: str = "python", *, sensor: Any = "ar0820", lights: Any = "tl16", allow_code: bool = False, **keys: Any
) -> LoadedStudy:
    """A study without a file: the keys of a study file as values, sensor and lights also from `sensor` and `lights`.

    >>> import sweep
    >>> mine = sweep.make_study(cfas=["RGGB", "RYYCy"], pixel=sweep.Pixel(bits=10))
    >>> mine.evaluate().csd_yellow_red.round().tolist()
    [35.0, 8.0]

    Sections such as `pixel` are mappings or the package's own objects. `allow_code`: code that it names may run. Raises
    SweepError as a study file does.
    """
    said = {"study": study, "sensor": sensor, "lights": lights, **keys}
    given: dict[str, Curves] = {}
    for part in (sensor, lights):
        given |= part.curves if isinstance(part, Given) else {}
    plain = {key: _plain(value) for key, value in said.items()}
    return LoadedStudy(study_of_keys(plain, Path.cwd(), given, allow_code=allow_code))


def own_sensor(
    source: Path | str | pd.DataFrame | None = None,
    *,
    relative_to: str | None = None,
    name: str | None = None,
    clear: str | None = None,
    **channels: CurveLike,
) -> Given:
    """A sensor for `make_study`: built in, a file of QE curves or a table of them, with own curves beside it or alone.

    >>> import sweep
    >>> import numpy as np
    >>> nm = np.arange(400, 701)
    >>> sensor = sweep.sensor("ar0820", N=(nm, np.where(abs(nm - 630) < 15, 0.2, 1)), relative_to="Y")
    >>> study = sweep.make_study(sensor=sensor, cfas=["RYYCy", "RYNCy"])
    >>> study.evaluate().csd_yellow_red.round().tolist()
    [31.0, 194.0]

    `channels`: curve's name -> series over nm, (nm, values), or a file with one curve; QE, or with `relative_to`
    transmissions times that curve. `clear`: the curve of a pixel without filter. Columns of a file are taken for
    channels by their names, or by their shapes; a table has a column per curve and nm as its index. Raises SweepError
    for curves that cannot be used.
    """
    if source is None or isinstance(source, Path | str):
        return sensor_given(source, channels, relative_to=relative_to, name=name, clear=clear)
    if not _is_table(source):
        allowed = "a built-in sensor, a file, or a table with nm as its index"
        raise DataError(Fault("no sensor", value=type(source).__name__, allowed=allowed))
    columns = {str(channel): column for channel, column in source.items()}
    return sensor_given(None, columns | channels, relative_to=relative_to, name=name, clear=clear)


def sensor_given(
    source: Path | str | None,
    channels: Mapping[str, CurveLike],
    *,
    relative_to: str | None = None,
    name: str | None = None,
    clear: str | None = None,
) -> Given:
    """The same, with the channels as a mapping."""
    keys: dict[str, Any] = {"files": []}
    if source is not None and is_file(Path(source)):
        keys = sensor_file(Path(source)).keys(str(Path(source).absolute()))
    elif source is not None:
        keys["builtin"] = str(source)
    curves = {f"curve {channel}": as_curves(channel, curve) for channel, curve in channels.items()}
    relative = {} if relative_to is None else {"relative_to": relative_to}
    own = [{"file": file, "columns": {c: c}, **relative} for file, c in zip(curves, channels, strict=True)]
    keys["files"] = [*keys["files"], *own]
    if not keys["files"] and name is None and clear is None:
        return Given(keys)
    return Given(keys | {k: v for k, v in {"name": name, "clear": clear}.items() if v is not None}, curves)


def own_lights(
    source: Path | str | pd.DataFrame, *, quantity: LightUnit = "energy", types: Mapping[str, list[str]] | None = None
) -> Given:
    """Lights for `make_study`: a built-in data set, a file, or a table with a column per light and nm as its index.

    >>> import sweep
    >>> import numpy as np, pandas as pd
    >>> nm = np.arange(400, 701)
    >>> leds = pd.DataFrame({k: np.exp(-((nm - c) / 12.0) ** 2) for k, c in [("amber", 592), ("ruby", 636)]}, index=nm)
    >>> lights = sweep.lights(leds, types={"yellow": ["amber"], "red": ["ruby"]})
    >>> sweep.make_study(lights=lights, cfas=["RGGB"]).evaluate().csd_yellow_red.round().tolist()
    [180.0]

    `quantity`: what the numbers are, energy or photons per nm. `types`: signal type -> columns; of a file they go by
    chromaticity where it is left out. Raises SweepError for lights that cannot be used.
    """
    if _is_table(source):
        if types is None:
            raise DataError(Fault("signal types of a table must be said", key="types", allowed="{type: [column, ...]}"))
        signals = {kind: list(columns) for kind, columns in types.items()}
        entry = {"file": "lights given", "quantity": quantity, "signals": signals}
        return Given({"files": [entry]}, {"lights given": curves_of_table(source)})
    if not isinstance(source, Path | str):
        allowed = "built-in lights, a file, or a table with nm as its index"
        raise DataError(Fault("no lights", value=type(source).__name__, allowed=allowed))
    if not is_file(Path(source)):
        return Given({"builtin": str(source)})
    path = Path(source)
    if types is None:
        return Given(lights_file(path, quantity).keys(str(path.absolute())))
    signals = {kind: list(columns) for kind, columns in types.items()}
    return Given({"files": [{"file": str(path.absolute()), "quantity": quantity, "signals": signals}]})


def _is_table(source: object) -> TypeGuard[pd.DataFrame]:
    if source is None or isinstance(source, Path | str):
        return False
    import pandas as pd  # noqa: PLC0415  (slow to import: kept off the start-up path)

    return isinstance(source, pd.DataFrame)


def _plain(value: Any) -> Any:
    """A value as a study file could hold it."""
    if isinstance(value, Given):
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
