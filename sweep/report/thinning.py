"""A result table of any length, thinned to what a report shows: the front exactly, the named, the best, a sample."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from ..arrays import FloatArray
from ..errors import Fault, OutputError
from ..store import ROW_GROUP, holds, release_memory

MOST_ROWS = 150_000
"""A table of up to this many rows is kept whole."""
_BEST = 100


@dataclass(frozen=True)
class Counts:
    """Rows of the whole table: all, feasible, on the Pareto front, failed; and how many of them were left out."""

    rows: int
    feasible: int
    front: int
    failed: int
    left_out: int


def batches(path: Path) -> Iterator[pa.Table]:
    """A Parquet file in tables of a row group each; raises OutputError when it is missing or damaged."""
    try:
        for batch in pq.ParquetFile(path, pre_buffer=False).iter_batches(ROW_GROUP):
            yield pa.Table.from_batches([batch])
    except (OSError, pa.ArrowException) as error:
        raise OutputError(Fault(f"cannot be read: {error}", str(path))) from None


def hashed(design_id: FloatArray) -> FloatArray:
    """A number from 0 to 1 for each id, the same for ever."""
    digests = [hashlib.sha256(str(i).encode()).digest()[:4] for i in design_id]
    return np.array([int.from_bytes(digest, "big") / 2**32 for digest in digests], dtype=float)


def thinned(path: Path, order: Sequence[str]) -> tuple[pd.DataFrame, Counts]:
    """The table to show and the counts of the whole one; no more than a row group and what is kept are in memory.

    Kept are all rows that are no sweep, the whole Pareto front, the best feasible designs by `order` (columns, all
    maximized) and of the others every n-th.
    """
    try:
        total = int(pq.read_metadata(path).num_rows)
    except (OSError, pa.ArrowException) as error:
        raise OutputError(Fault(f"cannot be read: {error}", str(path))) from None
    every = max(1, -(-total // MOST_ROWS))
    kept: list[pa.Table] = []
    best: pa.Table | None = None
    feasible = front = failed = 0
    for table in batches(path):
        ok, on_front = table["feasible"].to_numpy(), table["pareto"].to_numpy()
        feasible += int(ok.sum())
        front += int(on_front.sum())
        failed += int((~holds(table, "status", "ok")).sum())
        always = ~holds(table, "kind", "sweep") | on_front
        kept.append(table.filter(pa.array(always | (table["design_id"].to_numpy() % every == 0))))
        if every > 1:
            few = table.filter(pa.array(ok & ~always))
            best = _best(few if best is None else pa.concat_tables([best, few]), order)
        release_memory()
    if best is not None:
        kept.append(best)
    frame: pd.DataFrame = pa.concat_tables(kept).unify_dictionaries().to_pandas()
    frame = frame.drop_duplicates("design_id").sort_values("design_id", ignore_index=True)
    return frame, Counts(total, feasible, front, failed, total - len(frame))


def _best(table: pa.Table, order: Sequence[str]) -> pa.Table:
    keys = [(name, "descending") for name in dict.fromkeys(order)]
    return table.take(pc.sort_indices(table, sort_keys=[*keys, ("design_id", "ascending")])[:_BEST]).combine_chunks()
