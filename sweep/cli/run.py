"""Run one study, or print the work that a run would do; draw the report of a finished run."""

from __future__ import annotations

import hashlib
import os
import re
import sys
import time
import webbrowser
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import typer

from .. import run as runner
from ..base.errors import ErrorBoundExceededError, InterruptedRunError, SweepError, ValidationIssue
from ..base.types import in_turn
from ..results.answers import Answers
from ..results.dataset import encoded_part, part_name
from ..results.folder import begin
from ..results.identity import run_facts, several_facts
from ..results.lock import locked
from ..results.manifest import Manifest
from ..results.tables import ALL_SENSORS, PROVENANCE, REPORT, json_of
from ..run.kept import CachedCalls
from ..run.runner import discard
from ..run.workers import backend_here, workers
from ..study import SensorAndLights, SensorStudies, Study, folder_name, load_study
from .output import ProgressDisplay, print_lines

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from ..base.types import Parallel

_JSON_KEYS = ("filters", "designs", "failed", "duration_s", "search", "check", "warnings")
"""Keys of provenance that `--json` repeats."""
_LONGEST_NAME = 120


def run_one(
    path: Path,
    *,
    data: Path | None,
    output: Path,
    jobs: int | None,
    backend: str | None,
    scheduler: str | None,
    dry_run: bool,
    options: runner.RunOptions,
    changes: dict[str, str],
    allow_code: bool,
    opens: bool,
    as_json: bool,
    quiet: bool,
    began_s: float,
    member: SensorAndLights | None = None,
) -> dict[str, Any]:
    """Run a study, or continue it, draw its report and print the result.

    `changes`: dotted key -> value instead of the file's; `began_s`: time at which the user began to wait, by the
    monotonic clock, s. Raises SweepError for a backend that is unknown, and as `run_study` does. Returns the same as
    plain values, for `--json`. The summary of a `member`, one of several sensors or light sets, is not printed.
    """

    def note(text: str) -> None:
        if not quiet:
            typer.echo(f"Note: {text}", err=True)

    if backend not in (None, *runner.BACKENDS):
        allowed = ", ".join(runner.BACKENDS)
        raise SweepError(ValidationIssue("unknown backend", key="--backend", value=backend, allowed=allowed))
    study = load_study(path, data, changes=changes, allow_code=allow_code, member=member)
    wanted = backend or runner.usual_backend(study)
    if (backend := backend_here(wanted)) != wanted:
        note("no shared memory for processes here (/dev/shm): threads compute the same rows.")
    folder, n_workers = output / folder_name(study.name), jobs or os.cpu_count() or 1
    if member is None:
        folder, other = runner.output_folder(folder / changed_name(changes), run_facts(study))
        if other is not None:
            note(f"{other}.")
    if dry_run:
        left = runner.remaining_work(study, folder)
        print_lines(runner.remaining_work_lines(left, folder), as_json=as_json, quiet=quiet)
        counts = {"designs": study.n_designs, "finished_designs": left.finished, "parts": left.chunks}
        return {"folder": str(folder), **counts, "searches": left.searches}
    with runner.stopped_by_signals(), workers(n_workers, backend, scheduler) as pool:
        with ProgressDisplay(quiet=quiet) as display:
            computed = runner.run_study(
                study, folder, n_workers, display.update, sys.argv, scheduler=scheduler, options=options, pool=pool
            )
        if not computed:
            note(f"{folder} holds this very study, finished; nothing was computed.")
        from .audit import audit_again  # noqa: PLC0415  (tables are loaded while workers compute)

        audit_again(folder, data)
        if quiet and member is None and not as_json:  # else it ends the summary
            typer.echo(folder)
        parallel, silent = pool if computed and backend == "loky" else in_turn, quiet or member is not None
        facts = finish(folder, began_s, repair=True, parallel=parallel, as_json=as_json, quiet=silent)
    if opens and member is None and not webbrowser.open((folder / REPORT).absolute().as_uri()):
        note(f"no browser was found for {folder / REPORT}.")
    return {"computed": bool(computed), **facts}


def changed_name(changes: Mapping[str, str]) -> str:
    """Return the folder, within that of a study, for a run with values of `--set`; empty without any."""
    stated = ",".join(f"{key}={value}" for key, value in sorted(changes.items()))
    name = re.sub(r"[^a-zA-Z0-9_.,=+-]", "_", stated)
    if len(name) > _LONGEST_NAME:
        name = f"{name[:_LONGEST_NAME]}-{hashlib.sha256(stated.encode()).hexdigest()[:8]}"
    return name


class SensorsOptions(NamedTuple):
    """Options of `sweep run` for a study of several sensors; `changed`: see `changed_name`."""

    output: Path
    changed: str
    jobs: int | None
    dry_run: bool
    as_json: bool
    quiet: bool
    opens: bool


