"""Commands of the tool itself."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..options import OF_TOOL

PANEL = OF_TOOL


def schema(
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="File to write.", show_default="the terminal")
    ] = None,
) -> None:
    """Make the JSON Schema of study files, with which editors complete and check them."""
    from ...api.new import write_schema
    from ...study.editors import schema_text

    if output is None:
        typer.echo(schema_text(), nl=False)
        return
    write_schema(output)
    typer.echo(f"Schema: {output}. A study beside it names it in its first line:")
    typer.echo(f"# yaml-language-server: $schema={output.name}")
