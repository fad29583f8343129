"""Arrow's arrays from NumPy's, and back: PyArrow's own conversions are the oracle."""

import numpy as np
import pyarrow as pa
import pytest

from sweep.results.arrays import flags, holds_one_of, numbers, places, texts_of, values_of, words

NAN = float("nan")
FLOATS = [1.5, NAN, -0.0, np.inf, NAN, 5e-324, 7.0, NAN, 1.0]


@pytest.mark.parametrize("values", [FLOATS, [1.0, 2.0], []])
def test_numbers_are_null_where_they_are_nan(values: list[float]) -> None:
    made = numbers(np.array(values, dtype=float))
    made.validate(full=True)
    assert made.equals(pa.array(np.array(values, dtype=float), from_pandas=True))


def test_every_second_number_of_a_table() -> None:
    strided = np.arange(20.0).reshape(10, 2)[:, 1]
    assert numbers(strided).to_pylist() == strided.tolist()
    assert places(np.arange(20)[::3]).to_pylist() == [*range(0, 20, 3)]


@pytest.mark.parametrize("n", [0, 1, 7, 8, 9, 64, 1001])
def test_flags_and_places(n: int) -> None:
    rng = np.random.default_rng(n)
    truth, at = rng.random(n) < 0.5, rng.integers(0, 2**40, n)
    for made, expected in ((flags(truth), pa.array(truth)), (places(at), pa.array(at, pa.int64()))):
        made.validate(full=True)
        assert made.equals(expected)


def test_words_that_are_long_or_not_of_this_alphabet() -> None:
    texts = ["ok", "", "ошибка", "x" * 1000]
    at = np.array([3, 0, 2, 2, 1])
    made = words(texts, at)
    made.validate(full=True)
    assert made.type == pa.dictionary(pa.int32(), pa.string())
    assert made.to_pylist() == [texts[index] for index in at]


@pytest.mark.parametrize("start", [0, 1, 8, 13])
@pytest.mark.parametrize(
    "kind", [pa.float64(), pa.int64(), pa.uint64(), pa.bool_()], ids=["float", "int", "unsigned", "bool"]
)
def test_values_of_a_slice_of_several_chunks(kind: pa.DataType, start: int) -> None:
    rng = np.random.default_rng(start)
    chunks = [pa.array(rng.integers(0, 2, n).astype(float), pa.float64()).cast(kind) for n in (0, 5, 17, 30)]
    column = pa.chunked_array(chunks, kind).slice(start, 31)
    found = values_of(column)
    assert found.dtype == column.to_numpy().dtype
    assert np.array_equal(found, column.to_numpy())
    assert np.array_equal(values_of(chunks[3].slice(start)), chunks[3].slice(start).to_numpy(zero_copy_only=False))


@pytest.mark.parametrize("start", [0, 3, 8])
def test_null_is_nan_and_nothing_where_there_is_no_such_value(start: int) -> None:
    column = pa.chunked_array([pa.array([None, 1.0, None, 2.0, 3.0, None, 4.0, None, None, 5.0])]).slice(start)
    assert np.array_equal(values_of(column), column.to_numpy(), equal_nan=True)
    assert np.isnan(values_of(pa.nulls(4, pa.float64()))).all()
    for kind in (pa.int64(), pa.bool_()):
        with pytest.raises(ValueError, match=f"1 of 2 values of {kind} are null"):
            values_of(pa.array([1, None], pa.int64()).cast(kind))


WORDS = ["b", None, "a", "b", None, "c"]


@pytest.mark.parametrize("wanted", [(), ("a",), ("b", "c"), ("a", "b", "c"), ("d",)], ids="".join)
def test_where_a_column_holds_one_of_some_words(wanted: tuple[str, ...]) -> None:
    column = pa.array(WORDS, pa.string()).dictionary_encode()
    few = pa.DictionaryArray.from_arrays(pa.array([1, 0, 1, None], pa.int8()), pa.array(["a", "b"]))
    for made in (column, column.slice(2), few, few[:0], pa.nulls(3, pa.dictionary(pa.int32(), pa.string()))):
        assert holds_one_of(made, wanted).tolist() == [word in wanted for word in made.to_pylist()]


def test_words_of_several_chunks() -> None:
    chunks = [pa.array(some).dictionary_encode() for some in (["b", "a", "b"], ["c", "b"], [])]
    column = pa.chunked_array([chunk.cast(pa.dictionary(pa.int32(), pa.string())) for chunk in chunks])
    assert texts_of(column) == column.to_pylist() == ["b", "a", "b", "c", "b"]
    assert texts_of(column.slice(1, 3)) == ["a", "b", "c"]
