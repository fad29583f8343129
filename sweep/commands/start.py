"""The first moments of the command, before there is anything to say: Ctrl-C ends them without a word."""

from __future__ import annotations

import gc
import os
import signal
import sys

_BETWEEN_COLLECTIONS = 100_000
"""New objects until garbage is looked for. Modules make many that stay: at Python's 700 that is a tenth of what a short
command takes."""


def start() -> None:
    """Load the command, run it, and leave.

    After a command that went well the process ends at once: to take itself and its idle workers apart would take the
    interpreter seconds, for which a user waits. Everything is said and written by then. On Linux workers end with it.
    """
    usual = signal.getsignal(signal.SIGINT) is signal.default_int_handler  # not where the caller had it ignored
    if usual:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    gc.set_threshold(_BETWEEN_COLLECTIONS, *gc.get_threshold()[1:])
    from .app import main as command  # noqa: PLC0415  (it takes long enough for a Ctrl-C)

    if usual:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        command()
    except SystemExit as end:
        if end.code == 0 and sys.platform == "linux":
            os._exit(0)
        if usual:
            signal.signal(signal.SIGINT, signal.SIG_DFL)
        raise
