"""Make a new study file from what its user has."""

from __future__ import annotations

import math
import os
import shlex
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import replace
from itertools import chain
from pathlib import Path

import numpy as np

from ...curves.facts import Curve, Facts, condensed, facts_of, qe_scale
from ...curves.files import scan_curves
from ...curves.light_unit import LightUnit
from ...curves.spectrum import WavelengthGrid
from ...errors import DataError, Fault, OutputError, StudyError, SweepError
from ...results.tables import atomic, write_text
from ...study import Study, folder_name, load_study
from ...study.editors import SCHEMA_FILE, schema_text
from .channels import Layout, channels_of, layout_of
from .template import TYPICAL_NM, LightsText, SensorText, one_line, study_text

_USUAL = WavelengthGrid()
_NEEDED_NM = (450.0, 680.0)
"""What the sensor's curves must cover, so that every signal color is seen."""
_MOST_LETTERS = 100
_BUILT_IN_CFAS = ("RGGB", "RCCC", "RCCB", "RYYCy")


def new_study(name: str, folder: Path, qe: Path | None, lights: Path | None, quantity: LightUnit) -> list[str]:
    """Write `folder`/<name>.yaml, and the schema that editors complete it with where the folder has none.

    `qe`, `lights`: files of curves, which stay where they are; None takes what is built in. Returns lines to print.
    Raises StudyError for a bad name, OutputError where the file exists or cannot be written, DataError for curves that
    a study cannot use.
    """
    path = folder / f"{_checked(name)}.yaml"
    if os.path.lexists(path):
        raise OutputError(Fault("is there already, and stays as it is", str(path), allowed="another name"))
    sensor = SensorText(Layout(_BUILT_IN_CFAS, "RYNCy", "Y", "G")) if qe is None else _sensor(qe, folder)
    start_nm, stop_nm = sensor.range_nm
    chosen = _built_in_lights() if lights is None else _lights(lights, folder, quantity, start_nm, stop_nm)
    new_folders = [place for place in (folder, *folder.parents) if not os.path.lexists(place)]
    try:
        made = _write(path, lambda ratio: study_text(name, sensor, replace(chosen, photon_ratio=ratio)))
    except SweepError:
        with suppress(OSError):  # one that something else is in by now stays
            for place in new_folders:
                place.rmdir()
        raise
    lines = [f"{path}: {made.n_designs:,} designs on {', '.join(made.mosaics)}; objective {made.objective}."]
    lines += _said(sensor, chosen)
    lines += [f"Note: {warning}." for warning in made.warnings]
    return [*lines, f"Next: sweep run {shlex.quote(str(path))}"]


def _write(path: Path, text: Callable[[float | None], str]) -> Study:
    """Write a study that loads, and the schema before it, so that no study is without the one that it names.

    `text`: from the photon ratio of its lights, which another light in the file would change.
    """
    with atomic(path) as hidden:
        hidden.write_text(text(None), encoding="utf-8")
        try:
            made = load_study(hidden)
            hidden.write_text(text(made.lights.photon_ratio), encoding="utf-8")
            made = load_study(hidden)
        except StudyError as error:
            raise DataError([replace(fault, file=None, line=None) for fault in error.faults]) from None
        if not os.path.lexists(path.with_name(SCHEMA_FILE)):
            write_text(schema_text(), path.with_name(SCHEMA_FILE))
    return made


def _checked(name: str) -> str:
    """The name of a study that can be a file's, too."""
    stem = name.removesuffix(".yaml").removesuffix(".yml")
    if name and name == folder_name(name) == stem and name[0].isalnum() and len(name) <= _MOST_LETTERS:
        return name
    better = folder_name(Path(stem).name).strip("._-")[:_MOST_LETTERS]
    allowed = f"up to {_MOST_LETTERS} letters, digits, -, _ and ., with a letter or digit first, without .yaml"
    raise StudyError(Fault("not the name of a study", None, None, "NAME", name, allowed, better or None))


