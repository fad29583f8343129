"""Begin a study from one that is there, and with curves that lie beside it."""

from __future__ import annotations

import os
import re
import shlex
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ...curves.scan import MOST_BYTES
from ...disk import read_input
from ...errors import DataError, Fault, OutputError, StudyError, SweepError
from ...results.tables import atomic, write_bytes, write_text
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


@contextmanager
def beside(folder: Path, *files: Path | None) -> Iterator[list[Path | None]]:
    """Copies of files in a folder; where the block fails, those that were made go again.

    Raises OutputError where another file of that name is there.
    """
    made: list[Path] = []
    copies: list[Path | None] = []
    try:
        for file in files:
            copies.append(None if file is None else folder / file.name)
            if file is not None:
                made += _copied(file, folder / file.name)
        yield copies
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