def run_sensors(
    several: SensorStudies, run: Callable[..., dict[str, Any]], load: Callable[..., Study], options: SensorsOptions
) -> dict[str, Any]:
    """Run a study for each of its sensors and light sets, and compare them.

    Raises SweepError as `run_one`, for the first member that cannot be run, after all others. `run` runs a `member`
    into the folder `output`, `load` loads its study.
    """
    began_s, quiet = time.monotonic(), options.quiet
    studies = {member: load(member=member) for member in several.members}  # mistakes before any work
    known = several_facts(studies)
    folder, other = runner.output_folder(options.output / folder_name(several.name) / options.changed, known)
    if other is not None and not quiet:
        typer.echo(f"Note: {other}.", err=True)
    facts_of, failed = dict[SensorAndLights, dict[str, Any]](), list[SweepError]()
    with runner.stopped_by_signals(), nullcontext() if options.dry_run else locked(folder):
        manifest = Manifest(folder) if options.dry_run else begin(folder, known)
        for member in several.members:
            if not quiet:
                typer.echo(f"-- {member.name} --", err=True)
            try:
                facts_of[member] = run(member=member, output=folder)
            except InterruptedRunError:
                raise
            except SweepError as error:  # the others are run all the same
                failed.append(error)
        if not (facts_of or options.dry_run):
            discard(manifest)
        elif not options.dry_run:
            computed = any(facts["computed"] for facts in facts_of.values())
            lines = _join(manifest, studies, facts_of, options, computed=computed, began_s=began_s)
            print_lines(lines if not quiet else lines[-1:], as_json=options.as_json, quiet=quiet and options.as_json)
    if options.opens and facts_of and not options.dry_run:
        webbrowser.open((folder / REPORT).absolute().as_uri())
    if failed:
        raise failed[0]
    return {"folder": str(folder), "runs": [*facts_of.values()]}


def _join(
    manifest: Manifest,
    studies: Mapping[SensorAndLights, Study],
    facts_of: Mapping[SensorAndLights, Mapping[str, Any]],
    options: SensorsOptions,
    *,
    computed: bool,
    began_s: float,
) -> list[str]:
    """Write what several sensors have in common, where it is missing or damaged; return the answer."""
    from ..report.sensors import SensorRun, report_sensors, rows_of_all  # noqa: PLC0415  (while workers compute)
    from ..run.all_sensors import all_sensors_table  # noqa: PLC0415  (few studies have several sensors)

    runs = [SensorRun(member, Path(run_facts["folder"])) for member, run_facts in facts_of.items()]
    wrong = manifest.wrong([PROVENANCE, *manifest.files.keys() - {REPORT}])
    if computed or wrong:
        manifest.remove([PROVENANCE, *manifest.rows()])
        for at, table in enumerate(rows_of_all(runs)):
            manifest.write({part_name(at): encoded_part(table, "")})
        if {PROVENANCE, ALL_SENSORS} & wrong.keys():
            manifest.remove([ALL_SENSORS])
            answers = Answers(manifest.folder)
            with ProgressDisplay(quiet=options.quiet) as display, workers(options.jobs or os.cpu_count() or 1) as pool:
                cached_calls = CachedCalls(pool, answers, f"{manifest.fingerprint} all sensors")
                table = all_sensors_table([*studies.items()], cached_calls, display.update)
            if table is not None:
                manifest.write_table(ALL_SENSORS, table)
            answers.remove()
        facts = {
            "fingerprint": manifest.fingerprint,
            "runs": manifest.facts["runs"],
            "command": sys.argv,
            "designs": sum(run_facts["designs"] for run_facts in facts_of.values()),
            "failed": sum(run_facts["failed"] for run_facts in facts_of.values()),
            "duration_s": round(time.monotonic() - began_s, 3),
        }
        manifest.write({PROVENANCE: json_of(facts).encode("utf-8")})
    return report_sensors(manifest, runs)


def finish(
    folder: Path,
    began_s: float,
    *,
    repair: bool = False,
    parallel: Parallel = in_turn,
    as_json: bool = False,
    quiet: bool = False,
) -> dict[str, Any]:
    """Draw figures and report of a finished run, and print its summary.

    Raises ErrorBoundExceededError if the run's own check failed.
    """
    from ..report import make_report, read_output, summary_lines  # noqa: PLC0415  (loaded while workers compute)

    result = read_output(folder)
    make_report(result, repair=repair, parallel=parallel)
    print_lines(summary_lines(result, time.monotonic() - began_s), as_json=as_json, quiet=quiet)
    check = result.provenance.check
    if check is not None and not check.passed:
        raise ErrorBoundExceededError([ValidationIssue(check.sentence.removesuffix("."), key=check.scenario)])
    facts = result.provenance.model_dump(mode="json")
    return {"folder": str(folder), **{key: facts[key] for key in _JSON_KEYS}}
