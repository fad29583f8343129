"""Commands in this process: what they say, and how they end."""

from __future__ import annotations

import io
import subprocess
import sys
from contextlib import redirect_stderr, redirect_stdout
from unittest import mock

from sweep.cli.app import app, main

COMMANDS = {command.name for command in app.registered_commands}
UNDRAWN = """\
import signal
signal.signal(signal.SIGINT, signal.SIG_DFL)  # while it is loaded, a stop ends it without a word, as `start` has it
import sweep.report.panels
from sweep.cli.app import main
import sweep.report.page
sweep.report.page.svg = lambda *_: ""
sweep.report.page.pictures_of = lambda *_: {}
signal.signal(signal.SIGINT, signal.default_int_handler)
try:
    main()
finally:
    signal.signal(signal.SIGINT, signal.SIG_DFL)
"""
"""The command, whose reports have no pictures: for tests of processes, in which pictures would take half of the time."""


def commanded(*arguments: object) -> tuple[int, str, str]:
    """Exit code, standard output and standard error of a command."""
    out, err = io.StringIO(), io.StringIO()
    with mock.patch.object(sys, "argv", ["sweep", *map(str, arguments)]), redirect_stdout(out), redirect_stderr(err):
        try:
            main()
            code = 0
        except SystemExit as end:
            code = end.code if isinstance(end.code, int) else int(end.code is not None)
    return code, out.getvalue(), err.getvalue()


def sweep(*arguments: str) -> subprocess.CompletedProcess[str]:
    """The command in a process of its own."""
    return subprocess.run([sys.executable, "-m", "sweep", *arguments], capture_output=True, text=True, check=False)
