"""Commands in processes of their own that are copies of one with everything loaded, since to load it takes longer than many do.

Each has its own session, signals, streams, folder and environment, and begins and ends by the door that users take.
"""

from __future__ import annotations

import atexit
import os
import signal
import subprocess
import sys
import threading
from contextlib import chdir
from multiprocessing import forkserver, get_context
from pathlib import Path

_CONTEXT = get_context("forkserver")
_CONTEXT.set_forkserver_preload(["tests.loaded"])


def _command(
    arguments: list[str], streams: tuple[str, str], folder: str, environment: dict[str, str], drawn: bool
) -> None:
    """In the process: the command, whose standard output and error go to files; its reports have pictures if `drawn`."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # until it is begun, a stop ends it without a word, as `start` has it
    os.setsid()
    for number, name in enumerate(streams, 1):
        os.dup2(os.open(name, os.O_WRONLY | os.O_TRUNC), number)
    os.chdir(folder)
    os.environ.clear()
    os.environ.update(environment)
    sys.argv = ["sweep", *arguments]
    from sweep.cli.start import start
    from sweep.report import page

    if not drawn:
        page.svg = lambda *_: ""
        page.pictures_of = lambda *_: {}
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        start()
    except SystemExit as end:  # as the interpreter ends: `multiprocessing` would wait for workers before they are told
        threading._shutdown()
        atexit._run_exitfuncs()
        os._exit(end.code)


class Warm:
    """A command that runs, as `subprocess.Popen` has it; what it says goes to the files `told` and `said`.

    `environment`: what it has more, or else, than this process.
    """

    def __init__(
        self, *arguments: object, said: Path, told: Path = Path(os.devnull), drawn: bool = False, **environment: str
    ) -> None:
        with chdir(Path(__file__).parent.parent):  # where the first process finds what it is to load
            forkserver.ensure_running()
        said.write_bytes(b"")
        streams, given = (str(told), str(said)), {**os.environ, **environment}
        self._process = _CONTEXT.Process(
            target=_command, args=([*map(str, arguments)], streams, str(Path.cwd()), given, drawn)
        )
        self._process.start()
        assert self._process.pid is not None
        self.pid = self._process.pid

    def poll(self) -> int | None:
        """Its exit code, negative the signal that ended it; None while it runs."""
        return self._process.exitcode

    def wait(self, timeout: float) -> int:
        """Its exit code, once it has ended; raises TimeoutExpired after `timeout` seconds."""
        self._process.join(timeout)
        code = self.poll()
        if code is None:
            raise subprocess.TimeoutExpired("sweep", timeout)
        return code