def _curves(path: Path) -> dict[str, Curve]:
    """Clean curves by the names that the file has; raises DataError with all of its faults."""
    scan = scan_curves(path)
    if scan.faults:
        raise DataError(condensed(list(chain.from_iterable(scan.faults))))
    return dict(zip(scan.names, facts_of(scan).curves, strict=True))


def _relative(file: Path, folder: Path) -> str:
    """A file's path as seen from the folder of the study."""
    try:
        return Path(os.path.relpath(file.resolve(), folder.resolve())).as_posix()
    except ValueError:  # on another drive
        return file.resolve().as_posix()


def _sensor(path: Path, folder: Path) -> SensorText:
    curves = _curves(path)
    channels = channels_of(curves)
    if not channels.columns:
        raise DataError(Fault("no curve that could be QE", str(path), allowed="values above 0 between 400 and 700 nm"))
    wave = next(iter(curves.values())).wavelength_nm
    if wave[0] > _NEEDED_NM[0] or wave[-1] < _NEEDED_NM[1]:
        allowed = f"{_NEEDED_NM[0]:g} to {_NEEDED_NM[1]:g} nm or more"
        raise DataError(
            Fault("QE of too few wavelengths", str(path), None, None, f"{wave[0]:g} to {wave[-1]:g} nm", allowed)
        )
    totals = {channel: float(curves[column].values.sum()) for channel, column in channels.columns.items()}
    return SensorText(
        layout=layout_of(totals),
        file=_relative(path, folder),
        name=path.stem[:_MOST_LETTERS],
        channels=channels,
        scale=qe_scale(max(curves[column].peak for column in channels.columns.values())),
        range_nm=(max(400, math.ceil(wave[0])), min(700, math.floor(wave[-1]))),
    )


def _built_in_lights() -> LightsText:
    return LightsText({kind: {} for kind in TYPICAL_NM})


def _lights(path: Path, folder: Path, quantity: LightUnit, start_nm: float, stop_nm: float) -> LightsText:
    curves = _curves(path)
    colors = dict(zip(curves, Facts(tuple(curves.values()), "").colors(quantity).values(), strict=True))
    signals = {name: None if color is None else color.signal for name, color in colors.items()}
    types = {kind: {name: colors[name] for name in curves if signals[name] == kind} for kind in TYPICAL_NM}
    used = {kind: columns for kind, columns in types.items() if columns}
    left_out = {}
    for name, color in colors.items():
        if color is None:
            left_out[name] = "no visible light"
        elif signals[name] is None:
            left_out[name] = f"xy {color.xy[0]:.3f} {color.xy[1]:.3f} is near no signal color"
    if len(used) < 2:
        found = "; ".join(f"{kind}: {', '.join(columns)}" for kind, columns in used.items()) or "none"
        problem = f"lights of one signal color or none (`sweep describe {path}` shows where they lie)"
        raise DataError(Fault(problem, str(path), None, None, found, "two of green, yellow, orange, red, or more"))
    wave = next(iter(curves.values())).wavelength_nm
    return LightsText(
        types=used,
        file=_relative(path, folder),
        name=path.stem[:_MOST_LETTERS],
        quantity=quantity,
        left_out=left_out,
        ends_early=bool(wave[0] > start_nm or wave[-1] < stop_nm),
        fine=bool(np.diff(wave).min() < _USUAL.step_nm),
    )


def _said(sensor: SensorText, lights: LightsText) -> list[str]:
    """How the files' columns were taken; what the user should look at."""
    lines = []
    if sensor.file is not None:
        taken = ", ".join(f"{channel} from {one_line(c)}" for channel, c in sensor.channels.columns.items())
        lines.append(f"Channels{' (guessed by shape, check them)' if sensor.channels.guessed else ''}: {taken}.")
    if lights.file is not None:
        taken = "; ".join(f"{kind}: {', '.join(map(one_line, names))}" for kind, names in lights.types.items())
        lines.append(f"Lights: {taken}.")
    out: Mapping[str, str] = {**sensor.channels.left_out, **lights.left_out}
    if out:
        lines.append(f"Left out, see the file: {', '.join(map(one_line, out))}.")
    return lines
