"""Arrow's arrays from NumPy's, and back: PyArrow's own conversions are the oracle."""

import numpy as np
import pyarrow as pa
import pytest

from sweep.results.arrays import flags, numbers, places, values_of, which, words

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


def test_which_word_stands_in_each_row() -> None:
    column = pa.array(["b", None, "a", "b", None], pa.string()).dictionary_encode()
    assert which(column).tolist() == [0, -1, 1, 0, -1]
    assert which(column.slice(2)).tolist() == [1, 0, -1]
    few = pa.DictionaryArray.from_arrays(pa.array([1, 0, 1, None], pa.int8()), pa.array(["a", "b"]))
    assert which(few).tolist() == [1, 0, 1, -1]
    assert which(few[:0]).tolist() == []
    assert which(pa.nulls(3, pa.dictionary(pa.int32(), pa.string()))).tolist() == [-1, -1, -1]
