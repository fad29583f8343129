"""What is to be judged, from a file of a filter or from a finished run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..base.disk import is_file, is_folder
from ..base.errors import DataError, Fault, nearest
from ..base.types import FloatArray
from ..camera.mosaic import Mosaic
from ..camera.sensor import SensorCurves
from ..curves.facts import qe_scale
from ..curves.files import read_curves
from ..curves.light_unit import LightUnit
from ..curves.lights import Lights
from ..curves.spectrum import Curves
from .channels import NEW, Layout, layout_of, sensor_file
from .opening import Given, made_study, own_lights, sensor_given
from .verdicts import OWN, PLAIN_TILE, Judged, Verdict, judge, opposite, with_base

_PERCENT = 0.01


@dataclass(frozen=True)
class AskedFor:
    """What the command was told; what is None follows from the rest.

    `relative_to`: the curve that the file's values are transmissions of; `transmission`: of the clear pixel. Of a run:
    `data`: the folder of its files, `allow_code`: the code that it was made with may run.
    """

    column: str | None = None
    channel: str | None = None
    cfa: str | None = None
    base: str | None = None
    sensor: str = "ar0820"
    lights: str | None = None
    quantity: LightUnit = "energy"
    relative_to: str | None = None
    transmission: bool = False
    data: Path | str | None = None
    allow_code: bool = False


def verdict_on(source: Path | str, *, design: str | None = None, **wishes: Any) -> Verdict:
    """A filter beside RGGB, the CFA that it changes, and the limit: of a file, or a `design` of a run's folder.

    >>> import sweep
    >>> found = sweep.evaluate("my_filter.csv", relative_to="Y")  # doctest: +SKIP
    >>> found.gap  # doctest: +SKIP
    0.876

    `table`, `limit` and `gap` of the answer are the numbers; printed, it is what the command says. `wishes`: column,
    channel, cfa, base, sensor (`ar0820` or a file), lights (`tl16` or a file), quantity (of these), relative_to (the
    curve that transmissions are of), transmission (of the clear pixel); of a run that was made with code of one's own,
    data (the folder of its files) and allow_code. Raises SweepError for what is unknown, missing or not clean.
    """
    path = Path(source)
    if is_folder(path):
        return judge(filter_of_run(path, design, AskedFor(**wishes)))
    for key, value in (("design", design), ("data", wishes.get("data")), ("allow-code", wishes.get("allow_code"))):
        if value:
            raise DataError(Fault(f"`{key}` goes with a run's folder", str(path), None, f"--{key}", str(value)))
    return judge(filter_of_file(path, AskedFor(**wishes)))


def filter_of_file(path: Path, wishes: AskedFor) -> Judged:
    """A filter in a file. Raises SweepError for files that are not clean, and names that are unknown or missing."""
    sensor = sensor_given(wishes.sensor, {})
    keys: dict[str, Any] = {}
    if is_file(Path(wishes.sensor)):
        start_nm, stop_nm = sensor_file(Path(wishes.sensor)).range_nm
        keys["wavelengths"] = {"start_nm": start_nm, "stop_nm": stop_nm}
    qe = _curves_of(sensor, keys)
    usual = _usual_layout(qe)
    name = wishes.cfa or usual.changed
    mosaic = Mosaic.from_name(name)
    channel = wishes.channel or _own_channel(mosaic, qe)
    if channel not in mosaic.channels:
        known = list(mosaic.channels)
        near = nearest(channel, known)
        raise DataError(Fault(f"no such channel of {name}", None, None, "--channel", channel, ", ".join(known), near))
    base = wishes.base or (usual.base if (name, channel) == (usual.changed, NEW) else opposite(mosaic, channel, qe.qe))
    qe.curve(base)
    times = wishes.relative_to or (qe.clear if wishes.transmission else None)
    read = read_curves(path)
    column = _column(path, read, wishes.column, channel)
    top = float(read.values[column].max())
    scale = qe_scale(top)
    if scale not in (1, _PERCENT):
        raise DataError(Fault("values above 1", str(path), None, column, top, "0 to 1, or percent up to 100"))
    entry: dict[str, Any] = {"file": str(path.absolute()), "columns": {OWN + channel: column}, "scale": scale}
    entry |= {} if times is None else {"relative_to": times}
    read_as = "QE" if times is None else f"a transmission, times {times}"
    percent = "; values in percent" if scale == _PERCENT else ""
    note = f"{path}: {column} read as {read_as}{percent}; it is {channel} of {name}, in place of {base}"
    both = Given({**sensor.keys, "files": [*sensor.keys["files"], entry]}, sensor.curves)
    lights, types = _lights(wishes.lights or "tl16", wishes.quantity)
    named = _other_names(qe, with_base(mosaic, {channel: base}).name, mosaic)
    return Judged(mosaic, {channel: base}, both, lights, types, named, keys, (note,))


def filter_of_run(folder: Path, design: str | None, wishes: AskedFor) -> Judged:
    """A design of a finished run, or its best one, in the scene of its row, with the run's lights or others.

    Raises SweepError for an unknown design, a plain CFA, and a folder without a finished run.
    """
    from ..results.designs import BEST, find_row, row_curves, study_of
    from ..results.output import read_output

    output = read_output(folder)
    data = None if wishes.data is None else Path(wishes.data)
    study = study_of(output, data, allow_code=wishes.allow_code)
    row = find_row(output, design or BEST)
    space, curves = row_curves(study, row)
    if space.filter is None:
        raise DataError(Fault("a plain CFA has no filter to judge", str(folder), None, "--design", design))
    nodes_nm = study.grid.nodes_nm
    own = {OWN + channel: curve for channel, curve in zip(space.filter.channels, curves[0], strict=True)}
    curves_nm = {name: (nodes_nm, curve) for name, curve in {**study.sensor.qe, **own}.items()}
    clear = study.sensor.clear if study.sensor.has_clear else None
    given = sensor_given(None, curves_nm, name=study.sensor.name, clear=clear)
    sensor = Given({**given.keys, "technology": study.sensor.technologies}, given.curves)
    mosaic = study.mosaics[space.cfa]
    named = _other_names(study.sensor, space.cfa, mosaic) | dict(study.section.cfas[space.cfa].curves)
    if wishes.lights is None:
        lights, types = _kept_lights(study.lights, nodes_nm), study.lights.classes
    else:
        lights, types = _lights(wishes.lights, wishes.quantity)
        if "files" in lights.keys:  # as bright as the run's own, as lights that a study validates on
            lights = Given({**lights.keys, "photon_ratio": study.lights.photon_ratio}, lights.curves)
    scene = {str(row["scenario"]): study.section.scenarios[str(row["scenario"])]}
    keys = {"pixel": study.section.pixel, "scenarios": scene, "wavelengths": study.grid}
    note = f"{folder}: {row['name'] or design} of {space.cfa}, in scenario {row['scenario']}"
    bases = dict(space.filter.bases)
    return Judged(mosaic, bases, sensor, lights, types, named, keys, (note,), space.filter.technology)


def _curves_of(sensor: Given, keys: Mapping[str, Any]) -> SensorCurves:
    """The sensor on its own."""
    one = next((name for entry in sensor.keys["files"] for name in entry["columns"]), "G")
    return made_study(sensor=sensor, cfas={"any": {"tile": [[one]]}}, **keys).study.sensor


def _lights(source: str, quantity: LightUnit) -> tuple[Given, tuple[str, ...]]:
    """Lights of a built-in data set or of a file, and their signal types in order."""
    lights = own_lights(source, quantity=quantity)
    if "files" in lights.keys:
        return lights, tuple(lights.keys["files"][0]["signals"])
    return lights, made_study(lights=lights, cfas=[PLAIN_TILE]).study.lights.classes


def _kept_lights(lights: Lights, nodes_nm: FloatArray) -> Given:
    """The lights of a run, as bright as they are in it."""
    import pandas as pd

    labels = [f"{kind} {name}" for kind, name in zip(lights.types, lights.names, strict=True)]
    table = pd.DataFrame(lights.photons.T, columns=labels, index=nodes_nm)
    types = {kind: [labels[at] for at in own] for kind, own in lights.members.items()}
    given = own_lights(table, quantity="photons", types=types)
    return Given({**given.keys, "photon_ratio": lights.photon_ratio}, given.curves)


def _other_names(sensor: SensorCurves, cfa: str, mosaic: Mosaic) -> dict[str, str]:
    """Channels of a CFA whose curve has another name than they."""
    return {c: name for c in mosaic.channels if (name := sensor.curve_name(cfa, c)) != c}


def _usual_layout(sensor: SensorCurves) -> Layout:
    """The CFA with a channel to design that the sensor's curves allow, and what that channel replaces."""
    if {"R", "Y", "Cy"} <= set(sensor.qe):
        return layout_of(dict.fromkeys(("R", "Y", "Cy"), 1.0))
    return layout_of({name: float(curve.sum()) for name, curve in sensor.qe.items()})


def _own_channel(mosaic: Mosaic, sensor: SensorCurves) -> str:
    """The channel that the sensor has no curve for; raises DataError where that is none, or not the only one."""
    lacking = [channel for channel in mosaic.channels if channel not in sensor.qe]
    if len(lacking) != 1:
        allowed = ", ".join(lacking or mosaic.channels)
        raise DataError(Fault(f"which channel of {mosaic.name} is the filter?", None, None, "--channel", None, allowed))
    return lacking[0]


def _column(path: Path, read: Curves, wished: str | None, channel: str) -> str:
    """The column that is meant: the only one, the one named like the channel, or the one that was said."""
    names = list(read.values)
    chosen = wished or (names[0] if len(names) == 1 else channel)
    if chosen not in names:
        known, near = ", ".join(names), nearest(chosen, names)
        what = "which column is the filter?" if wished is None else "no such column"
        raise DataError(Fault(what, str(path), None, "--column", wished, known, near))
    return chosen
