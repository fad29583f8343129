"""The study of a finished run, made again from what the run kept of it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TypeVar

import numpy as np

from ..base.errors import Fault, OutputError
from ..base.own_code import CODE_OF, is_code
from ..base.types import FloatArray
from ..study import Study, load_study
from ..study.sources import KeptSources
from .output import Output
from .tables import RESOLVED

_SAME = 1e-12
"""Curves that were computed twice, on other machines, differ by no more."""
_MOST_SHOWN = 10
_Key = TypeVar("_Key")


def study_of(output: Output, data: Path | None, *, allow_code: bool = False) -> Study:
    """The study of a finished run again: with its files, looked for in `data`, or with the curves that the run kept.

    `allow_code`: code that it was made with may run, and no other. Raises OutputError where that is not allowed, and
    when the curves are not those of the run; StudyError for other code.
    """
    path, digests = output.folder / RESOLVED, output.provenance.data_sha256
    code = {name: digest for name, digest in digests.items() if is_code(name)}
    in_files = [name for name in code if not name.startswith(CODE_OF)]
    if code and (not allow_code or (in_files and data is None)):
        where = "--data FOLDER, which holds it, and " if in_files else ""
        whose = ", ".join(in_files or [name.removeprefix(CODE_OF) for name in code])
        problem = f"it was made with the code of {whose}"
        raise OutputError(Fault(problem, str(output.folder), allowed=f"{where}--allow-code, if you trust it"))
    if data is None and digests.keys() - code:
        own = output.curves
        return load_study(path, kept=KeptSources(own.sensor, own.lights, own.tasks), allow_code=code)
    study = load_study(path, data, allow_code=code)
    lights = zip(study.lights.types, study.lights.names, study.lights.photons, strict=True)
    check_kept(output, output.curves.sensor, study.sensor.qe)
    check_kept(output, output.curves.lights, {(kind, name): values for kind, name, values in lights})
    check_kept(output, output.curves.tasks, {} if study.tasks is None else study.tasks.from_files)
    return study


def check_kept(output: Output, kept: Mapping[_Key, FloatArray], made: Mapping[_Key, FloatArray]) -> None:
    """Compare curves with those that the run kept under these names; raises OutputError where they differ."""
    other = [str(name) for name, values in made.items() if name in kept and not _same(kept[name], values)]
    if other:
        shown = ", ".join(other[:_MOST_SHOWN]) + (" and more" if len(other) > _MOST_SHOWN else "")
        problem = f"computed again, these are not what the run has: {shown}"
        raise OutputError(Fault(problem, str(output.folder), allowed="the curve files and the version of that run"))


def _same(one: FloatArray, other: FloatArray) -> bool:
    return one.shape == other.shape and bool(np.abs(one - other).max(initial=0.0) <= _SAME)
