"""Load a study file."""

from __future__ import annotations

import re
from collections.abc import Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from ..base.disk import is_file, is_folder
from ..base.errors import StudyError, ValidationIssue
from ..features import modules
from ..spectra.spectrum import Curves
from .document import RESOLVED, Document
from .inputs import INPUTS, unpacked
from .members import SensorAndLights, SensorStudies, of_one_fit
from .model import Study
from .partial import Partial
from .resolve import resolve
from .schema import StudySection
from .sources import Sources


def load_study(
    path: Path,
    data: Path | None = None,
    changes: Mapping[str, Any] = {},
    *,
    allow_code: bool | Mapping[str, str] = False,
    member: SensorAndLights | None = None,
) -> Study:
    """Read and check a study file.

    `changes`: dotted key -> value to take instead, as a study file would have it. Files are looked for in `data` first,
    then beside the study; those of a run's study in its archive. With `allow_code` code that the study names may run,
    or only code with these digests. Raises StudyError with one issue per problem: file:line, key, value, allowed
    values, nearest name.
    """
    document = _changed(path, changes)
    several: Any = next(iter(modules("members")), None)
    members = _members_of(document)
    if member is None and len(members) > 1:
        names = ", ".join(known_member.name for known_member in members)
        problem = f"a study of several sensors, pixels or lights ({names}): `sweep run` runs all"
        key = next(key for key in ("sensors", "pixels", "lights") if key in document.data)
        raise StudyError(document.issue((key,), problem, None, f"one of each here: {several.way_to_one(document)}"))
    chosen, notes = member or next(iter(members), None), list[str]()
    if chosen is not None:
        several.choose(document, chosen)
    section, partial = _checked(document)
    if chosen is not None:
        section, notes = several.narrowed(section, chosen)
        if len(members) > 1:
            section = section.model_copy(update={"study": chosen.name})
    if data is not None and not is_folder(data):
        raise StudyError(ValidationIssue("no such folder", None, None, "--data", str(data)))
    folders = [path.parent] if data is None else [data, path.parent]
    sources = Sources(document, section.wavelengths, folders, allow_code=allow_code, partial=partial)
    sources.warnings += notes
    archive = path.with_name(INPUTS)
    with ExitStack() as stack:
        if data is None and path.name.endswith(RESOLVED) and is_file(archive):
            sources.kept, sources.given = stack.enter_context(unpacked(archive))
        try:
            return resolve(section, sources)
        except StudyError as error:
            raise (error if chosen is None or len(members) == 1 else several.of_member(error, chosen)) from None


def sensor_studies_in(path: Path, changes: Mapping[str, Any] = {}) -> SensorStudies | None:
    """Return the sensors and light sets of a study file; None if it is a plain study.

    `changes`: dotted key -> value to take instead, as a study file would have it. Raises StudyError if the file is no
    YAML, or its lists have no names.
    """
    document = _changed(path, changes)
    members = _members_of(document)
    name = str(document.data.get("study") or path.stem)
    return SensorStudies(name, tuple(members)) if len(members) > 1 else None


def _members_of(document: Document) -> list[SensorAndLights]:
    """Return the sensors and lights of a study, each pair once, where the package has the feature."""
    return [member for module in modules("members") for member in module.members_of(document)]


def _changed(path: Path, changes: Mapping[str, Any]) -> Document:
    document = Document(path)
    for key, text in changes.items():
        document.change(key, text)
    return document


def study_of_keys(
    keys: Mapping[str, Any], folder: Path, given: Mapping[str, Curves] = {}, *, allow_code: bool = False
) -> Study:
    """Construct a study from keys instead of a file.

    `folder`: folder of relative file names. Raises StudyError as `load_study`, without file and line.
    """
    document = Document(keys)
    section, partial = _checked(document)
    grid = section.wavelengths
    return resolve(section, Sources(document, grid, [folder], given, allow_code=allow_code, partial=partial))


def _checked(document: Document) -> tuple[StudySection, Partial | None]:
    """Return the study as its schema has it; what is left of a faulty one, whose other faults are then looked for.

    Raises StudyError with the issues of the schema where too little is left.
    """
    try:
        return of_one_fit(StudySection.model_validate(document.data)), None
    except ValidationError as error:
        partial = Partial(document, error)
    if partial.section is None:
        raise StudyError(partial.issues)
    return of_one_fit(partial.section), partial


def folder_name(study_name: str) -> str:
    """Return a valid folder name for the results of a study.

    Everything except letters, digits, `-`, `_` and `.` becomes `_`.
    """
    name = re.sub(r"[^a-zA-Z0-9_.-]", "_", study_name)
    return name if name.strip(".") else "_"
