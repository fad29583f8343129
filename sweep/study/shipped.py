"""The studies of the project, which an installed package has, too; and a study by its name alone."""

from __future__ import annotations

import sysconfig
from collections.abc import Iterator
from contextlib import suppress
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

from ..disk import is_file, is_folder

_STUDIES, _SHARED = "studies", "share/cfa-sweep/studies"
_KINDS = (".yaml", ".yml")
_ONE_OF_THEM = "stopband.yaml"


def shipped_folder() -> Path | None:
    """The folder of the project's studies: beside the package in a checkout, else where the installer put it."""
    for folder in _places():
        if is_file(folder / _ONE_OF_THEM):
            return folder
    return None


def _places() -> Iterator[Path]:
    yield Path(__file__).resolve().parents[2] / _STUDIES
    with suppress(PackageNotFoundError):
        for file in distribution("cfa-sweep").files or ():
            if file.as_posix().endswith(f"{_SHARED}/{_ONE_OF_THEM}"):
                yield Path(str(file.locate())).resolve().parent
    yield Path(sysconfig.get_path("data")) / _SHARED


def shipped_names() -> list[str]:
    """Names of the project's studies, in order; none where they were not installed."""
    folder = shipped_folder()
    return [] if folder is None else sorted(path.stem for path in folder.iterdir() if path.suffix == ".yaml")


def study_path(given: Path) -> Path:
    """The file that is meant: the path itself, or, for a name alone, that study of `studies/` or of the project.

    A name that is nowhere stays as it is: reading it says so.
    """
    name = given.name
    if is_file(given) or is_folder(given) or name != str(given) or given.suffix in _KINDS:
        return given
    folders = [Path(_STUDIES), *([] if shipped_folder() is None else [shipped_folder()])]
    found = (folder / f"{name}{kind}" for folder in folders if folder is not None for kind in _KINDS)
    return next((path for path in found if is_file(path)), given)
