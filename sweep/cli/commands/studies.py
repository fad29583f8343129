"""Commands of studies."""

from __future__ import annotations

import time
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from ...base.errors import InterruptedRunError, SweepError
from ..endings import print_issues
from ..options import (
    OF_STUDIES,
    AllowCode,
    Changes,
    DataFolder,
    Force,
    Jobs,
    Outputs,
    Quantities,
    StudyPath,
    StudyPaths,
    changes_of,
)
from ..output import Json, ProgressDisplay, Quiet, print_answer, print_json, print_lines

PANEL = OF_STUDIES


def check(
    studies: StudyPaths,
    data: DataFolder = None,
    changes: Changes = None,
    allow_code: AllowCode = False,
    as_json: Json = False,
    quiet: Quiet = False,
) -> int:
    """Check study files and count their designs, without running them; what is wrong with one hides no other one."""
    from ...api.check import check as checked

    changed, code = changes_of(changes), 0
    found: list[Mapping[str, Any]] = []
    for study in studies:
        try:
            answer = checked(study, data, changes=changed, allow_code=allow_code)
        except SweepError as error:
            print_issues(error.issues)
            code = max(code, error.exit_code)
            found.append({"file": str(study), "faults": [str(issue) for issue in error.issues]})
            continue
        print_lines(answer.lines, as_json=as_json, quiet=quiet)
        found.append(answer.facts)
    if as_json:
        print_json(found[0] if len(found) == 1 else {"files": found})
    return code


def list_(
    folder: Annotated[
        str | None,
        typer.Argument(
            help="Folder of the studies; `data` lists the spectra of the package instead.",
            show_default="studies, or those of the package",
        ),
    ] = None,
    data: DataFolder = None,
    output: Outputs = Path("outputs"),
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """List the studies of a folder: question, number of designs, and whether they have been run.

    `sweep list data` lists the spectra that the package ships; a folder of that name is `./data`.
    """
    from ...runs.listing import list_data, list_studies

    answer = list_data() if folder == "data" else list_studies(folder, data, output=output)
    print_answer(answer, as_json=as_json, quiet=quiet)


def new(
    name: Annotated[str, typer.Argument(help="Name of the study and of its file.", show_default=False)],
    qe: Annotated[
        list[Path] | None,
        typer.Option(help="A file or folder of QE curves of a sensor; may be repeated.", show_default=False),
    ] = None,
    lights: Annotated[
        list[Path] | None,
        typer.Option(help="A file or folder of spectra of lights; may be repeated.", show_default=False),
    ] = None,
    quantity: Quantities = None,
    folder: Annotated[Path, typer.Option(help="Folder of the studies.")] = Path("studies"),
    force: Force = False,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Write a commented study that runs as it is, for the built-in curves or for files of your own."""
    from ...api.new import new_study

    answer = new_study(name, qe=qe or (), lights=lights or (), quantity=quantity or (), folder=folder, force=force)
    print_answer(answer, as_json=as_json, quiet=quiet)


def plan(
    study: StudyPath,
    data: DataFolder = None,
    tolerance: Annotated[float | None, typer.Option(help="Tolerance of a CSD, DN.", show_default="the study's")] = None,
    changes: Changes = None,
    allow_code: AllowCode = False,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Say which effects each scene calls for, and why, without running it."""
    from ...api.check import plan as planned

    answer = planned(study, data, tolerance_dn=tolerance, changes=changes_of(changes), allow_code=allow_code)
    print_answer(answer, as_json=as_json, quiet=quiet)


def run(
    context: typer.Context,
    studies: StudyPaths,
    data: DataFolder = None,
    output: Outputs = Path("outputs"),
    jobs: Jobs = None,
    backend: Annotated[
        str | None,
        typer.Option(help="loky (processes), threading, or dask (a cluster); by default what is faster."),
    ] = None,
    scheduler: Annotated[str | None, typer.Option(help="Of Dask: tcp://HOST:PORT.", show_default=False)] = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Print the work to do, and do nothing.")] = False,
    fail_fast: Annotated[bool, typer.Option("--fail-fast", help="Stop at the first design that fails.")] = False,
    retry_failed: Annotated[bool, typer.Option("--retry-failed", help="Compute failed designs again.")] = False,
    changes: Changes = None,
    allow_code: AllowCode = False,
    opens: Annotated[bool, typer.Option("--open", help="Open the report in the browser.")] = False,
    as_json: Json = False,
    quiet: Quiet = False,
) -> int:
    """Run studies one after the other: results, figures and report go to OUTPUT/<study>, the last line of each.

    With --set they go to OUTPUT/<study>/KEY=VALUE.

    The same command continues an interrupted run, and replaces missing or damaged files.
    Other files in the folder are kept; manifest.json lists those of the run.
    If one study cannot be run, the others are.
    """
    from ...api.run import run as run_study

    changed, began_s, code = changes_of(changes), context.find_root().obj, 0
    runs: list[dict[str, Any]] = []
    for study in studies:
        if len(studies) > 1 and not quiet:
            typer.echo(f"== {study} ==", err=as_json)
        facts: dict[str, Any] = {}
        try:
            with ProgressDisplay(quiet=quiet) as display:
                answer = run_study(
                    study,
                    data,
                    output=output,
                    jobs=jobs,
                    backend=backend,
                    scheduler=scheduler,
                    dry_run=dry_run,
                    fail_fast=fail_fast,
                    retry_failed=retry_failed,
                    changes=changed,
                    allow_code=allow_code,
                    opens=opens,
                    progress=display.update,
                    note=display.note,
                    began_s=began_s,
                )
            facts |= answer.facts
            if quiet and not as_json and not dry_run:
                typer.echo(answer.facts["folder"])
            print_lines(answer.lines, as_json=as_json, quiet=quiet)
            if answer.problem is not None:
                raise answer.problem
        except InterruptedRunError:
            raise
        except SweepError as error:  # the others are run all the same
            print_issues(error.issues)
            code = max(code, error.exit_code)
            facts |= {"faults": [str(issue) for issue in error.issues], "exit_code": error.exit_code}
        runs.append({"study": str(study), "exit_code": 0} | facts)
        began_s = time.monotonic()
    if as_json:
        print_json({"runs": runs})
    return code
