"""Make the schema of studies."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..panels import OF_STUDIES

PANEL = OF_STUDIES


def schema(
    output: Annotated[Path | None, typer.Option(help="File to write.", show_default="the terminal")] = None,
) -> None:
    """Make the JSON Schema of study files, with which editors complete and check them."""
    from ...study.editors import schema_text
    from ..schema import write_schema

    if output is None:
        typer.echo(schema_text(), nl=False)
        return
    write_schema(output)
    typer.echo(f"Schema: {output}. A study beside it names it in its first line:")
    typer.echo(f"# yaml-language-server: $schema={output.name}")
