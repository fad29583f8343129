"""Output of commands: lines for people, one JSON object for programs, and progress on stderr."""

from __future__ import annotations

import json
import math
import sys
import time
from collections.abc import Iterable, Mapping, Sequence
from contextlib import ExitStack
from typing import Annotated, Any, Protocol

import typer

from ..base.errors import SweepError

Json = Annotated[bool, typer.Option("--json", help="Say one JSON object on stdout, and everything else on stderr.")]
Quiet = Annotated[
    bool, typer.Option("--quiet", "-q", help="Print errors alone, a run's folder, and with --json the object.")
]
_INTERVAL_S = 10.0
_LEAST_SHARE, _LEAST_S, _KNOWN_S = 0.03, 5.0, 60.0
"""The time left is said from a share of a phase and a time on, or from the last: first jobs wait for the compiler."""


class Answered(Protocol):
    """What a command found: an `Answer`, or an evaluation, which makes its table only when asked for facts."""

    @property
    def lines(self) -> Sequence[str]:
        """What it prints."""

    @property
    def facts(self) -> Mapping[str, Any]:
        """The same as plain values."""

    @property
    def problem(self) -> SweepError | None:
        """Error with which it ends."""


def print_answer(answer: Answered, *, as_json: bool = False, quiet: bool = False) -> None:
    """Print what a command found, and end with its problem.

    With `as_json` one JSON object goes to stdout, in which NaN and infinity are null; everything else goes to stderr.
    """
    print_lines(answer.lines, as_json=as_json, quiet=quiet)
    if as_json:
        print_json(answer.facts)
    if answer.problem is not None:
        raise answer.problem


def print_lines(lines: Iterable[str], *, as_json: bool, quiet: bool) -> None:
    """Print lines on stdout, or on stderr with `--json`."""
    for line in () if quiet else lines:
        typer.echo(line, err=as_json)


def print_json(facts: Mapping[str, Any]) -> None:
    """Print one JSON object."""
    typer.echo(json.dumps(_plain(facts), allow_nan=False, ensure_ascii=False))


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _plain(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(inner) for inner in value]
    if isinstance(value, bool | int | str) or value is None:
        return value
    if hasattr(value, "tolist"):  # of NumPy
        return _plain(value.tolist())
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return str(value)


class ProgressDisplay(ExitStack):
    """Progress of a command on stderr: a live bar on a terminal, a line now and then elsewhere."""

    def __init__(self, *, quiet: bool = False) -> None:
        super().__init__()
        self._quiet = quiet
        self._bars: Any = None
        self._phase = ""
        self._started = self._last_line = 0.0
        self._first = 0
        if sys.stderr.isatty() and not quiet:
            from rich import progress  # noqa: PLC0415  (only on a terminal)
            from rich.console import Console  # noqa: PLC0415

            columns = (
                progress.TextColumn("{task.description}"),
                progress.BarColumn(),
                progress.MofNCompleteColumn(),
                progress.TextColumn("{task.fields[pace]}"),
            )
            self._bars = self.enter_context(progress.Progress(*columns, console=Console(stderr=True)))

    def note(self, text: str) -> None:
        """Print a remark, above the bar of a terminal; a headline of a part as it is."""
        remark = text if text.startswith("--") else f"Note: {text}"
        if self._bars is not None:
            self._bars.console.print(remark, markup=False, highlight=False, soft_wrap=True)
        elif not self._quiet:
            typer.echo(remark, err=True)

    def update(self, phase: str, done: int, total: int) -> None:
        """Show the progress of a phase."""
        now = time.monotonic()
        new = phase != self._phase
        if new:
            self._phase, self._started, self._first, self._last_line = phase, now, done, now
        if self._bars is not None:
            if new:
                self._task = self._bars.add_task(phase, total=total, pace="")
            self._bars.update(self._task, completed=done, pace=self._pace(now, done, total) if done < total else "")
        elif not self._quiet and now - self._last_line >= _INTERVAL_S:
            self._last_line = now
            print(f"{phase}: {done:,} of {total:,}, {self._pace(now, done, total)}", file=sys.stderr, flush=True)

    def _pace(self, now: float, done: int, total: int) -> str:
        """Rate and time left, in words."""
        elapsed, new = now - self._started, done - self._first
        if new <= 0 or (elapsed < _KNOWN_S and (new < _LEAST_SHARE * total or elapsed < _LEAST_S)):
            return "time left not known yet"
        rate = new / elapsed
        return f"{rate:,.3g}/s, {_duration((total - done) / rate)} left"


def _duration(seconds: float) -> str:
    """Return a time that passes, in words."""
    minutes = round(seconds / 60)
    if minutes < 2:
        return f"{seconds:.0f} s"
    return f"{minutes} min" if minutes < 120 else f"{minutes // 60:,} h {minutes % 60} min"
