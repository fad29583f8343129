"""Files of a finished run are what they are taken for; raises OutputError where they are not."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

import pyarrow as pa
import pyarrow.parquet as pq
from pydantic import BaseModel
from ruamel.yaml.error import YAMLError

from ..base.errors import Fault, OutputError
from .facts import lacking

_MOST_SHOWN = 10
_Model = TypeVar("_Model", bound=BaseModel)


def read_mapping(path: Path, parse: Callable[[str], Any]) -> dict[str, Any]:
    """The mapping that a text file holds; raises OutputError."""
    try:
        found = parse(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError, YAMLError) as error:
        raise OutputError(Fault(f"cannot be read: {error}", str(path))) from None
    if not isinstance(found, dict):
        raise OutputError(Fault("not a mapping", str(path)))
    return found


def checked_facts(path: Path, kind: type[_Model], data: Mapping[str, Any]) -> _Model:
    """The data as an object; raises OutputError that names what is missing or no such thing."""
    if lacks := lacking(kind, data):
        raise lacking_in(path, lacks[:_MOST_SHOWN])
    return kind.model_validate(data)


def lacking_in(path: Path, what: Sequence[str]) -> OutputError:
    """What a file lacks, and what helps."""
    again = "delete it, and `sweep run` of the study makes it again"
    return OutputError(Fault(f"lacks {', '.join(what)}; {again}", str(path)))


def check_columns(path: Path, wanted: Sequence[str]) -> None:
    """Raises OutputError for a table without the columns that are wanted."""
    try:
        names = pq.read_schema(path).names
    except (OSError, pa.ArrowException) as error:
        raise OutputError(Fault(f"cannot be read: {error}", str(path))) from None
    missing = [name for name in dict.fromkeys(wanted) if name not in names]
    if missing:
        raise lacking_in(path, missing)
