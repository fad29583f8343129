"""Parts of a table joined to one Parquet file, and the footer that says where its columns are."""

from __future__ import annotations

import resource
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from sweep.base.errors import OutputError
from sweep.results import joined
from sweep.results.footer import footer_bytes, footer_of
from sweep.results.joined import Late, RowsPart, joining
from sweep.results.tables import batches, encoded, result_schema

SCHEMA = result_schema(["left_nm"], ["csd_yellow_red", "sensitivity"])


def table(rows: int, first: int = 0) -> pa.Table:
    """Rows of a result table, with the null columns and the words that such rows have."""
    rng = np.random.default_rng(first)
    words = pa.array([["sweep", "reference"][i % 2] for i in range(rows)], pa.string())
    made: dict[str, pa.Array] = {
        "design_id": pa.array(range(first, first + rows), pa.int64()),
        "filter_id": pa.array(range(first, first + rows), pa.int64()),
        "left_nm": pa.array([600.0 + i % 7 for i in range(rows)]),
        "csd_yellow_red": pa.array(rng.random(rows)),
        "sensitivity": pa.array([None if i % 5 == 0 else 0.5 for i in range(rows)], pa.float64()),
        "feasible": pa.array([True] * rows),
        "pareto": pa.array([i % 3 == 0 for i in range(rows)]),
    }
    made |= dict.fromkeys(("kind", "cfa", "status"), words)
    return pa.table([made.get(f.name, pa.nulls(rows, pa.string())).cast(f.type) for f in SCHEMA], schema=SCHEMA)


def late_of(ids: set[int]) -> Late:
    """A front of these rows."""

    def of(some: pa.Table) -> np.ndarray:
        assert some.schema.names == ["design_id", "pareto"]
        return np.array([number in ids for number in some["design_id"].to_pylist()], bool)

    return Late("pareto", ["design_id", "pareto"], of)


def part_of(rows: pa.Table) -> RowsPart:
    """A part, whose few rows are those that its own `pareto` marks, the last one first."""
    at = np.flatnonzero(rows["pareto"].to_numpy())[::-1]
    return RowsPart(encoded(rows), rows.num_rows, rows.take(pa.array(at)), at)


@pytest.mark.parametrize("sizes", [[40], [3, 40, 41, 2, 2, 40], [5, 1], []])
def test_parts_are_joined_row_by_row(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, sizes: list[int]) -> None:
    monkeypatch.setattr(joined, "_AS_THEY_ARE", 40)
    made: list[list[str]] = []

    def counted(*some: pa.Table) -> bytes:
        made.extend(each.schema.names for each in some)
        return encoded(*some)

    starts = np.cumsum([0, *sizes]).tolist()
    tables = [table(size, start) for size, start in zip(sizes, starts, strict=False)]
    parts = list(map(part_of, tables))
    monkeypatch.setattr(joined, "encoded", counted)
    local = pa.concat_tables([SCHEMA.empty_table(), *tables]).filter(pa.compute.field("pareto"))
    on_front = {*local["design_id"].to_pylist()[1::2], -1, 1}
    path = tmp_path / "whole.parquet"
    with joining(late_of(on_front), SCHEMA, path) as whole:
        for part in parts:
            whole.add(part)
            assert not path.exists()
    wanted = [
        row | {"pareto": row["pareto"] and row["design_id"] in on_front} for each in tables for row in each.to_pylist()
    ]
    found = pq.read_table(path, page_checksum_verification=True)
    assert found.schema.equals(SCHEMA, check_metadata=True)
    assert found.to_pylist() == wanted
    assert found["pareto"].to_pylist().count(True) == local.num_rows // 2 + (1 in local["design_id"].to_pylist())
    assert sum(each.num_rows for each in batches(path)) == sum(sizes)
    # A large part is a row group of its own, of which the late column alone is encoded.
    large = sum(size >= 40 for size in sizes)
    small = 0 if not sizes else sum(1 for a, b in zip([40, *sizes], sizes, strict=False) if b < 40 <= a)
    assert pq.read_metadata(path).num_row_groups == large + small
    assert sum(names == ["pareto"] for names in made) == large + small
    assert len(made) == large + 2 * small + 1  # and the schema, once
    # Statistics, by which readers leave out row groups, are those of the rows.
    metadata = pq.read_metadata(path)
    column = SCHEMA.get_field_index("design_id")
    groups = [metadata.row_group(g) for g in range(metadata.num_row_groups)]
    firsts = [group.column(column).statistics.min for group in groups]
    assert firsts == np.cumsum([0, *(group.num_rows for group in groups)])[: len(groups)].tolist()
    assert all(
        group.total_byte_size == sum(group.column(c).total_uncompressed_size for c in range(group.num_columns))
        for group in groups
    )


