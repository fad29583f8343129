"""Every command ends in lines: no traceback for what a user, a machine or a shell does."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from sweep.base.errors import InfeasibleError
from sweep.cli.endings import ends_in_lines

from ..cases import thinned
from ..commanded import commanded

COMMAND = [sys.executable, "-m", "sweep"]


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["run"], "Missing argument"),
        (["run", "x.yaml", "--jobs", "0"], "--jobs"),
        (["run", "x.yaml", "--job", "2"], "No such option"),
        (["chek", "x.yaml"], "No such command 'chek'"),
        (["plan", "a.yaml", "b"], "unexpected extra argument"),
        (["check", "nowhere.yaml"], "nowhere.yaml: cannot be read"),
        (["check", "stopband", "--data", "nowhere"], "nowhere"),
        (["check", "stopband", "--set", "seed"], "not KEY=VALUE"),
        (["check", "stopband", "--set", "study.name=x"], "--set study.name=x: `study` is no mapping"),
        (["check", "stopband", "--set", "cfas.7=RGGB"], "`cfas` has no such entry"),
        (["plan", "stopband", "--tolerance", "inf"], "tolerance"),
        (["report", "nowhere"], "nowhere"),
        (["audit", "nowhere"], "nowhere"),
    ],
)
def test_a_wrong_command_is_one_line(arguments: list[str], expected: str) -> None:
    code, out, said = commanded(*arguments)
    assert (code, out) == (2, "")
    assert said.startswith("sweep: "), said
    assert said.count("\n") == 1, said
    assert expected in said


def test_several_studies_are_checked_at_once_and_a_fault_hides_none(tmp_path: Path) -> None:
    bad = tmp_path / "bad.yaml"
    bad.write_text("study: bad\nsensor: ar0821\nlights: tl16\ncfas: [RGGB]\n")
    code, out, said = commanded("check", bad, "paper", "stopband")
    assert (code, out.count("nothing wrong found"), said.count("\n")) == (2, 2, 1)
    assert f"{bad}:2: sensor: unknown built-in sensor" in said
    first, *others = json.loads(commanded("check", bad, "paper", "--json")[1])["files"]
    assert [first["file"], len(first["faults"]), len(others)] == [str(bad), 1, 1]


EARLY = """
import os, signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell in the background has it ignored
class Finder:
    def find_spec(self, name, path, target=None):
        if name == "sweep.cli.app":
            os.kill(os.getpid(), signal.SIGINT)
sys.meta_path.insert(0, Finder())
from sweep.cli.start import start
start()
"""


def test_a_stop_while_the_command_is_loaded_ends_it_without_a_word() -> None:
    done = subprocess.run([sys.executable, "-c", EARLY], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "")


@pytest.mark.parametrize(
    ("error", "code", "expected"),
    [
        (MemoryError(), 2, "out of memory"),
        (OSError(28, "No space left on device", "/x/y"), 2, "/x/y: No space left on device"),
        (UnicodeEncodeError("utf-8", "a\udcff", 1, 2, "surrogates not allowed"), 2, "file name is not UTF-8"),
        (KeyboardInterrupt(), 130, "interrupted"),
        (InfeasibleError("out of\nreach"), 3, "out of reach"),
    ],
)
def test_machine_errors_are_one_line(
    error: BaseException, code: int, expected: str, capfd: pytest.CaptureFixture[str]
) -> None:
    def command() -> None:
        raise error

    with pytest.raises(SystemExit) as ended:
        ends_in_lines(command)
    assert ended.value.code == code
    text = capfd.readouterr().err
    assert text.startswith("sweep: ")
    assert text.count("\n") == 1
    assert expected in text


def test_the_end_of_a_file_is_no_interrupt(tmp_path: Path) -> None:
    """Whatever raises EOFError, such as unpickling: typer takes it for the end of what a user types."""
    program = """
import sweep.study
from sweep.cli.app import main
def ended(*_, **__):
    raise EOFError("Ran out of input")
sweep.study.sensor_studies_in = ended
main()
"""
    command = [sys.executable, "-c", program, "run", str(tmp_path / "x.yaml")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "interrupted" not in done.stderr
    assert "EOFError: Ran out of input" in done.stderr


@pytest.mark.slow
def test_an_output_without_room_is_one_line() -> None:
    with Path("/dev/full").open("w") as full:
        done = subprocess.run([*COMMAND, "schema"], stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr.endswith("/dev/shm: No space left on device\n")


@pytest.mark.parametrize("command", thinned(["schema", "plan stopband"]))
def test_a_pipe_that_is_closed_ends_as_by_its_signal(command: str) -> None:
    sweep = Path(sys.executable).with_name("sweep")
    with subprocess.Popen([sweep, *command.split()], stdout=subprocess.PIPE, stderr=subprocess.PIPE) as running:
        assert running.stdout is not None
        running.stdout.close()
        _, said = running.communicate(timeout=60)
    assert (running.returncode, said) == (141, b"")
