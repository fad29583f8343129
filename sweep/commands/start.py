"""The first moments of the command, before there is anything to say: Ctrl-C ends them without a word."""

from __future__ import annotations

import os
import signal
import sys

from ..base.garbage import collect_rarely


def start() -> None:
    """Load the command, run it, and leave.

    After a command that went well the process ends at once: to take itself and its idle workers apart would take the
    interpreter seconds, for which a user waits. Everything is said and written by then. On Linux workers end with it.
    """
    usual = signal.getsignal(signal.SIGINT) is signal.default_int_handler  # not where the caller had it ignored
    if usual:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    collect_rarely()
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
