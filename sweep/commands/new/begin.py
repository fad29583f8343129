"""Begin a study from one that is there, and with curves that lie beside it."""

from __future__ import annotations

import os
import re
import shlex
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from ...base.disk import read_input
from ...base.errors import DataError, Fault, OutputError, StudyError, SweepError
from ...base.own_code import is_code
from ...curves.scan import MOST_BYTES
from ...results.atomic import atomic, write_bytes, write_text
from ...study import load_study
from ...study.editors import SCHEMA_FILE, schema_text
from .make import checked_name

_MOST_STUDY = 500_000
_NAME = re.compile(r"^study:.*$", re.MULTILINE)


def study_from(name: str, folder: Path, source: Path) -> list[str]:
    """Write `folder`/<name>.yaml as a copy of a study under another name, comments and all; lines to print.

    Raises StudyError for a bad name and where the copy would not load, OutputError where the file exists.
    """
    path = folder / f"{checked_name(name)}.yaml"
    if os.path.lexists(path):
        raise OutputError(Fault("is there already, and stays as it is", str(path), allowed="another name"))
    text, found = _NAME.subn(f"study: {name}", read_input(source, _MOST_STUDY, StudyError).decode("utf-8"), count=1)
    if not found:
        raise StudyError(Fault("no line `study: NAME`", str(source)))
    with atomic(path) as hidden:
        hidden.write_text(text, encoding="utf-8")
        made = load_study(hidden)
        if not os.path.lexists(path.with_name(SCHEMA_FILE)):
            write_text(schema_text(), path.with_name(SCHEMA_FILE))
    said = f"{path}: {made.n_designs:,} designs on {', '.join(made.mosaics)}, as {source}."
    return [said, f"Next: sweep run {shlex.quote(str(path))}"]


def curve_files_of(source: Path) -> list[str]:
    """Files of curves that a study names by paths below it; those by whole paths are found from everywhere.

    Raises StudyError where the study does not load, or names a file by a path that leads out of its folder.
    """
    names = [name for name in load_study(source).digests if not is_code(name) and not Path(name).is_absolute()]
    for name in names:
        if ".." in Path(name).parts:
            raise StudyError(
                Fault("lies outside the folder of the study", str(source), value=name, allowed="a whole path")
            )
    return names


@contextmanager
def copied(pairs: Iterable[tuple[Path, Path]]) -> Iterator[None]:
    """Copies of files, from and to; where the block fails, those that were made go again.

    Raises OutputError where another file of that name is there.
    """
    made: list[Path] = []
    try:
        for file, to in pairs:
            made += _copied(file, to)
        yield
    except SweepError:
        for path in made:
            path.unlink(missing_ok=True)
        raise


def _copied(file: Path, to: Path) -> list[Path]:
    content = read_input(file, MOST_BYTES, DataError)
    if os.path.lexists(to):
        if read_input(to, MOST_BYTES, OutputError) != content:
            raise OutputError(Fault("holds something else already", str(to), allowed="another --folder"))
        return []
    write_bytes(content, to)
    return [to]
