"""Commands of studies."""

from __future__ import annotations

import math
import time
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ...base.errors import InterruptedRunError, StudyError, SweepError
from ..endings import print_issues
from ..options import (
    OF_STUDIES,
    AllowCode,
    Changes,
    DataFolder,
    Outputs,
    StudyPath,
    StudyPaths,
    changes_of,
    quantity_of,
)
from ..output import Json, Quiet, print_result

if TYPE_CHECKING:
    from ...study import SensorAndLights

PANEL = OF_STUDIES


def check(study: StudyPath, data: DataFolder = None, changes: Changes = None, allow_code: AllowCode = False) -> None:
    """Check a study file and count its designs, without running it."""
    from ...study import load_study, sensor_studies_in
    from ...study.goals import refuse_unreachable

    changed = changes_of(changes)
    several = sensor_studies_in(study, changed)
    members: tuple[SensorAndLights | None, ...] = (None,) if several is None else several.members
    for member in members:
        loaded = load_study(study, data, changes=changed, allow_code=allow_code, member=member)
        which = "" if member is None else f"{member.name}: "
        refuse_unreachable(loaded)
        typer.echo(f"{study}: {which}{loaded.n_designs:,} designs on {', '.join(loaded.mosaics)}; nothing wrong found.")
        for warning in loaded.warnings:
            typer.echo(f"Note: {warning}.")


def list_(
    folder: Annotated[
        str, typer.Argument(help="Folder of the studies; `data` lists the spectra of the package instead.")
    ] = "studies",
    data: DataFolder = None,
    output: Outputs = Path("outputs"),
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """List the studies of a folder: question, number of designs, and whether they have been run.

    `sweep list data` lists the spectra that the package ships; a folder of that name is `./data`.
    """
    from ..listing import data_facts, data_lines, list_facts, list_lines, studies_of

    if folder == "data":
        print_result(data_lines(), data_facts(), as_json=as_json, quiet=quiet)
    else:
        studies = studies_of(Path(folder), output, data)
        print_result(list_lines(Path(folder), studies), list_facts(studies), as_json=as_json, quiet=quiet)


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
    quantity: Annotated[
        list[str] | None, typer.Option(help="Unit of the curves' or the lights' numbers, where heads do not tell it.")
    ] = None,
    folder: Annotated[Path, typer.Option(help="Folder of the studies.")] = Path("studies"),
) -> None:
    """Write a commented study that runs as it is, for the built-in curves or for files of your own."""
    from ..new import new_study

    for line in new_study(name, folder, qe or [], lights or [], [quantity_of(word) for word in quantity or ()]):
        typer.echo(line)


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
    from ...report.scenes import plan_facts, plan_lines
    from ...study import load_study

    if tolerance is not None and not 0 < tolerance < math.inf:
        raise StudyError(f"--tolerance {tolerance:g}: must be above 0 DN, and finite")
    loaded = load_study(study, data, changes=changes_of(changes), allow_code=allow_code)
    planned = loaded.with_plans(tolerance)
    notes = [f"Note: {warning}." for warning in loaded.warnings]
    print_result([*notes, *plan_lines(planned)], plan_facts(planned), as_json=as_json, quiet=quiet)


def run(
    context: typer.Context,
    studies: StudyPaths,
    data: DataFolder = None,
    output: Outputs = Path("outputs"),
    jobs: Annotated[int | None, typer.Option(min=1, help="Workers.", show_default="all cores")] = None,
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
    from ...run import RunOptions
    from ...study import load_study, sensor_studies_in
    from ..run import SensorsOptions, changed_name, run_one, run_sensors

    changed = changes_of(changes)
    with_options = partial(
        run_one,
        data=data,
        output=output,
        jobs=jobs,
        backend=backend,
        scheduler=scheduler,
        dry_run=dry_run,
        options=RunOptions(fail_fast, retry_failed),
        changes=changed,
        allow_code=allow_code,
        opens=opens,
        as_json=as_json,
        quiet=quiet,
    )
    began_s, code = context.find_root().obj, 0
    runs: list[dict[str, Any]] = []
    for path in studies:
        if len(studies) > 1 and not quiet:
            typer.echo(f"== {path} ==", err=as_json)
        try:
            several = sensor_studies_in(path, changed)
            run_it = partial(with_options, path, began_s=began_s)
            if several is None:
                facts = run_it()
            else:
                load = partial(load_study, path, data, changes=changed, allow_code=allow_code)
                how = SensorsOptions(output, changed_name(changed), jobs, dry_run, as_json, quiet, opens)
                facts = run_sensors(several, run_it, load, how)
        except InterruptedRunError:
            raise
        except SweepError as error:  # the others are run all the same
            print_issues(error.issues)
            code = max(code, error.exit_code)
            facts = {"faults": [str(issue) for issue in error.issues], "exit_code": error.exit_code}
        runs.append({"study": str(path), "exit_code": 0} | facts)
        began_s = time.monotonic()
    if as_json:
        print_result((), {"runs": runs}, as_json=True)
    return code
