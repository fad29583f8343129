"""The first moments of the command, before there is anything to say: Ctrl-C ends them without a word."""

from __future__ import annotations

import signal


def start() -> None:
    """Load the command, and run it."""
    usual = signal.getsignal(signal.SIGINT) is signal.default_int_handler  # not where the caller had it ignored
    if usual:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    from .app import main as command  # noqa: PLC0415  (it takes long enough for a Ctrl-C)

    if usual:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    command()
