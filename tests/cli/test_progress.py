"""What a long run says on its way, where no terminal shows a bar."""

from __future__ import annotations

import pytest

from sweep.cli import output


def test_no_eta_before_the_first_result(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    clock = iter([0.0, 11.0, 22.0, 33.0])
    monkeypatch.setattr(output.time, "monotonic", lambda: next(clock))
    display = output.ProgressDisplay()
    for done in (0, 5, 1_000, 10_000):
        display.update("designs", done, 20_000)
    assert capsys.readouterr().err.splitlines() == [
        "designs: 5 of 20,000, time left not known yet",
        "designs: 1,000 of 20,000, 45.5/s, 418 s left",
        "designs: 10,000 of 20,000, 303/s, 33 s left",
    ]
