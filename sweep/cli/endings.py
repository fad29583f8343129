"""Ends of commands: whatever goes wrong with input, machine or user is a line on stderr and an exit code."""

from __future__ import annotations

import errno
import os
import signal
import sys
import tempfile
from collections.abc import Callable, Iterable
from contextlib import suppress
from typing import Any, NoReturn

import typer

from ..base.errors import SweepError

_INTERRUPTED, _BROKEN_PIPE = 130, 141
"""Exit codes of a shell for a command that SIGINT or SIGPIPE ended."""
_interrupts: list[int] = []
"""Signals that came."""
_UsageError: Any = typer.BadParameter.__bases__[0]
"""Click's, wherever this version of typer has it."""


def ends_in_lines(command: Callable[[], object]) -> NoReturn:
    """Run a command and exit with its code.

    SIGTERM and SIGHUP end a command as SIGINT does. Errors of the program itself keep their traceback.

    Raises SystemExit: with the result of the command, the code of its error, or 2.
    """
    try:
        for stream in (sys.stdout, sys.stderr):
            if hasattr(stream, "reconfigure"):  # a letter that the terminal does not know is no issue
                stream.reconfigure(errors="backslashreplace")
        _take_signals()
        result = command()
        _flush()
        code = result if isinstance(result, int) else 0
        if code == _INTERRUPTED:
            print_issues(["interrupted"])
    except Exception as error:
        if _interrupts:  # a library that was loading made another error of it
            print_issues(["interrupted"])
        code = _INTERRUPTED if _interrupts else _exit_code(error)
    except KeyboardInterrupt:
        print_issues(["interrupted"])
        code = _INTERRUPTED
    except SystemExit:
        if type(sys.stdout).__name__ != "PacifyFlushWrapper":  # click's, where no one reads what is printed
            raise
        code = _BROKEN_PIPE
    try:
        _flush()
    except (OSError, ValueError):
        code = code or _BROKEN_PIPE
        with suppress(OSError):  # no one reads the rest; the interpreter would complain of it at its end
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, 1)
            os.dup2(nowhere, 2)
    for number in (signal.SIGTERM, signal.SIGINT):  # a signal from now on ends the process without a word
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, signal.SIG_DFL)
    sys.exit(code)


def _take_signals() -> None:
    for number in (signal.SIGINT, signal.SIGTERM, getattr(signal, "SIGHUP", signal.SIGTERM)):
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, _interrupt)


def _interrupt(number: int, *_: object) -> None:
    _interrupts.append(number)
    raise KeyboardInterrupt


def _flush() -> None:
    for stream in (sys.stdout, sys.stderr):
        if stream is not None:
            stream.flush()


def print_issues(issues: Iterable[object]) -> None:
    """Print issues on stderr, one per line."""
    with suppress(OSError, ValueError):
        for issue in issues:
            typer.echo(f"sweep: {' '.join(str(issue).split())}", err=True)


def _exit_code(error: Exception) -> int:
    """Print the error and return the exit code; re-raises errors of the program."""
    if isinstance(error, SweepError):
        print_issues(error.issues)
        return error.exit_code
    if isinstance(error, BrokenPipeError):
        return _BROKEN_PIPE
    if isinstance(error, typer.Abort):
        if isinstance(error.__cause__, EOFError):  # typer takes any for the end of what a user types
            raise error.__cause__
        print_issues(["interrupted"])
        return _INTERRUPTED
    if type(error).__name__ == "NoArgsIsHelpError":  # `sweep` alone asks for help
        error.show()  # type: ignore[attr-defined]
        return 2
    text = _text(error)
    if text is None:
        raise error
    print_issues([text])
    return 2


def _text(error: Any) -> str | None:
    """Describe an error that a user or an administrator can repair, on one line; None for an error of the program."""
    text = None
    if isinstance(error, _UsageError):
        where = "" if error.ctx is None else f"; see {error.ctx.command_path} --help"
        text = f"{error.format_message().rstrip('.')}{where}"
    elif isinstance(error, MemoryError):
        text = "out of memory; fewer workers (--jobs) need less"
    elif isinstance(error, OSError):
        names = [os.fsdecode(name) for name in (error.filename, error.filename2) if isinstance(name, (str, bytes))]
        if error.errno == errno.ENOSPC and not names:
            names = [f"the output, {tempfile.gettempdir()} or /dev/shm"]
        text = ": ".join([*names, error.strerror or str(error) or type(error).__name__])
    elif isinstance(error, UnicodeEncodeError) and error.reason == "surrogates not allowed":
        text = f"file name is not UTF-8 (got {error.object!r})"
    elif isinstance(error, ImportError):
        text = f"a library cannot be loaded: {error}"
    elif isinstance(error, RuntimeError) and "thread" in str(error):  # of Python and of Arrow, where no more may start
        text = f"out of memory or threads: {error}"
    return text
