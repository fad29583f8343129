"""Write the JSON Schema of study files beside the studies."""

from __future__ import annotations

import json
import os
from pathlib import Path

from ..base.errors import Fault, OutputError
from ..results.atomic import write_text
from ..study.editors import TITLE, schema_text
from ..study.schema import StudySection

_HEAD_BYTES = 4096
"""The title is the second key of a schema; in earlier versions it was the section's name."""


def write_schema(path: Path) -> None:
    """Write the schema; raises OutputError, also where the file holds anything but such a schema."""
    if os.path.lexists(path):
        try:
            own = _is_ours(path)
        except OSError as error:
            raise OutputError(Fault(f"cannot be read: {error.strerror or error}", str(path))) from None
        if not own:
            raise OutputError(Fault("holds something else already", str(path), allowed="another --output"))
    write_text(schema_text(), path)


def _is_ours(path: Path) -> bool:
    """Whether a file begins as every schema that this writes; what is no plain file is not read."""
    if not path.is_file():
        return False
    with path.open("rb") as file:
        head = file.read(_HEAD_BYTES)
    return any(f'"title": {json.dumps(title)}'.encode() in head for title in (TITLE, StudySection.__name__))
