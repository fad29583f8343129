"""The entry point of the command: an interrupt while modules are still loading ends it without a traceback."""

from __future__ import annotations

import signal
import sys


def start() -> None:
    """Load the command and run it."""
    try:
        if signal.getsignal(signal.SIGTERM) is signal.SIG_DFL:
            signal.signal(signal.SIGTERM, signal.default_int_handler)
        from .app import main  # noqa: PLC0415  (loading takes long enough for a Ctrl-C)
    except KeyboardInterrupt:
        sys.exit(130)
    main()
