"""One design takes no more work than is kept: counted, not timed. `python -m tests.work` keeps less after an improvement."""

from __future__ import annotations

import json

import pytest

from ..work import FILE, SCENES, search_work, work_of

KEPT = json.loads(FILE.read_text())
_MOST = 1.2
"""Times what is kept: libraries and processors differ a little."""


@pytest.mark.parametrize("name", SCENES)
def test_a_design_takes_no_more_work(name: str) -> None:
    found = work_of(name)
    assert {what: count for what, count in found.items() if count > _MOST * KEPT[name][what]} == {}


def test_a_search_takes_no_more_evaluations() -> None:
    assert search_work()["evaluations"] <= _MOST * KEPT["search"]["evaluations"]
