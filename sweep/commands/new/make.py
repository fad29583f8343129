"""Make a new study file from what its user has."""

from __future__ import annotations

import os
import shlex
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from ...api.channels import Layout, layout_of, sensor_file
from ...base.errors import DataError, Fault, OutputError, StudyError, SweepError
from ...curves.light_files import lights_file
from ...curves.light_unit import LightUnit
from ...results.atomic import atomic, write_text
from ...study import Study, folder_name, load_study
from ...study.editors import SCHEMA_FILE, schema_text
from ..emva1288 import pixel_figures
from .template import TYPICAL_NM, LightsText, PixelText, SensorText, one_line, study_text

_MOST_LETTERS = 100
_BUILT_IN_CFAS = ("RGGB", "RCCC", "RCCB", "RYYCy")


def new_study(
    name: str, folder: Path, qe: Path | None, lights: Path | None, quantity: LightUnit, pixel: Path | None = None
) -> list[str]:
    """Write `folder`/<name>.yaml, and the schema that editors complete it with where the folder has none.

    `qe`, `lights`: files of curves, which stay where they are; None takes what is built in. `pixel`: EMVA 1288 results,
    whose figures go into the study. Returns lines to print.
    Raises StudyError for a bad name, OutputError where the file exists or cannot be written, DataError for curves that
    a study cannot use.
    """
    path = folder / f"{checked_name(name)}.yaml"
    if os.path.lexists(path):
        raise OutputError(Fault("is there already, and stays as it is", str(path), allowed="another name"))
    sensor = SensorText(Layout(_BUILT_IN_CFAS, "RYNCy", "Y", "G")) if qe is None else _sensor(qe, folder)
    start_nm, stop_nm = sensor.range_nm
    chosen = _built_in_lights() if lights is None else _lights(lights, folder, quantity, start_nm, stop_nm)
    own_pixel = PixelText() if pixel is None else _pixel(pixel)
    new_folders = [place for place in (folder, *folder.parents) if not os.path.lexists(place)]
    try:
        made = _write(path, lambda ratio: study_text(name, sensor, replace(chosen, photon_ratio=ratio), own_pixel))
    except SweepError:
        with suppress(OSError):  # one that something else is in by now stays
            for place in new_folders:
                place.rmdir()
        raise
    lines = [f"{path}: {made.n_designs:,} designs on {', '.join(made.mosaics)}; objective {made.objective}."]
    lines += _said(sensor, chosen)
    if own_pixel.given:
        lines.append(f"Pixel: {', '.join(own_pixel.given)} from {pixel}; not in it: {', '.join(own_pixel.missing)}.")
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


def checked_name(name: str) -> str:
    """The name of a study that can be a file's, too."""
    stem = name.removesuffix(".yaml").removesuffix(".yml")
    if name and name == folder_name(name) == stem and name[0].isalnum() and len(name) <= _MOST_LETTERS:
        return name
    better = folder_name(Path(stem).name).strip("._-")[:_MOST_LETTERS]
    allowed = f"up to {_MOST_LETTERS} letters, digits, -, _ and ., with a letter or digit first, without .yaml"
    raise StudyError(Fault("not the name of a study", None, None, "NAME", name, allowed, better or None))


def _path_of(file: Path, folder: Path) -> str:
    """A file's path as the study in a folder says it: its name where it lies beside or below it, else from the root.

    So the study can be moved: alone, or with the files beside it.
    """
    file, folder = file.resolve(), folder.resolve()
    return (file.relative_to(folder) if file.is_relative_to(folder) else file).as_posix()


def _sensor(path: Path, folder: Path) -> SensorText:
    taken = sensor_file(path)
    return SensorText(
        layout=layout_of(taken.totals),
        file=_path_of(path, folder),
        name=taken.name,
        channels=taken.channels,
        scale=taken.scale,
        range_nm=taken.range_nm,
    )


def _built_in_lights() -> LightsText:
    return LightsText({kind: {} for kind in TYPICAL_NM})


def _lights(path: Path, folder: Path, quantity: LightUnit, start_nm: float, stop_nm: float) -> LightsText:
    taken = lights_file(path, quantity, start_nm, stop_nm)
    return LightsText(
        types=taken.types,
        file=_path_of(path, folder),
        name=taken.name,
        quantity=quantity,
        left_out=taken.left_out,
        ends_early=taken.ends_early,
        fine=taken.fine,
    )


def _pixel(path: Path) -> PixelText:
    figures = pixel_figures(path)
    return PixelText(path.name, figures.given, figures.missing)


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
