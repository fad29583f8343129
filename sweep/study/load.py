"""Load a study file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from ..base.disk import is_folder
from ..base.errors import Fault, StudyError
from ..curves.spectrum import Curves, WavelengthGrid
from .checked import schema_of
from .document import Document
from .model import Study
from .resolve import resolve
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
    known = schema_of(document)
    if step_nm is not None:
        grid = known.section.wavelengths
        finer = WavelengthGrid(start_nm=grid.start_nm, stop_nm=grid.stop_nm, step_nm=step_nm)
        known = replace(known, section=known.section.model_copy(update={"wavelengths": finer}))
    if data is not None and not is_folder(data):
        raise StudyError(Fault("no such folder", None, None, "--data", str(data)))
    return resolve(document, known, [*([data] if data is not None else []), path.parent], kept, allow_code=allow_code)


def study_of_keys(
    keys: Mapping[str, Any], folder: Path, given: Mapping[str, Curves] = {}, *, allow_code: bool = False
) -> Study:
    """Check a study that stands in no file: its keys with plain values.

    Files that it names are looked for in `folder`; `given`: curves to take for files that are not on a disk, by the
    names that the study gives these. Raises StudyError as `load_study` does, without file and line.
    """
    document = Document(keys)
    return resolve(document, schema_of(document), [folder], None, given, allow_code=allow_code)


def folder_name(study_name: str) -> str:
    """A folder name for a study's outputs: other characters than letters, digits, `-`, `_`, `.` become `_`."""
    kept = "".join(c if c in _ALLOWED else "_" for c in study_name)
    return kept if kept.strip(".") else "_"
