"""The command line: every file in `verbs` is a command."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import cache
from typing import Annotated, Any

import typer

from ..base.errors import EXIT_CODES
from ..base.found import files_in
from . import verbs
from .endings import ends_in_lines
from .panels import PANELS

app = typer.Typer(
    name="sweep",
    help="Sweeps and design-space exploration for color filter arrays that must tell traffic light colors apart.",
    epilog="Exit codes: " + "; ".join(f"{code} {meaning}" for code, meaning in EXIT_CODES.items()) + ".",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)


def _version(asked: bool) -> None:
    if asked:
        from importlib.metadata import version  # noqa: PLC0415  (seldom asked for)

        typer.echo(f"sweep {version('cfa-sweep')}")
        raise typer.Exit


_Version = Annotated[
    bool, typer.Option("--version", callback=_version, is_eager=True, help="Say the version, and end.")
]


@app.callback()
def _whole(context: typer.Context, _: _Version = False) -> None:
    context.obj = time.monotonic()  # when the command began, for those that say what they took


def _add_verbs() -> None:
    for module in sorted(files_in(verbs), key=lambda module: PANELS.index(module.PANEL)):
        function = module.__name__.rpartition(".")[2]
        app.command(function.rstrip("_"), rich_help_panel=module.PANEL)(getattr(module, function))


_add_verbs()


@cache
def _parser() -> Callable[..., Any]:
    """What reads the arguments, made once in a process that gives several commands."""
    return typer.main.get_command(app)


def main() -> None:
    """Run the command; what goes wrong is one line each on stderr and an exit code, 2 for a fault of the input."""
    ends_in_lines(lambda: _parser()(prog_name="sweep", standalone_mode=False))
