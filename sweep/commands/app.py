"""The command line. Heavy imports wait until a command needs them."""

from __future__ import annotations

import math
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..errors import BrokenPromiseError, DataError, Fault, InterruptedRunError, StudyError, SweepError
from .completion import run_folders
from .endings import end_now, ends_in_lines
from .options import DataFolder, Outputs, Quantity, RunFolder, StudyPath

if TYPE_CHECKING:
    from ..report import Output

app = typer.Typer(
    name="sweep",
    help="Sweeps and design-space exploration for color filter arrays that must tell traffic light colors apart.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)


@app.command()
def run(
    study: StudyPath,
    data: DataFolder = None,
    output: Outputs = Path("outputs"),
    jobs: Annotated[int | None, typer.Option(min=1, help="Workers.", show_default="all cores")] = None,
    backend: Annotated[str, typer.Option(help="loky (processes), threading, or dask (a cluster).")] = "loky",
    scheduler: Annotated[str | None, typer.Option(help="Of Dask: tcp://HOST:PORT.", show_default=False)] = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Say what is to do and what it takes.")] = False,
    fail_fast: Annotated[bool, typer.Option("--fail-fast", help="Stop at the first design that fails.")] = False,
    retry_failed: Annotated[bool, typer.Option("--retry-failed", help="Compute failed designs again.")] = False,
) -> None:
    """Run a study: results, figures and report go to OUTPUT/<study>. The same command continues an interrupted run,
    and makes again what is missing or damaged. Files that are not its own stay (run.json lists those that are).
    """
    from .. import run as runner
    from ..study import folder_name, load_study
    from .audit import mend_audit
    from .progress import ProgressDisplay

    if backend not in runner.BACKENDS:
        allowed = ", ".join(runner.BACKENDS)
        raise SweepError(Fault("unknown backend", key="--backend", value=backend, allowed=allowed))
    loaded, workers = load_study(study, data), jobs or os.cpu_count() or 1
    folder, note = runner.output_folder(output / folder_name(loaded.name), loaded)
    if note is not None:
        typer.echo(f"Note: {note}.", err=True)
    if dry_run:
        with ProgressDisplay() as display:
            found = runner.estimate(loaded, folder, workers, display.update)
        for line in runner.estimate_lines(found, folder):
            typer.echo(line)
        return
    kind, wishes = runner.usable_backend(backend), runner.Wishes(fail_fast, retry_failed)
    if kind != backend:
        typer.echo(f"Note: no shared memory (/dev/shm) for worker processes; backend {kind}.", err=True)
    try:
        with runner.stop_on_signals(ends_process=True) as stop:
            with ProgressDisplay() as display:
                given = (loaded, folder, workers, display.update, sys.argv)
                made = runner.run_study(*given, backend=kind, scheduler=scheduler, wishes=wishes, stop=stop)
            if not made:
                typer.echo(f"Note: {folder} holds this very study, finished; nothing was computed.", err=True)
            mend_audit(folder, data)
            _finish(folder, mend=True)
    except InterruptedRunError as error:
        if kind == "threading":  # what its threads are at cannot be broken off
            end_now(error)
        raise


@app.command()
def status(
    folder: RunFolder,
    verify: Annotated[bool, typer.Option("--verify", help="Compare the digests of all its files.")] = False,
) -> None:
    """Say how far a run is, from another terminal; of a finished one, which of its files are missing or damaged."""
    from .status import status_lines

    for line in status_lines(folder, verify=verify):
        typer.echo(line)


@app.command()
def report(folder: RunFolder) -> None:
    """Draw figures and report of a finished run again."""
    _finish(folder)


@app.command()
def check(study: StudyPath, data: DataFolder = None) -> None:
    """Check a study file and count its designs, without running it."""
    from ..study import load_study

    loaded = load_study(study, data)
    typer.echo(f"{study}: {loaded.n_designs:,} designs on {', '.join(loaded.mosaics)}; nothing wrong found.")
    for warning in loaded.warnings:
        typer.echo(f"Note: {warning}.")


@app.command()
def plan(
    study: StudyPath,
    data: DataFolder = None,
    tolerance: Annotated[float | None, typer.Option(help="Tolerance of a CSD, DN.", show_default="the study's")] = None,
    explain: Annotated[bool, typer.Option("--explain", help="Show the alternatives that were rejected.")] = False,
) -> None:
    """Say which effects each scene calls for, and why, without running it."""
    from ..report.plans import plan_lines
    from ..run import with_plans
    from ..study import load_study
    from .progress import ProgressDisplay

    if tolerance is not None and not 0 < tolerance < math.inf:
        raise StudyError(f"--tolerance {tolerance:g}: must be above 0 DN, and finite")
    with ProgressDisplay() as display:
        planned = with_plans(load_study(study, data), os.cpu_count() or 1, display.update, tolerance)
    for line in plan_lines(planned, explain=explain):
        typer.echo(line)


@app.command()
def audit(folder: RunFolder, data: DataFolder = None) -> None:
    """Recompute the front and 1 % of a run's rows with every effect on: promised beside realized error.

    Exit code 5 says that an error is larger than promised.
    """
    from ..results.tables import AUDIT
    from .audit import audit_output
    from .progress import ProgressDisplay

    with ProgressDisplay() as display:
        found = audit_output(folder, data, display.update)
    for line in found.lines:
        typer.echo(line)
    typer.echo(f"Files: {folder}/: {AUDIT}.")
    if found.faults:
        raise BrokenPromiseError(found.faults)


@app.command()
def export(
    folder: RunFolder,
    design: Annotated[str, typer.Option(help="A design_id, a name (RYN_4Cy, RGGB), or best.", show_default=False)],
    data: Annotated[
        Path | None, typer.Option(help="Folder with the run's curve files, which are then read again and compared.")
    ] = None,
    to: Annotated[Path | None, typer.Option(help="Folder for the files.", show_default="FOLDER/export")] = None,
) -> None:
    """Write a filter of a finished run as CSV and as ISETCam color filters (.mat)."""
    from .export import export_design

    for line in export_design(folder, design, data, to):
        typer.echo(line)


@app.command()
def compare(
    folders: Annotated[
        list[Path],
        typer.Argument(help="Output folders of two or more studies.", show_default=False, autocompletion=run_folders),
    ],
    output: Annotated[
        Path | None, typer.Option(help="Folder for the comparison.", show_default="outputs/compare-A-B")
    ] = None,
) -> None:
    """Compare finished runs: what their studies ask, best designs, fronts, versions."""
    from ..report.compare import compare_runs

    for line in compare_runs(folders, output):
        typer.echo(line)


@app.command()
def accuracy(
    study: StudyPath,
    data: DataFolder = None,
    output: Outputs = Path("outputs"),
) -> None:
    """Measure what accuracy costs: tolerances from 100 to 0.001 DN and single settings, with error, time and work."""
    from ..study import folder_name, load_study
    from .accuracy.ladder import accuracy as measure
    from .progress import ProgressDisplay

    loaded = load_study(study, data)
    with ProgressDisplay() as display:
        folder = output / folder_name(loaded.name)
        lines = measure(loaded, lambda step_nm: load_study(study, data, step_nm), folder, display.update)
    for line in lines:
        typer.echo(line)


@app.command()
def calibrate(
    study: StudyPath,
    output: Annotated[Path, typer.Option(help="Folder for the result.")] = Path("outputs/calibration"),
    seed: Annotated[int, typer.Option(min=0)] = 1,
    starts: Annotated[int, typer.Option(min=1, help="Starting points of each fit.")] = 4,
    jobs: Annotated[int | None, typer.Option(min=1, help="Worker processes.", show_default="all cores")] = None,
) -> None:
    """Fit the built-in surrogate curves to the figures that STUDY publishes."""
    from ..study import load_study
    from .calibrate import calibrate as fit
    from .calibrate.output import write
    from .progress import ProgressDisplay

    loaded = load_study(study)
    geometry = set(loaded.geometry)
    printed = {r: dict(v) for rows in loaded.section.published.values() for r, v in rows.items() if r not in geometry}
    if not printed:
        raise StudyError(f"{study}: the study has no `published` figures to fit to")
    with ProgressDisplay() as display:
        found = fit(printed, seed, starts, jobs or os.cpu_count() or 1, display.update)
    for line in write(found, output):
        typer.echo(line)


@app.command()
def describe(
    file: Annotated[Path, typer.Argument(help="A file of curves, .csv or .mat.", show_default=False)],
    output: Annotated[Path, typer.Option(help="Folder for the picture.")] = Path("outputs/describe"),
    quantity: Annotated[
        Quantity | None, typer.Option(help="Of light spectra; without it, lights or QE is guessed.", show_default=False)
    ] = None,
) -> None:
    """Plot and check a file of curves: what it holds, what is wrong with it, which colors its lights have."""
    from .describe import describe as described

    found = described(file, output, quantity)
    for line in found.lines:
        typer.echo(line)
    if found.faults:
        raise DataError(found.faults)


@app.command()
def new(
    name: Annotated[str, typer.Argument(help="Name of the study and of its file.", show_default=False)],
    qe: Annotated[Path | None, typer.Option(help="QE curves of a sensor, .csv or .mat.", show_default=False)] = None,
    lights: Annotated[Path | None, typer.Option(help="Spectra of lights, .csv or .mat.", show_default=False)] = None,
    quantity: Annotated[Quantity, typer.Option(help="What the lights' numbers are.")] = "energy",
    folder: Annotated[Path, typer.Option(help="Folder of the studies.")] = Path("studies"),
) -> None:
    """Write a commented study that runs as it is, for the built-in curves or for files of your own."""
    from .new import new_study

    for line in new_study(name, folder, qe, lights, quantity):
        typer.echo(line)


@app.command("list")
def list_(
    folder: Annotated[Path, typer.Argument(help="Folder of the studies.")] = Path("studies"),
    data: DataFolder = None,
    output: Outputs = Path("outputs"),
) -> None:
    """List the studies of a folder: question, number of designs, and whether they have been run."""
    from .list_studies import list_lines

    for line in list_lines(folder, output, data):
        typer.echo(line)


@app.command()
def schema(
    output: Annotated[Path | None, typer.Option(help="File to write.", show_default="the terminal")] = None,
) -> None:
    """Make the JSON Schema of study files, with which editors complete and check them."""
    from ..study.editors import schema_text
    from .schema import write_schema

    if output is None:
        typer.echo(schema_text(), nl=False)
        return
    write_schema(output)
    typer.echo(f"Schema: {output}. A study beside it names it in its first line:")
    typer.echo(f"# yaml-language-server: $schema={output.name}")


def _finish(folder: Path, *, mend: bool = False) -> None:
    from ..report import make_report, read_output, summary_lines

    found: Output = read_output(folder)
    make_report(found, mend=mend)
    for line in summary_lines(found):
        typer.echo(line)


def main() -> None:
    """Run the command; what goes wrong is one line each on stderr and an exit code, 2 for a fault of the input."""
    ends_in_lines(lambda: app(prog_name="sweep", standalone_mode=False))
