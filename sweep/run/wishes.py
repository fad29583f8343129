"""How a run goes about failing designs."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Wishes:
    """How a run goes about failing designs.

    `fail_fast`: stop at the first one; `retry_failed`: compute the chunks again in which an earlier run had some.
    """

    fail_fast: bool = False
    retry_failed: bool = False


NONE = Wishes()
"""Failing designs are rows like others."""
