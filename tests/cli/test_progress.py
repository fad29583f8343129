"""The time left is said where it is known, in words of people."""

from __future__ import annotations

import pytest

from sweep.cli import output


@pytest.mark.parametrize(
    ("elapsed_s", "done", "said"),
    [
        (1.0, 500, "not known yet"),  # half of it, in the first second
        (30.0, 1, "not known yet"),  # the first jobs wait for the compiler
        (10.0, 500, "50/s, 10 s left"),
        (70.0, 1, "0.0143/s, 19 h 26 min left"),
        (600.0, 250, "0.417/s, 30 min left"),
    ],
)
def test_the_time_left_is_said_where_it_is_known(
    elapsed_s: float, done: int, said: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    clock = iter([100.0, 100.0 + elapsed_s])
    monkeypatch.setattr(output.time, "monotonic", lambda: next(clock))
    monkeypatch.setattr(output, "_INTERVAL_S", 0.5)
    with output.ProgressDisplay() as shown:
        shown.update("designs", 0, 1000)
        shown.update("designs", done, 1000)
    assert capsys.readouterr().err.strip().endswith(said)
