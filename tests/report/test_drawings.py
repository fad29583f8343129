"""Drawings that go to workers are plain values: no run, no cache, nothing that another thread fills."""

from __future__ import annotations

import pytest

from sweep.report import read_output
from sweep.report.page import _drawings, _vision_drawings

from ..conftest import FinishedFolder
from ..plain_values import MOST_BYTES, pickled_size
from .shipped import EVERY


@pytest.mark.parametrize("name", EVERY)
def test_every_drawing_of_a_report_is_a_plain_value(finished: FinishedFolder, name: str) -> None:
    output = read_output(finished(name))
    drawings = [*_drawings(output), *_vision_drawings(output)]
    assert len(drawings) > 4
    for file, _, draw in drawings:
        assert pickled_size(draw) < MOST_BYTES, file
