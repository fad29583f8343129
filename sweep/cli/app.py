"""The command line: every public function of a file in `commands`, or a `commands.py` of a feature, is a command."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import cache
from importlib.metadata import version
from inspect import isfunction
from typing import Annotated, Any

import typer

from ..base.errors import EXIT_CODES
from ..base.modules import files_in
from ..features import modules
from . import commands
from .endings import ends_in_lines
from .options import PANELS

app = typer.Typer(
    name="sweep",
    help="Sweeps and design-space exploration for color filter arrays that must separate traffic light colors.",
    epilog="Exit codes: " + "; ".join(f"{code} {meaning}" for code, meaning in EXIT_CODES.items()) + ".",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _version(asked: bool) -> None:
    if asked:
        typer.echo(f"sweep {version('cfa-sweep')}")
        raise typer.Exit


@app.callback()
def _start(
    context: typer.Context,
    _: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Say the version, and end.")
    ] = False,
) -> None:
    context.obj = time.monotonic()  # commands say how long they took


for _module in sorted([*files_in(commands), *modules("commands")], key=lambda module: PANELS.index(module.PANEL)):
    for _name, _function in vars(_module).items():
        if isfunction(_function) and _function.__module__ == _module.__name__ and not _name.startswith("_"):
            app.command(_name.rstrip("_").replace("_", "-"), rich_help_panel=_module.PANEL)(_function)


@cache
def _parser() -> Callable[..., Any]:
    return typer.main.get_command(app)


def main() -> None:
    """Run the command; each error is one line on stderr, and the exit code is 2 for invalid input."""
    ends_in_lines(lambda: _parser()(prog_name="sweep", standalone_mode=False))
