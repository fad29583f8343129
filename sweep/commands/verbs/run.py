"""Run studies."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated, Any

import typer

from ...base.errors import InterruptedRunError, SweepError
from ..endings import say_lines
from ..options import AllowCode, Changes, DataFolder, Outputs, StudyPaths, changes_of
from ..panels import OF_STUDIES
from ..said import Json, Quiet, say

PANEL = OF_STUDIES


def run(
    context: typer.Context,
    studies: StudyPaths,
    data: DataFolder = None,
    output: Outputs = Path("outputs"),
    jobs: Annotated[int | None, typer.Option(min=1, help="Workers.", show_default="all cores")] = None,
    backend: Annotated[str, typer.Option(help="loky (processes), threading, or dask (a cluster).")] = "loky",
    scheduler: Annotated[str | None, typer.Option(help="Of Dask: tcp://HOST:PORT.", show_default=False)] = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Say what is to do, and do nothing.")] = False,
    fail_fast: Annotated[bool, typer.Option("--fail-fast", help="Stop at the first design that fails.")] = False,
    retry_failed: Annotated[bool, typer.Option("--retry-failed", help="Compute failed designs again.")] = False,
    changes: Changes = None,
    allow_code: AllowCode = False,
    opens: Annotated[bool, typer.Option("--open", help="Open the report in the browser.")] = False,
    as_json: Json = False,
    quiet: Quiet = False,
) -> int:
    """Run studies one after the other: results, figures and report go to OUTPUT/<study>. The same command continues an
    interrupted run, and makes again what is missing or damaged. Files that are not its own stay (SHA256SUMS lists those
    that are). Of several studies, one that cannot be run does not stop the others.
    """
    from ...run import RunOptions
    from ..runs import RunCommand, run_one

    options = RunOptions(fail_fast, retry_failed)
    command = RunCommand(
        data,
        output,
        jobs,
        backend,
        scheduler,
        dry_run,
        options,
        changes_of(changes),
        allow_code,
        opens,
        as_json,
        quiet,
    )
    began_s, code = context.find_root().obj, 0
    runs: list[dict[str, Any]] = []
    for path in studies:
        if len(studies) > 1 and not quiet:
            typer.echo(f"== {path} ==", err=as_json)
        try:
            facts = run_one(path, command, began_s)
        except InterruptedRunError:
            raise
        except SweepError as error:  # the others are run all the same
            say_lines(error.faults)
            code = max(code, error.exit_code)
            runs.append({"study": str(path), "exit_code": error.exit_code, "faults": [str(f) for f in error.faults]})
        else:
            runs.append({"study": str(path), "exit_code": 0, **facts})
        began_s = time.monotonic()
    if as_json:
        say((), {"runs": runs}, as_json=True)
    return code
