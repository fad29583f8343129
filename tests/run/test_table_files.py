"""Files of predictions and detections: whatever else is under such a name is one line, at once and in little memory."""

from __future__ import annotations

import gzip
import io
import lzma
import os
import tarfile
import zipfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np
import pandas as pd
import psutil
import pyarrow as pa
import pytest
from pyarrow import parquet as pq

from sweep.base.errors import DataError
from sweep.run.score import reader_of, table_of
from sweep.run.score_streets import read_detections

from ..build import one_line
from ..watchdog import within

MOST_BYTES = 500_000_000
GOOD = "image_id,state\n" + "".join(f"i{at},red\n" for at in range(50))


def archived(kind: str) -> bytes:
    held = io.BytesIO()
    if kind == "zip":
        with zipfile.ZipFile(held, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr("a.csv", GOOD)
    else:
        with tarfile.open(fileobj=held, mode="w") as tar:
            member = tarfile.TarInfo("a.csv")
            member.size = len(GOOD)
            tar.addfile(member, io.BytesIO(GOOD.encode()))
    return held.getvalue()


def bomb() -> bytes:
    held = io.BytesIO()
    pq.write_table(pa.table({"image_id": pa.array(np.zeros(20_000_000, dtype=np.int8))}), held)
    return held.getvalue()


FILES: dict[str, tuple[str, Callable[[], bytes], str]] = {
    "zip": ("a.csv", lambda: archived("zip"), "not a text table"),
    "tar": ("a.csv", lambda: archived("tar"), "not a text table"),
    "xz": ("a.csv", lambda: lzma.compress(GOOD.encode()), "not a text table"),
    "cut gz": ("a.csv", lambda: gzip.compress(GOOD.encode())[:-9], "not a text table"),
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


@pytest.mark.slow
def test_of_200_mutated_tables_each_is_read_or_one_line(tmp_path: Path) -> None:
    rng, read = np.random.default_rng(4), 0
    held = io.BytesIO()
    pd.read_csv(io.StringIO(GOOD)).to_parquet(held)
    for number in range(200):
        whole = bytearray((GOOD.encode(), held.getvalue())[number % 2])
        for _ in range(int(rng.integers(1, 4))):
            at = int(rng.integers(len(whole)))
            match int(rng.integers(3)):
                case 0:
                    whole[at] = int(rng.integers(256))
                case 1:
                    del whole[at : at + int(rng.integers(1, 30))]
                case _:
                    whole[at:at] = bytes(rng.integers(0, 256, 5, dtype=np.uint8))
        path = tmp_path / f"a.{('csv', 'parquet')[number % 2]}"
        path.write_bytes(whole)
        with little_memory():
            read += read_or_one_line(path)[0]
    assert read > 10


def read_or_one_line(path: Path) -> tuple[bool, int]:
    """Read a file as predictions and as detections, each in two seconds: whether it is a table, and how many took it."""
    with within(2):
        try:
            table = table_of(path)
        except DataError as error:
            assert len(error.issues) == 1  # noqa: PT017
            return False, 0
    images = pd.DataFrame({"image_id": [f"i{at}" for at in range(50)], "state": "red"})
    taken = 0
    for reads in (lambda: reader_of(table, path, images, ["red", "green"]), lambda: detections_in(path)):
        with within(2), suppress(DataError):
            reads()
            taken += 1
    return True, taken


def detections_in(path: Path) -> pd.DataFrame:
    labels = pd.DataFrame({"image_id": ["i0"], "design_id": [0], "width": [100], "height": [100]})
    return read_detections(path, labels, ["red", "green"])


@contextmanager
def little_memory() -> Iterator[None]:
    """Fail if the process takes 500 MB more than it has, and more than any test before took."""
    resource = pytest.importorskip("resource")
    most = max(
        psutil.Process().memory_info().rss + MOST_BYTES, 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    )
    yield
    assert 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss <= most
