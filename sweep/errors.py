"""Errors that carry data: what is wrong, where, what is allowed, and the nearest known name."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass


def nearest(name: object, known: Iterable[str]) -> str | None:
    """Return the known name that is most like `name`, or None when none is alike."""
    folded = {str(candidate).casefold(): str(candidate) for candidate in known}
    found = difflib.get_close_matches(str(name).casefold(), list(folded), n=1, cutoff=0.5)
    return folded[found[0]] if found else None


@dataclass(frozen=True)
class Fault:
    """One thing wrong with an input; prints as one line."""

    problem: str
    file: str | None = None
    line: int | None = None
    key: str | None = None
    value: object = None
    allowed: str | None = None
    nearest: str | None = None

    def __str__(self) -> str:
        place = "" if self.file is None else self.file if self.line is None else f"{self.file}:{self.line}"
        parts = [part for part in (place, self.key) if part]
        text = ": ".join([*parts, self.problem])
        if self.value is not None:
            text += f" (got {_short(self.value)})"
        if self.allowed is not None:
            text += f"; allowed: {self.allowed}"
        if self.nearest is not None:
            text += f"; did you mean {self.nearest!r}?"
        return " ".join(text.split())


class SweepError(Exception):
    """Base of all errors that a user can cause or mend. `exit_code` is what the command returns."""

    exit_code = 2

    def __init__(self, faults: Sequence[Fault] | Fault | str) -> None:
        if isinstance(faults, str):
            faults = (Fault(faults),)
        elif isinstance(faults, Fault):
            faults = (faults,)
        self.faults: tuple[Fault, ...] = tuple(faults)
        super().__init__("\n".join(str(fault) for fault in self.faults))


class StudyError(SweepError):
    """A study file that cannot be run as it is written."""


class DataError(SweepError):
    """A curve or a file of curves that cannot be used."""


class OutputError(SweepError):
    """An output folder that cannot be written, read or is in use."""


class InfeasibleError(SweepError):
    """A study that no design meets."""

    exit_code = 3


class FailedDesignError(SweepError):
    """A design that could not be computed, in a run that is to stop at the first one."""

    exit_code = 4


class BrokenPromiseError(SweepError):
    """An audit that found larger errors than were promised."""

    exit_code = 5


class InterruptedRunError(SweepError):
    """A run that a signal stopped."""

    exit_code = 130


def _short(value: object, limit: int = 60) -> str:
    text = repr(value)
    return text if len(text) <= limit else text[: limit - 3] + "..."
