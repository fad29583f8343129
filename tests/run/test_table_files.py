"""Files of predictions and detections: whatever else is under such a name is one line, at once and in little memory."""

from __future__ import annotations

import gzip
import io
import lzma
import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pytest
from pyarrow import parquet as pq

from sweep.features.vision.score import table_of

from ..build import one_line
from ..watchdog import within

GOOD = "image_id,state\n" + "".join(f"i{at},red\n" for at in range(50))


def bomb() -> bytes:
    held = io.BytesIO()
    pq.write_table(pa.table({"image_id": pa.array(np.zeros(20_000_000, dtype=np.int8))}), held)
    return held.getvalue()


FILES: dict[str, tuple[str, Callable[[], bytes], str]] = {
    "xz": ("a.csv", lambda: lzma.compress(GOOD.encode()), "not a text table"),
    "gz bomb": ("a.csv", lambda: gzip.compress(bytes(50_000_000)), "not a text table"),
    "a field too many": ("a.csv", lambda: GOOD.replace("i7,red", "i7,red,0").encode(), "Expected 2 fields in line 9"),
    "a field too many at first": (
        "a.csv",
        lambda: GOOD.replace(",red", ",red,0").encode(),
        "a row of 3 fields under 2",
    ),
    "Latin-1": ("a.csv", lambda: GOOD.encode() + b"\xff,red\n", "cannot be read"),
    "empty": ("a.csv", lambda: b"", "cannot be read"),
    "no Parquet": ("a.parquet", lambda: b"PAR1 PAR1", "cannot be read"),
    "Parquet bomb": ("a.parquet", bomb, "the table is too large (got '20,000,000 cells')"),
}


@pytest.mark.parametrize("name", FILES)
def test_what_is_no_table_is_one_line(tmp_path: Path, name: str) -> None:
    file, content, said = FILES[name]
    (tmp_path / file).write_bytes(content())
    with within(20), one_line(said):
        table_of(tmp_path / file)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes here")
def test_what_is_no_file_is_not_read(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.csv")
    (tmp_path / "zero.csv").symlink_to("/dev/zero")
    with (tmp_path / "sparse.csv").open("wb") as file:
        file.truncate(2 * 10**9)
    for name, said in (("pipe", "not a file"), ("zero", "not a file"), ("sparse", "the file is too large")):
        with within(20), one_line(said):
            table_of(tmp_path / f"{name}.csv")


def test_a_text_index_is_a_column(tmp_path: Path) -> None:
    pd.DataFrame({"image_id": ["a", "b"], "state": ["red", "red"]}, index=["x", "y"]).to_parquet(tmp_path / "a.parquet")
    assert list(table_of(tmp_path / "a.parquet").index) == [0, 1]
