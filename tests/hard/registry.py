"""Numerically hard cases: an error, the oracle that it is measured against, and the largest error that is allowed.

The docstring of a case says its oracle and, after `Allowed:`, how the allowed error is derived. The oracle shares no
code with the package. Where the outcome is yes or no (refused, exactly zero, raised) the error is 0 or infinite.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mpmath as mp

EPS = 2.0**-52
"""Spacing of float64 at 1; one rounding errs by half of it, relative."""


@dataclass(frozen=True)
class Result:
    """The error of a case, and the largest error that is allowed."""

    error: float
    allowed: float

    @property
    def good(self) -> bool:
        """Whether the error is within the allowed one; NaN is not."""
        return self.error <= self.allowed


@dataclass(frozen=True)
class HardCase:
    """A case: its name, what it is a case of, oracle, derivation of the allowed error, whether it takes seconds."""

    name: str
    kind: str
    oracle: str
    why: str
    run: Callable[[], Result]
    slow: bool


CASES: list[HardCase] = []


def hard_case(name: str, *, slow: bool = False) -> Callable[[Callable[[], Result]], Callable[[], Result]]:
    """Register a function as a case; it runs with 50 digits in mpmath. `slow`: it takes seconds."""

    def register(run: Callable[[], Result]) -> Callable[[], Result]:
        oracle, _, why = " ".join((run.__doc__ or "").split()).partition(". Allowed: ")
        if not oracle or not why:
            raise TypeError(f"{name}: the docstring must name the oracle and derive the allowed error")
        kind = run.__module__.rpartition("cases_")[2]
        CASES.append(HardCase(name, kind, oracle, why.removesuffix("."), mp.workdps(50)(run), slow))
        return run

    return register


def relative(found: float, exact: Any) -> float:
    """Relative error; 0 only where both are 0."""
    if exact == 0:
        return 0.0 if found == 0 else math.inf
    return float(abs((type(exact)(found) - exact) / exact)) if math.isfinite(found) else math.inf


def outcome(good: bool) -> Result:
    """The result of a case whose outcome is yes or no."""
    return Result(0.0 if good else math.inf, 0.0)


def worst(results: Iterable[tuple[float, float]]) -> Result:
    """Of several (error, allowed) the one that comes nearest to failing, or fails most."""
    pairs = [Result(float(error), float(allowed)) for error, allowed in results]
    failed = [result for result in pairs if not result.good]
    return max(failed or pairs, key=lambda r: r.error / r.allowed if r.allowed else r.error)


def refused(call: Callable[[], Any], error: type[Exception], *words: str) -> bool:
    """Whether a call raises `error` with all the words in its text."""
    try:
        call()
    except error as raised:
        return all(word in str(raised) for word in words)
    return False


def write_table(path: Path, rows: list[dict[str, Any]]) -> None:
    """Write the table of all cases that ran as JSON."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(rows, indent=1) + "\n")
