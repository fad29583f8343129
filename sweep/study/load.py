"""Load a study file."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from ..base.disk import is_folder
from ..base.errors import Fault, StudyError
from ..curves.spectrum import Curves, WavelengthGrid
from .document import Document
from .model import Study
from .resolve import resolve
from .schema import StudySection
from .sources import KeptSources

_ALLOWED = set("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_.")


def load_study(
    path: Path,
    data: Path | None = None,
    step_nm: float | None = None,
    kept: KeptSources | None = None,
    changes: Mapping[str, str] = {},
    *,
    allow_code: bool | Mapping[str, str] = False,
) -> Study:
    """Read and check a study file.

    Files that it names are looked for in `data`, when given, and then beside the study. `step_nm` replaces the step of
    its wavelength grid. `kept`: curves on that grid to take instead of those in files, `qe:<curve>` and
    `light:<type>:<name>`, each ndarray[n_wavelengths]. `changes`: dotted key -> value to take instead, as a study file
    would have it. `allow_code`: code that the study names may run, or of it what has these digests. Raises StudyError
    with one fault per thing wrong: file:line, key, value, what is allowed, nearest name.
    """
    document = Document(path)
    for key, text in changes.items():
        document.change(key, text)
    section = _section(document)
    if step_nm is not None:
        grid = section.wavelengths
        section = section.model_copy(
            update={"wavelengths": WavelengthGrid(start_nm=grid.start_nm, stop_nm=grid.stop_nm, step_nm=step_nm)}
        )
    if data is not None and not is_folder(data):
        raise StudyError(Fault("no such folder", None, None, "--data", str(data)))
    return resolve(document, section, [*([data] if data is not None else []), path.parent], kept, allow_code=allow_code)


def study_of_keys(
    keys: Mapping[str, Any], folder: Path, given: Mapping[str, Curves] = {}, *, allow_code: bool = False
) -> Study:
    """Check a study that stands in no file: its keys with plain values.

    Files that it names are looked for in `folder`; `given`: curves to take for files that are not on a disk, by the
    names that the study gives these. Raises StudyError as `load_study` does, without file and line.
    """
    document = Document(keys)
    return resolve(document, _section(document), [folder], None, given, allow_code=allow_code)


def _section(document: Document) -> StudySection:
    """The schema of a document; raises StudyError with every fault."""
    try:
        return StudySection.model_validate(document.data)
    except ValidationError as error:
        raise StudyError(document.faults(error, StudySection)) from None


def folder_name(study_name: str) -> str:
    """A folder name for a study's outputs: other characters than letters, digits, `-`, `_`, `.` become `_`."""
    kept = "".join(c if c in _ALLOWED else "_" for c in study_name)
    return kept if kept.strip(".") else "_"
