"""How often Python looks for garbage, in processes of our own."""

from __future__ import annotations

import gc

_BETWEEN_COLLECTIONS = 100_000
"""New objects until garbage is looked for. Modules make many that stay: at Python's 700 that is a tenth of what a short
command takes, and of what a worker does."""


def collect_rarely() -> None:
    """Look for garbage in this process from now on when there may be much."""
    gc.set_threshold(_BETWEEN_COLLECTIONS, *gc.get_threshold()[1:])
