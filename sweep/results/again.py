"""The study of a finished run, made again from what the run kept of it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TypeVar

import numpy as np

from ..designs.plugin import read_plugin
from ..disk import is_file
from ..errors import Fault, OutputError
from ..study import Study, load_study
from ..study.sources import KeptSources
from ..types import FloatArray
from .output import Output
from .tables import RESOLVED

_SAME = 1e-12
"""Curves that were computed twice, on other machines, differ by no more."""
_MOST_SHOWN = 10
_CODE = ".py"
_Key = TypeVar("_Key")


def study_of(output: Output, data: Path | None, *, allow_code: bool = False) -> Study:
    """The study of a finished run again: with its files, looked for in `data`, or with the curves that the run kept.

    `allow_code`: the code of its own families may run; code that is not that of the run does not. Raises OutputError
    when the curves or the code are not those of the run, and where code is needed but not allowed.
    """
    path, digests = output.folder / RESOLVED, output.provenance.data_sha256
    for name in (name for name in digests if name.endswith(_CODE)):
        if data is None or not allow_code:
            allowed = "--data FOLDER, which holds it, and --allow-code, if you trust it"
            raise OutputError(Fault(f"its filters are made by the code of {name}", str(output.folder), allowed=allowed))
        if not is_file(data / name) or read_plugin(data / name)[1] != digests[name]:
            raise OutputError(Fault("not the code that the run had", str(data / name)))
    if data is None and digests:
        return load_study(path, kept=KeptSources(output.curves.sensor, output.curves.lights))
    study = load_study(path, data, allow_code=allow_code)
    lights = zip(study.lights.types, study.lights.names, study.lights.photons, strict=True)
    check_kept(output, output.curves.sensor, study.sensor.qe)
    check_kept(output, output.curves.lights, {(kind, name): values for kind, name, values in lights})
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
