"""Errors with data: problem, file and line, allowed values, and the nearest known name."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import islice

MOST_ISSUES = 50
"""So many are told; of more, how many there are."""
_MOST_KNOWN = 1000
_MOST_LETTERS = 100
_MOST_OF_A_PART = 2000
_MOST_SAID, _LEAST_LISTED, _FEW_NAMES = 160, 60, 5
"""Letters of a line beside its file, from which on names that are allowed are cut; so many of these stay."""


def nearest(name: object, known: Iterable[str]) -> str | None:
    """Return the known name that is most similar to `name`.

    Compares letters (difflib) and, for names of several words, words in any order. Only the first 1000 names, and those
    of up to 100 letters, are compared, which bounds the time.

    None if no name is similar.
    """
    if len(str(name)) > _MOST_LETTERS:
        return None
    folded = {str(c).casefold(): str(c) for c in islice(known, _MOST_KNOWN) if len(str(c)) <= _MOST_LETTERS}
    sought, ordered = str(name).casefold(), {_in_order(c): c for c in reversed(folded)}
    matches = difflib.get_close_matches(sought, list(folded), n=1, cutoff=0.5)
    if sought not in folded and (alike := difflib.get_close_matches(_in_order(sought), list(ordered), n=1, cutoff=0.9)):
        matches = [ordered[alike[0]]]
    return folded[matches[0]] if matches else None


def _in_order(name: str) -> str:
    """Sort the words of a name alphabetically."""
    return "_".join(sorted(name.split("_")))


@dataclass(frozen=True)
class ValidationIssue:
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
        parts = [_cut(part) for part in (place, self.key) if part]
        text = ": ".join([*parts, _cut(self.problem)])
        if self.value is not None:
            text += f" (got {_short(self.value)})"
        if self.nearest is not None:
            text += f"; did you mean {self.nearest!r}?"
        if self.allowed is not None:
            beside = len(text) - len(_cut(place))
            text += f"; allowed: {_listed(self.allowed, max(_LEAST_LISTED, _MOST_SAID - beside))}"
        # Nothing of a file steers a terminal, or fails to be written to it.
        return "".join(c if c.isprintable() else repr(c)[1:-1] for c in " ".join(text.split()))


class Fault(ValueError):  # noqa: N818  (it is collected more often than raised)
    """What is wrong with a study, where it is found: in a validator of a section, or in a check of several.

    `path`: keys from there to the place; `known`: names of which the nearest is told.
    """

    def __init__(
        self,
        path: Sequence[str | int],
        problem: str,
        value: object = None,
        allowed: str | None = None,
        nearest: str | None = None,
        *,
        known: Sequence[str] = (),
    ) -> None:
        super().__init__(problem)
        self.path, self.problem, self.value, self.allowed = tuple(path), problem, value, allowed
        self.nearest, self.known = nearest, known

    def under(self, *path: str | int) -> Fault:
        """Return the fault as seen from further up."""
        from_above = (*path, *self.path)
        return Fault(from_above, self.problem, self.value, self.allowed, self.nearest, known=self.known)


def unknown(
    path: Sequence[str | int], what: str, value: str, known: Iterable[str], others: Iterable[str] = ()
) -> Fault:
    """Return the fault of an unknown name; `others`: names that are near, but not allowed here."""
    known = list(known)
    return Fault(path, f"unknown {what}", value, ", ".join(known), known=[*known, *others])


def faults_of(path: Sequence[str | int], error: SweepError) -> list[Fault]:
    """Return the issues of an error as faults of a key."""
    return [
        Fault(
            path,
            f"{issue.file}: {issue.problem}" if issue.file else issue.problem,
            issue.value,
            issue.allowed,
            issue.nearest,
        )
        for issue in error.issues
    ]


EXIT_CODES = {
    0: "done",
    1: "files of a run are missing, damaged or not its own (`sweep status`)",
    2: "an error of the input, the machine or the command line: a line says which",
    3: "no design of the search can meet the constraints",
    4: "a design failed, with --fail-fast",
    5: "a result is above its own upper bound, or farther from the reference settings than the tolerance",
    130: "interrupted by Ctrl-C or SIGTERM; finished parts are kept",
    141: "the reader of the output has gone",
}
"""Meaning of the exit codes of all commands."""


class SweepError(Exception):
    """Base of all errors that a user can cause or repair. `exit_code` is the exit code of the command.

    `issues`: at most MOST_FAULTS of them; where there are more, the last one says how many.
    """

    exit_code = 2

    def __init__(self, issues: Sequence[ValidationIssue] | ValidationIssue | str) -> None:
        if isinstance(issues, str):
            issues = (ValidationIssue(issues),)
        elif isinstance(issues, ValidationIssue):
            issues = (issues,)
        self.issues = _capped(issues)
        super().__init__("\n".join(str(issue) for issue in self.issues))


class StudyError(SweepError):
    """A study file that cannot be run as it is written."""


class DataError(SweepError):
    """A curve or a file of curves that cannot be used."""


class OutputError(SweepError):
    """An output folder that cannot be written, read or is in use."""


class DamagedRunError(OutputError):
    """A run whose files are not as it wrote them."""

    exit_code = 1


class InfeasibleError(SweepError):
    """A study that no design meets."""

    exit_code = 3


class FailedDesignError(SweepError):
    """A design that could not be computed, in a run that is to stop at the first one."""

    exit_code = 4


class UpperBoundExceededError(SweepError):
    """A design exceeds a proven upper bound: an error of the program."""

    exit_code = 5


class ErrorBoundExceededError(SweepError):
    """An audit that found larger errors than were promised: an error of the program."""

    exit_code = 5


class InterruptedRunError(SweepError):
    """A run that a signal stopped."""

    exit_code = 130


def _capped(issues: Sequence[ValidationIssue]) -> tuple[ValidationIssue, ...]:
    if len(issues) <= MOST_ISSUES:
        return tuple(issues)
    more = len(issues) - MOST_ISSUES + 1
    return (*issues[: MOST_ISSUES - 1], ValidationIssue(f"and {more:,} more errors", issues[0].file))


def _listed(allowed: str, limit: int) -> str:
    """Return what is allowed, of many names as many as there is room for."""
    if len(allowed) <= limit or allowed.count(", ") < _FEW_NAMES:
        return _cut(allowed)
    return f"{allowed[: limit - 5].rpartition(', ')[0]}, ..."


def _short(value: object, limit: int = 60) -> str:
    return _cut(repr(value[: limit + 1] if isinstance(value, str) else value), limit)


def _cut(text: str, limit: int = _MOST_OF_A_PART) -> str:
    return text if len(text) <= limit else text[: limit - 3] + "..."
