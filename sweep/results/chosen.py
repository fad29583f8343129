"""A design of a finished run, by what people call it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.compute as pc

from ..base.errors import Fault, OutputError, SweepError, nearest
from .output import Output
from .tables import RESULTS, batches

BEST = "best"
_MOST_SHOWN = 10


def find_row(output: Output, key: str) -> Mapping[Any, Any]:
    """Return the row of a name, of a filter_id or of `best`; of one that occurs in several scenarios the first.

    Raises SweepError, with the nearest name, when there is none or when its design failed.
    """
    table = output.table
    named = table[table["name"] == key]
    if key == BEST:
        if output.best.empty:
            raise SweepError(Fault("the run has no feasible design that was swept or searched", str(output.folder)))
        row: dict[Any, Any] = output.best.iloc[0].to_dict()
    elif len(named):
        row = named.iloc[0].to_dict()
    elif key.isascii() and key.isdecimal() and int(key) < output.provenance.filters:
        row = _streamed(output.folder / RESULTS, int(key))
    else:
        names = list(dict.fromkeys(map(str, table["name"].dropna())))
        shown = [*names[:_MOST_SHOWN], *(["..."] if len(names) > _MOST_SHOWN else [])]
        allowed = f"{BEST}, a name ({', '.join(shown)}), or a filter_id from 0 to {output.provenance.filters - 1:,}"
        near = nearest(key, [*names, BEST])
        raise SweepError(Fault("no such design", str(output.folder), None, "--design", key, allowed, near))
    if row["status"] != "ok":
        raise SweepError(Fault("the design failed", str(output.folder), None, "--design", row["status"]))
    return row


def _streamed(path: Path, filter_id: int) -> dict[str, Any]:
    """Return the first row of a filter, a row group in memory."""
    for table in batches(path):
        rows = table.filter(pc.equal(table["filter_id"], pa.scalar(filter_id)))
        if rows.num_rows:
            return dict(rows.to_pylist()[0])
    raise OutputError(Fault("has too few rows", str(path), None, "filter_id", filter_id))
