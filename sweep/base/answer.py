"""What a command found, for people and for programs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any

from .errors import SweepError, ValidationIssue


@dataclass(frozen=True)
class Answer:
    """What a command found.

    Parameters
    ----------
    lines : sequence of str
        What it prints.
    facts : mapping
        The same as plain values: what it prints with ``--json``.
    problem : SweepError, optional
        Error with whose exit code the command ends.
    """

    lines: Sequence[str]
    facts: Mapping[str, Any]
    problem: SweepError | None = None

    def __str__(self) -> str:
        """Return the lines, and the problem in the last ones."""
        return "\n".join([*self.lines, *([] if self.problem is None else [str(self.problem)])])

    def __repr__(self) -> str:
        return str(self)

    def __fspath__(self) -> str:
        """Return the folder of what it tells of, so that it stands for it."""
        if "folder" not in self.facts:
            raise SweepError(ValidationIssue("this answer is of no folder", value=list(self.facts)))
        return str(self.facts["folder"])

    def _repr_html_(self) -> str:
        return f"<pre>{escape(str(self))}</pre>"
