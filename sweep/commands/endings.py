"""How a command ends: whatever goes wrong with input, machine or user is a line on stderr and an exit code."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable, Iterable
from contextlib import suppress
from types import FrameType
from typing import Any, NoReturn

import typer

from ..base.errors import SweepError

_INTERRUPTED, _BROKEN_PIPE = 130, 141
"""Exit codes of a shell for a command that SIGINT or SIGPIPE ended."""
_UsageError = typer.BadParameter.__bases__[0]
"""Click's, wherever this version of typer has it."""


def ends_in_lines(command: Callable[[], object]) -> NoReturn:
    """Run a command and leave with its exit code: 0, what it returns or its error has, or 2.

    A fault of the program itself is raised on, with its traceback. SIGTERM ends a command as SIGINT does.
    """
    try:
        _prepare()
        found = command()
        if sys.stdout is not None:
            sys.stdout.flush()
        code = found if isinstance(found, int) else 0
        if code == _INTERRUPTED:
            say_lines(["interrupted"])
    except Exception as error:
        code = _said(error)
    except KeyboardInterrupt:
        say_lines(["interrupted"])
        code = _INTERRUPTED
    if code == _BROKEN_PIPE or not _flushed():
        _drop_output()
    for number in (signal.SIGTERM, signal.SIGINT):  # all is said: what stops it now, stops it without a word
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, signal.SIG_DFL)
    sys.exit(code)


def _prepare() -> None:
    """Settings of every command."""
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):  # a letter that the terminal does not know is no fault
            stream.reconfigure(errors="backslashreplace")
    signal.signal(signal.SIGTERM, _interrupt)


def _interrupt(_number: int, _frame: FrameType | None) -> None:
    raise KeyboardInterrupt


def _said(error: Exception) -> int:
    """Say what went wrong; the exit code. A fault of the program is raised again."""
    if isinstance(error, SweepError):
        say_lines(error.faults)
        return error.exit_code
    if isinstance(error, BrokenPipeError):
        return _BROKEN_PIPE
    if isinstance(error, typer.Abort):
        if isinstance(error.__cause__, EOFError):  # typer takes any for the end of what a user types
            raise error.__cause__
        say_lines(["interrupted"])
        return _INTERRUPTED
    text = _text(error)
    if text is None:
        raise error
    if text:
        say_lines([text])
    return 2


def _text(error: Exception) -> str | None:
    """What a user or an administrator can mend, on one line; None for a fault of the program."""
    text = None
    if isinstance(error, _UsageError):
        text = _usage(error)
    elif isinstance(error, MemoryError):
        text = "out of memory; fewer workers (--jobs) need less"
    elif isinstance(error, OSError):
        names = [os.fsdecode(name) for name in (error.filename, error.filename2) if isinstance(name, (str, bytes))]
        text = ": ".join([*names, error.strerror or str(error) or type(error).__name__])
    elif isinstance(error, UnicodeEncodeError) and error.reason == "surrogates not allowed":
        text = f"a name that is no UTF-8 (got {error.object!r})"
    elif isinstance(error, ImportError):
        text = f"a library cannot be loaded: {error}"
    elif isinstance(error, RuntimeError) and "thread" in str(error):  # of Python and of Arrow, where no more may start
        text = f"out of memory or threads: {error}"
    return text


def _usage(error: Any) -> str:
    """What is wrong with the command; nothing after the help that `sweep` alone asks for."""
    if type(error).__name__ == "NoArgsIsHelpError":
        error.show()
        return ""
    where = "" if error.ctx is None else f"; see {error.ctx.command_path} --help"
    return f"{error.format_message().rstrip('.')}{where}"


def say_lines(faults: Iterable[object]) -> None:
    """A line on stderr for each."""
    with suppress(OSError, ValueError):
        for fault in faults:
            typer.echo(f"sweep: {' '.join(str(fault).split())}", err=True)


def _flushed() -> bool:
    """Whether what was said has gone out."""
    try:
        for stream in (sys.stdout, sys.stderr):
            if stream is not None:
                stream.flush()
    except (OSError, ValueError):
        return False
    return True


def _drop_output() -> None:
    """Nobody takes what is still to be said; the interpreter would complain of it at its end."""
    with suppress(OSError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        for number in (1, 2):
            os.dup2(nowhere, number)
