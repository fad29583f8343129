"""Parts of a table joined to one Parquet file, and the footer that says where its columns are."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from sweep.results import joined
from sweep.results.footer import footer_bytes, footer_of
from sweep.results.joined import EncodedRows, Late, write_joined
from sweep.results.tables import batches, encoded, result_schema

SCHEMA = result_schema(["left_nm"], ["csd_yellow_red", "sensitivity"])


def table(rows: int, first: int = 0) -> pa.Table:
    """Rows of a result table, with the null columns and the words that such rows have."""
    rng = np.random.default_rng(first)
    words = pa.array([["sweep", "reference"][i % 2] for i in range(rows)], pa.string())
    made: dict[str, pa.Array] = {
        "design_id": pa.array(range(first, first + rows), pa.int64()),
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

    def of(some: pa.Table) -> pa.Table:
        found = pa.array([number in ids for number in some["design_id"].to_pylist()], pa.bool_())
        return some.set_column(some.schema.get_field_index("pareto"), some.schema.field("pareto"), found)

    return Late("pareto", ["design_id", "pareto"], of)


@pytest.mark.parametrize("sizes", [[40], [3, 40, 41, 2, 2, 40], [5, 1], []])
def test_parts_are_joined_row_by_row(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, sizes: list[int]) -> None:
    monkeypatch.setattr(joined, "_AS_THEY_ARE", 40)
    made: list[list[str]] = []

    def counted(some: pa.Table) -> bytes:
        made.append(some.schema.names)
        return encoded(some)

    monkeypatch.setattr(joined, "encoded", counted)
    starts = np.cumsum([0, *sizes]).tolist()
    tables = [table(size, start) for size, start in zip(sizes, starts, strict=False)]
    on_front = {1, 39, 45}
    parts = [EncodedRows(encoded(each), each.num_rows) for each in tables]
    path = tmp_path / "whole.parquet"
    write_joined(parts, late_of(on_front), SCHEMA, path)
    wanted = late_of(on_front).of(pa.concat_tables([SCHEMA.empty_table(), *tables]))
    found = pq.read_table(path, page_checksum_verification=True)
    assert found.schema.equals(SCHEMA, check_metadata=True)
    assert found.to_pylist() == wanted.to_pylist()
    assert sum(each.num_rows for each in batches(path)) == sum(sizes)
    # A large part is a row group of its own, of which the late column alone is encoded.
    large = sum(size >= 40 for size in sizes)
    assert sum(names == ["pareto"] for names in made) == large
    small = 0 if not sizes else sum(1 for a, b in zip([40, *sizes], sizes, strict=False) if b < 40 <= a)
    assert pq.read_metadata(path).num_row_groups == large + small
    assert len(made) == large + small + 1  # and the schema, once
    # Statistics, by which readers leave out row groups, are those of the rows.
    metadata = pq.read_metadata(path)
    column = SCHEMA.get_field_index("design_id")
    groups = [metadata.row_group(g) for g in range(metadata.num_row_groups)]
    firsts = [group.column(column).statistics.min for group in groups]
    assert firsts == np.cumsum([0, *(group.num_rows for group in groups)])[: len(groups)].tolist()


def test_parts_of_another_schema_or_none_at_all_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "whole.parquet"
    for content in (b"", b"PAR1", b"PAR1" + bytes(20) + b"PAR1", encoded(table(3))[:-9] + b"\xff\xff\xff\x7fPAR1"):
        with pytest.raises(ValueError, match=r"Parquet|footer"):
            footer_of(content)
    with pytest.raises((ValueError, KeyError, pa.ArrowException)):
        write_joined([EncodedRows(b"no table", 40_000)], late_of(set()), SCHEMA, path)
    assert list(tmp_path.iterdir()) == []  # nothing half written


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
