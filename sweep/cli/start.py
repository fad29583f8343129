"""The entry point of the command: an interrupt while modules are still loading ends it without a traceback."""

from __future__ import annotations

import sys


def start() -> None:
    """Load the command and run it."""
    try:
        from .app import main  # noqa: PLC0415  (loading takes long enough for a Ctrl-C)
    except KeyboardInterrupt:
        sys.exit(130)
    main()