def test_any_column_alone_is_read_from_a_file_whose_late_column_stands_at_its_end(tmp_path: Path) -> None:
    tables = [table(40_000), table(33_000, 40_000)]
    path = tmp_path / "whole.parquet"
    with joining(late_of({0, 40_003}), SCHEMA, path) as whole:
        for each in tables:
            whole.add(part_of(each))
    for name in SCHEMA.names:
        wanted = pa.concat_tables(tables)[name].to_pylist()
        if name == "pareto":
            wanted = [number in (0, 40_003) for number in range(73_000)]
        assert pq.read_table(path, columns=[name])[name].to_pylist() == wanted
    assert pq.read_table(path, filters=[("pareto", "==", True)])["design_id"].to_pylist() == [0, 40_003]


def test_parts_of_another_schema_or_none_at_all_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "whole.parquet"
    for content in (b"", b"PAR1", b"PAR1" + bytes(20) + b"PAR1", encoded(table(3))[:-9] + b"\xff\xff\xff\x7fPAR1"):
        with pytest.raises(ValueError, match=r"Parquet|footer"):
            footer_of(content)

    def join(part: RowsPart) -> None:
        with joining(late_of(set()), SCHEMA, path) as whole:
            whole.add(part)

    few = table(1)
    with pytest.raises((ValueError, KeyError, pa.ArrowException)):
        join(RowsPart(b"no table", 40_000, few, np.array([0])))
    assert list(tmp_path.iterdir()) == []  # nothing half written


def test_what_is_wrong_beside_the_file_is_told_as_it_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A disk that refuses the file is one thing, and an OSError of what goes on meanwhile another."""
    path = tmp_path / "whole.parquet"

    def fails_with(error: OSError) -> None:
        with joining(late_of(set()), SCHEMA, path):
            raise error

    with pytest.raises(BrokenPipeError, match="gone"):
        fails_with(BrokenPipeError("gone"))
    assert list(tmp_path.iterdir()) == []

    def fails_behind_what_waits() -> None:
        with joining(late_of(set()), SCHEMA, path) as whole:
            whole._sink.write(bytes(131))  # still in memory
            _, most = resource.getrlimit(resource.RLIMIT_FSIZE)
            resource.setrlimit(resource.RLIMIT_FSIZE, (100, most))
            try:
                raise OutputError("the journal")
            finally:
                limits.callback(resource.setrlimit, resource.RLIMIT_FSIZE, (most, most))

    with ExitStack() as limits, pytest.raises(OutputError, match="the journal"):
        fails_behind_what_waits()
    assert list(tmp_path.iterdir()) == []

    def full(_: object) -> bytes:
        raise OSError(28, "No space left on device")

    def join() -> None:
        with joining(late_of(set()), SCHEMA, path) as whole:
            whole.add(part_of(table(3)))
            monkeypatch.setattr(joined, "encoded", full)

    with pytest.raises(OutputError, match="No space left"):
        join()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "held",
    [
        pa.table({"a": [1, None, 3], "b": ["x", "y", None], "c": [[1, 2], [], None]}),
        pa.table({"s": pa.array([{"x": 1.5, "y": True}, None]), "t": pa.array([0, 10**15], pa.timestamp("us"))}),
        pa.table({f"column {i}": [float(i)] for i in range(40)}),
        table(0),
    ],
)
def test_a_footer_is_written_as_it_was_read(held: pa.Table) -> None:
    sink = pa.BufferOutputStream()
    pq.write_table(held, sink, write_page_index=True, sorting_columns=[pq.SortingColumn(0)])
    content = bytes(sink.getvalue().to_pybytes())
    footer, start = footer_of(content)
    assert footer_bytes(footer) == content[start:]


@given(st.binary(max_size=60))
@example(b"\x08\x01\x00\x00")
def test_any_bytes_are_a_footer_or_refused(inner: bytes) -> None:
    content = b"PAR1" + inner + len(inner).to_bytes(4, "little") + b"PAR1"
    try:
        footer, start = footer_of(content)
    except ValueError:
        return
    assert start == 4
    assert footer_of(b"PAR1" + footer_bytes(footer))[0] == footer
