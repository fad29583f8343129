"""New study files, for the built-in curves or for a user's curves; and their schema."""

from __future__ import annotations

import json
import os
import shlex
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from ..base.answer import Answer
from ..base.disk import read_input
from ..base.errors import DataError, OutputError, StudyError, SweepError, ValidationIssue
from ..results.atomic import atomic, write_text
from ..spectra.light_files import lights_file
from ..spectra.read_text import MOST_BYTES
from ..spectra.units import FITTING, light_unit, stated_quantity
from ..study import Study, folder_name, load_study
from ..study.editors import SCHEMA_FILE, TITLE, schema_text
from ..study.schema import StudySection
from .channels import sensor_file
from .study_text import Sources, one_line, study_text

_MOST_LETTERS = 100


def new_study(
    name: str,
    *,
    qe: Sequence[Path | str] = (),
    lights: Sequence[Path | str] = (),
    quantity: Sequence[str] = (),
    folder: Path | str = "studies",
    force: bool = False,
) -> Answer:
    """Write a commented study that runs as it is, and the schema that editors complete it with.

    Parameters
    ----------
    name : str
        Name of the study and of its file.
    qe, lights : sequence of path-like
        Files or folders of QE curves of a sensor, and of spectra of lights; left out, the built-in ones.
    quantity : sequence of str
        Units of their numbers, where heads do not tell them.
    folder : path-like
        Folder of the studies.
    force : bool
        Replace a file of that name.

    Returns
    -------
    Answer
        What was written, and from where.

    Raises
    ------
    SweepError
        For a bad name, where the file exists or cannot be written, and for curves that a study cannot use.
    """
    folder, quantities = Path(folder), [stated_quantity(word) for word in quantity]
    of_sensor, of_lights = [Path(file) for file in qe], [Path(file) for file in lights]
    path = _new_path(name, folder, force=force)
    sources = Sources()
    sources = replace(sources, path_in_study=lambda file: _path_in_study(file, folder))
    if of_sensor:
        stated = next((quantity for quantity in FITTING["sensor"] if quantity in quantities), None)
        sources = replace(sources, sensor=sensor_file(of_sensor, stated))
    if of_lights:
        start_nm, stop_nm = (400, 700) if sources.sensor is None else sources.sensor.range_nm
        sources = replace(sources, lights=lights_file(of_lights, light_unit(quantities), start_nm, stop_nm))
    new_folders = [place for place in (folder, *folder.parents) if not os.path.lexists(place)]
    try:
        study = _write(path, name, sources)
    except SweepError:
        with suppress(OSError):  # a folder that something else is in by now stays
            for place in new_folders:
                place.rmdir()
        raise
    lines = [
        f"{path}: {study.n_designs:,} designs on {', '.join(study.mosaics)}; objective {study.objective}.",
        *_source_lines(sources),
        *(f"Note: {warning}." for warning in study.warnings),
        f"Next: sweep run {shlex.quote(str(path))}",
    ]
    return Answer(lines, {"file": str(path), "designs": study.n_designs, "warnings": study.warnings})


def _write(path: Path, name: str, sources: Sources) -> Study:
    """Write a study that loads, and the schema before it, so that no study is without the one that it names."""
    with atomic(path) as hidden:
        hidden.write_text(study_text(name, sources, None), encoding="utf-8")
        try:
            # The photon ratio of its lights is written down, since another light in the file would change it.
            ratio = load_study(hidden).lights.photon_ratio
            hidden.write_text(study_text(name, sources, ratio), encoding="utf-8")
            study = load_study(hidden)
        except StudyError as error:
            raise DataError([replace(issue, file=None, line=None) for issue in error.issues]) from None
        _write_schema_beside(path)
    return study


def _new_path(name: str, folder: Path, *, force: bool) -> Path:
    """Path of a new study; raises StudyError for a name that no file can have, OutputError where the file exists."""
    stem = name.removesuffix(".yaml").removesuffix(".yml")
    if not (name and name == folder_name(name) == stem and name[0].isalnum() and len(name) <= _MOST_LETTERS):
        better = folder_name(Path(stem).name).strip("._-")[:_MOST_LETTERS]
        allowed = f"up to {_MOST_LETTERS} letters, digits, -, _ and ., with a letter or digit first, without .yaml"
        raise StudyError(ValidationIssue("not the name of a study", None, None, "NAME", name, allowed, better or None))
    path = folder / f"{name}.yaml"
    if os.path.lexists(path) and not force:
        allowed = "another name, or --force"
        raise OutputError(ValidationIssue("is there already, and stays as it is", str(path), allowed=allowed))
    return path


def _path_in_study(file: Path, folder: Path) -> str:
    """Path of a file as the study says it: relative to the study, so that both can be moved together."""
    try:
        return Path(os.path.relpath(file.resolve(), folder.resolve())).as_posix()
    except ValueError:  # on another disk of Windows
        return file.resolve().as_posix()


def _source_lines(sources: Sources) -> list[str]:
    """Columns and figures that were taken from the files, for the user to look at."""
    lines: list[str] = []
    left_out: dict[str, str] = {}
    if sources.sensor is not None:
        channels = sources.sensor.channels
        taken = ", ".join(f"{channel} from {one_line(column)}" for channel, column in channels.columns.items())
        lines.append(f"Channels: {taken}.")
        lines += [f"Read: {note}." for note in sources.sensor.notes]
        left_out |= channels.left_out
    if sources.lights is not None:
        types = [f"{kind}: {', '.join(map(one_line, names))}" for kind, names in sources.lights.types.items()]
        lines.append(f"Lights: {'; '.join(types)}.")
        lines += [f"Read: {note}." for note in sources.lights.notes]
        left_out |= sources.lights.left_out
    if left_out:
        lines.append(f"Left out, see the file: {', '.join(map(one_line, left_out))}.")
    return lines


def write_schema(path: Path) -> None:
    """Write the JSON Schema of study files.

    Raises OutputError if the file cannot be written, or holds anything except such a schema.
    """
    if os.path.lexists(path):
        # The title is the second key of a schema; in earlier versions it was the section's name.
        titles = [f'"title": {json.dumps(title)}'.encode() for title in (TITLE, StudySection.__name__)]
        content = read_input(path, MOST_BYTES, OutputError)
        if not any(title in content[:4096] for title in titles):
            raise OutputError(ValidationIssue("holds something else already", str(path), allowed="another --output"))
    write_text(schema_text(), path)


def _write_schema_beside(path: Path) -> None:
    if not os.path.lexists(path.with_name(SCHEMA_FILE)):
        write_text(schema_text(), path.with_name(SCHEMA_FILE))
