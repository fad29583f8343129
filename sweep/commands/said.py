"""Output of commands: lines for people, or one JSON object for programs."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping
from typing import Annotated, Any

import typer

Json = Annotated[bool, typer.Option("--json", help="Say one JSON object on stdout, and everything else on stderr.")]
Quiet = Annotated[bool, typer.Option("--quiet", help="Say nothing but faults, and with --json the object.")]


def say(lines: Iterable[str], facts: Mapping[str, Any], *, as_json: bool = False, quiet: bool = False) -> None:
    """Print the lines of a command, and with `as_json` its facts on stdout; NaN and infinity become null."""
    say_to(lines, as_json=as_json, quiet=quiet)
    if as_json:
        typer.echo(json.dumps(_plain(facts), allow_nan=False, ensure_ascii=False))


def say_to(lines: Iterable[str], *, as_json: bool, quiet: bool) -> None:
    """Print lines where they belong: stdout, or stderr where that is kept for an object."""
    if not quiet:
        for line in lines:
            typer.echo(line, err=as_json)


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _plain(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(inner) for inner in value]
    if isinstance(value, bool | int | str) or value is None:
        return value
    if hasattr(value, "tolist"):  # of NumPy
        return _plain(value.tolist())
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return str(value)
