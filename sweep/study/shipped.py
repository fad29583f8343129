"""The studies of the project, which an installed package has, too; and a study by its name alone."""

from __future__ import annotations

import sysconfig
from contextlib import suppress
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

from ..base.disk import is_file, is_folder
from ..base.errors import StudyError, ValidationIssue, nearest

_STUDIES, _SHARED = "studies", "share/cfa-sweep/studies"
_INSTALLED = f"{_SHARED}/stopband.yaml"
_KINDS = (".yaml", ".yml")
_ONE_OF_THEM = "stopband.yaml"


def shipped_folder() -> Path | None:
    """Return the folder of the project's studies: beside the package in a checkout, else where it was installed."""
    folders = [Path(__file__).resolve().parents[2] / _STUDIES, Path(sysconfig.get_path("data")) / _SHARED]
    with suppress(PackageNotFoundError):  # `pip install --user` or `--target` put it elsewhere
        files = distribution("cfa-sweep").files or ()
        folders += [Path(str(f.locate())).resolve().parent for f in files if f.as_posix().endswith(_INSTALLED)]
    return next((folder for folder in folders if is_file(folder / _ONE_OF_THEM)), None)


def shipped_names() -> list[str]:
    """Return the names of the project's studies, in order; none where they were not installed."""
    folder = shipped_folder()
    return [] if folder is None else sorted(path.stem for path in folder.iterdir() if path.suffix == ".yaml")


def study_path(given: Path) -> Path:
    """Find a study file by its path, or by its name in `studies/` and the package.

    Raises StudyError if there is none; names the nearest.
    """
    name = given.name
    if is_file(given) or is_folder(given) or name != str(given) or given.suffix in _KINDS:
        return given
    shipped = shipped_folder()
    folders = [Path(_STUDIES), *([] if shipped is None else [shipped])]
    for path in (folder / f"{name}{kind}" for folder in folders for kind in _KINDS):
        if is_file(path):
            return path
    local = sorted(path.stem for path in folders[0].glob("*") if path.suffix in _KINDS)
    known = list(dict.fromkeys([*local, *shipped_names()]))
    problem = "no such file, and no study of that name"
    raise StudyError(ValidationIssue(problem, value=name, allowed=", ".join(known), nearest=nearest(name, known)))
