"""Pickles of plain values, which refuse runs and caches."""

from __future__ import annotations

import io
import pickle
from functools import cached_property
from typing import Any

from sweep.results.output import Output

MOST_BYTES = 2_000_000


class PlainPickler(pickle.Pickler):
    """A pickler that refuses runs and objects with a cached property."""

    def reducer_override(self, value: Any) -> Any:
        kind = type(value)
        cached = [name for base in kind.__mro__ for name, v in vars(base).items() if isinstance(v, cached_property)]
        assert not isinstance(value, Output), "a drawing refers to the whole run"
        assert not cached or not kind.__module__.startswith("sweep"), f"a drawing refers to {kind.__name__}.{cached[0]}"
        return NotImplemented


def pickled_size(value: object) -> int:
    buffer = io.BytesIO()
    PlainPickler(buffer).dump(value)
    return buffer.tell()
