"""What the tests check at every call of the package."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from beartype.roar import BeartypeCallHintParamViolation, BeartypeCallHintReturnViolation

from sweep.base.types import PerValue

from ..shapes import checked


def test_shapes_are_those_of_one_call() -> None:
    @checked
    def grown(one: PerValue, other: PerValue) -> PerValue:
        return np.append(one, 1.0) if other[0] > 5 else one

    ones = np.ones(1), np.ones(2)
    for size in ones:
        grown(size, size)
    with pytest.raises(BeartypeCallHintParamViolation):
        grown(*ones)
    with pytest.raises(BeartypeCallHintParamViolation):
        grown(np.ones(1, dtype=int), ones[0])
    with pytest.raises(BeartypeCallHintReturnViolation):
        grown(9 * ones[0], 9 * ones[0])


def test_each_closure_is_checked_and_called() -> None:
    def times(factor: int) -> Callable[[int], int]:
        @checked
        def product(number: int) -> int:
            return number * factor if number < 100 else "large"  # type: ignore[return-value]

        return product

    for factor in (2, 3):
        product = times(factor)
        assert product(2) == 2 * factor
        with pytest.raises(BeartypeCallHintParamViolation):
            product("2")  # type: ignore[arg-type]
        with pytest.raises(BeartypeCallHintReturnViolation):
            product(100)
