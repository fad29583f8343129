"""Run a study, or several of one file, or say the work that a run would do; draw the report of a finished run."""

from __future__ import annotations

import hashlib
import os
import re
import sys
import time
import webbrowser
from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .. import runs as runner
from ..base.answer import Answer
from ..base.errors import (
    ErrorBoundExceededError,
    InfeasibleError,
    InterruptedRunError,
    OutputError,
    SweepError,
    ValidationIssue,
)
from ..base.types import Progress, in_turn, silent
from ..results.answers import Answers
from ..results.dataset import encoded_part, part_name
from ..results.folder import begin, run_folder
from ..results.identity import run_facts, several_facts
from ..results.lock import locked
from ..results.manifest import Manifest
from ..results.tables import ALL_SENSORS, MANIFEST, PROVENANCE, REPORT, RESULTS, json_of
from ..runs.kept import CachedCalls
from ..runs.runner import discard
from ..runs.workers import backend_here, workers
from ..study import SensorAndLights, SensorStudies, Study, folder_name, load_study, sensor_studies_in
from ..study.shipped import study_path
from .check import Changes

if TYPE_CHECKING:
    from ..base.types import Parallel

_JSON_KEYS = ("filters", "designs", "failed", "duration_s", "search", "check", "warnings")
"""Keys of provenance that an answer repeats."""
_LONGEST_NAME = 120


@dataclass(frozen=True)
class _How:
    """Arguments of `run`, and the time by the monotonic clock at which its user began to wait, s."""

    output: Path
    began_s: float
    data: Path | None = None
    jobs: int | None = None
    backend: str | None = None
    scheduler: str | None = None
    dry_run: bool = False
    options: runner.RunOptions = field(default_factory=runner.RunOptions)
    changes: Mapping[str, Any] = field(default_factory=dict)
    allow_code: bool = False
    progress: Progress = silent
    note: Callable[[str], object] = silent
    command: Sequence[str] = field(default_factory=lambda: sys.argv)

    def __post_init__(self) -> None:
        if self.jobs is not None and self.jobs < 1:
            raise SweepError(ValidationIssue("no number of workers", key="jobs", value=self.jobs, allowed="1 or more"))

    def load(self, path: Path, member: SensorAndLights | None = None) -> Study:
        """Load a study, one of a sensor and light set where it has several."""
        return load_study(path, self.data, changes=self.changes, allow_code=self.allow_code, member=member)


def run(
    study: Path | str,
    data: Path | str | None = None,
    *,
    output: Path | str = "outputs",
    jobs: int | None = None,
    backend: str | None = None,
    scheduler: str | None = None,
    dry_run: bool = False,
    fail_fast: bool = False,
    retry_failed: bool = False,
    changes: Changes = None,
    allow_code: bool = False,
    opens: bool = False,
    progress: Progress = silent,
    note: Callable[[str], object] = silent,
    began_s: float | None = None,
) -> Answer:
    """Run a study, or continue it: results, figures and report go to OUTPUT/<study>.

    Parameters
    ----------
    study, data, changes, allow_code
        As for `check`; with changes, results go to OUTPUT/<study>/KEY=VALUE.
    output : path-like
        Folder for the results of all studies.
    jobs : int, optional
        Workers; left out, one per core.
    backend : {'loky', 'threading', 'dask'}, optional
        Processes, threads, or a cluster; left out, what is faster.
    scheduler : str, optional
        Of Dask: tcp://HOST:PORT.
    dry_run : bool
        Say the work to do, and do nothing.
    fail_fast, retry_failed : bool
        Stop at the first design that fails; compute failed designs again.
    opens : bool
        Open the report in the browser.
    progress, note : callable, optional
        Called with a phase, how much of it is done, and how much there is; and with a remark while it runs.
    began_s : float, optional
        Time by the monotonic clock from which the summary counts; left out, now.

    Returns
    -------
    Answer
        Summary of the run; ``facts["folder"]`` is what `read_run` takes. A problem if a result is farther from the
        reference settings than the tolerance, or a run of several could not be made.

    Raises
    ------
    SweepError
        If the study cannot be run.
    """
    path = study_path(Path(study))
    if backend not in (None, *runner.BACKENDS):
        allowed = ", ".join(runner.BACKENDS)
        raise SweepError(ValidationIssue("unknown backend", key="--backend", value=backend, allowed=allowed))
    how = _How(
        data=None if data is None else Path(data),
        output=Path(output),
        jobs=jobs,
        backend=backend,
        scheduler=scheduler,
        dry_run=dry_run,
        options=runner.RunOptions(fail_fast, retry_failed),
        changes=changes or {},
        allow_code=allow_code,
        progress=progress,
        note=note,
        began_s=time.monotonic() if began_s is None else began_s,
    )
    several = sensor_studies_in(path, how.changes)
    answer = _run_one(how.load(path), how) if several is None else _run_sensors(path, several, how)
    page = Path(answer.facts["folder"], REPORT)
    if opens and page.is_file() and not webbrowser.open(page.absolute().as_uri()):
        note(f"no browser was found for {page}.")
    return answer


def show(folder: Path | str) -> Answer:
    """Open the report of a finished run in the browser.

    Parameters
    ----------
    folder : path-like
        Folder of a finished run.

    Returns
    -------
    Answer
        The page.

    Raises
    ------
    SweepError
        If there is no report, or no browser.
    """
    page = run_folder(folder) / REPORT
    if not page.is_file():
        raise OutputError(ValidationIssue("no report here", str(folder), allowed="the folder of a finished run"))
    if not webbrowser.open(page.absolute().as_uri()):
        raise SweepError(ValidationIssue("no browser was found", str(page)))
    return Answer([f"Opened: {page}"], {"page": str(page)})


def run_loaded(study: Study, output: Path, jobs: int | None) -> Answer:
    """Run a study that Python holds."""
    return _run_one(study, _How(output, time.monotonic(), jobs=jobs, command=("sweep", "from Python")))


def _run_one(study: Study, how: _How, member: SensorAndLights | None = None) -> Answer:
    """Run a study, which may be a member of several, and draw its report."""
    wanted = how.backend or runner.usual_backend(study)
    if (backend := backend_here(wanted)) != wanted:
        how.note("no shared memory for processes here (/dev/shm): threads compute the same rows.")
    folder, n_workers = how.output / folder_name(study.name), how.jobs or os.cpu_count() or 1
    if member is None:
        folder, other = runner.output_folder(folder / changed_name(how.changes), run_facts(study))
        if other is not None:
            how.note(f"{other}.")
    if how.dry_run:
        left = runner.remaining_work(study, folder, n_workers)
        return Answer([*runner.remaining_work_lines(left, folder)], {"folder": str(folder), **left.facts})
    if Manifest(folder).damaged:
        how.note(f"{folder / MANIFEST} was damaged, and is written again.")
    with runner.stopped_by_signals(), workers(n_workers, backend, how.scheduler) as pool:
        computed = runner.run_study(
            study, folder, n_workers, how.progress, how.command, scheduler=how.scheduler, options=how.options, pool=pool
        )
        for line in Manifest(folder).notes:
            how.note(line)
        if not computed:
            how.note(f"{folder} holds this very study, finished; nothing was computed.")
        parallel = pool if computed and backend == "loky" else in_turn
        answer = _finish(folder, how.began_s, repair=True, parallel=parallel)
    return replace(answer, facts={"computed": bool(computed), **answer.facts})


def changed_name(changes: Mapping[str, Any]) -> str:
    """Return the folder, within that of a study, for a run with changed keys; empty without any."""
    stated = ",".join(f"{key}={value}" for key, value in sorted(changes.items()))
    name = re.sub(r"[^a-zA-Z0-9_.,=+-]", "_", stated)
    if len(name) > _LONGEST_NAME:
        name = f"{name[:_LONGEST_NAME]}-{hashlib.sha256(stated.encode()).hexdigest()[:8]}"
    return name


def _run_sensors(path: Path, several: SensorStudies, how: _How) -> Answer:
    """Run a study for each of its sensors and light sets, and compare them.

    The problem of the first one that cannot be run is that of all, after all others.
    """
    began_s = time.monotonic()
    studies = {member: how.load(path, member) for member in several.members}  # mistakes before any work
    known = several_facts(studies)
    folder, other = runner.output_folder(how.output / folder_name(several.name) / changed_name(how.changes), known)
    if other is not None:
        how.note(f"{other}.")
    answers, failed, lines = dict[SensorAndLights, Answer](), list[SweepError](), list[str]()
    with runner.stopped_by_signals(), nullcontext() if how.dry_run else locked(folder):
        manifest = Manifest(folder) if how.dry_run else begin(folder, known)
        for member in several.members:
            how.note(f"-- {member.name} --")
            try:
                in_folder = replace(how, output=folder, began_s=time.monotonic())
                answers[member] = _run_one(studies[member], in_folder, member)
            except InterruptedRunError:
                raise
            except SweepError as error:  # the others are run all the same
                failed.append(error)
                continue
            if (problem := answers[member].problem) is not None:
                failed.append(problem)
        facts_of = {member: answer.facts for member, answer in answers.items()}
        if how.dry_run:
            lines = [f"{member.name}: {line}" for member, answer in answers.items() for line in answer.lines]
        elif not facts_of:
            discard(manifest)
        else:
            lines = _join(manifest, studies, facts_of, how, began_s=began_s)
    return Answer(lines, {"folder": str(folder), "runs": [*facts_of.values()]}, failed[0] if failed else None)


def _join(
    manifest: Manifest,
    studies: Mapping[SensorAndLights, Study],
    facts_of: Mapping[SensorAndLights, Mapping[str, Any]],
    how: _How,
    *,
    began_s: float,
) -> list[str]:
    """Write what several sensors have in common, where it is missing or damaged; return the answer."""
    from ..report.sensors import SensorRun, report_sensors, rows_of_all  # noqa: PLC0415  (while workers compute)
    from ..runs.all_sensors import all_sensors_table  # noqa: PLC0415  (few studies have several sensors)

    runs = [SensorRun(member, Path(run_facts["folder"])) for member, run_facts in facts_of.items()]
    wrong = manifest.wrong([PROVENANCE, *manifest.files.keys() - {REPORT}])
    if wrong or any(run_facts["computed"] for run_facts in facts_of.values()):
        manifest.remove([PROVENANCE, *(name for name in manifest.files if name.startswith(f"{RESULTS}/"))])
        for at, table in enumerate(rows_of_all(runs)):
            manifest.write({part_name(at): encoded_part(table, "")})
        if {PROVENANCE, ALL_SENSORS} & wrong.keys():
            manifest.remove([ALL_SENSORS])
            answers = Answers(manifest.folder)
            with workers(how.jobs or os.cpu_count() or 1) as pool:
                cached_calls = CachedCalls(pool, answers, f"{manifest.fingerprint} all sensors")
                table = all_sensors_table([*studies.items()], cached_calls, how.progress)
            if table is not None:
                manifest.write_table(ALL_SENSORS, table)
            answers.remove()
        facts = {
            "fingerprint": manifest.fingerprint,
            "runs": manifest.facts["runs"],
            "command": how.command,
            "designs": sum(run_facts["designs"] for run_facts in facts_of.values()),
            "failed": sum(run_facts["failed"] for run_facts in facts_of.values()),
            "duration_s": round(time.monotonic() - began_s, 3),
        }
        manifest.write({PROVENANCE: json_of(facts).encode("utf-8")})
    return report_sensors(manifest, runs)


def report(folder: Path | str, *, began_s: float | None = None) -> Answer:
    """Draw figures and report of a finished run, or of runs of several sensors, again.

    Parameters
    ----------
    folder : path-like
        Folder of a finished run.
    began_s : float, optional
        As for `run`.

    Returns
    -------
    Answer
        Summary of the run.

    Raises
    ------
    SweepError
        If files are missing or differ from those that the run wrote.
    """
    from ..report.sensors import report_sensors, runs_in  # noqa: PLC0415  (few studies have several sensors)

    folder, began_s = run_folder(folder), time.monotonic() if began_s is None else began_s
    if not Manifest(folder).runs:
        return _finish(folder, began_s)
    with locked(folder):
        runs = runs_in(folder)
        if not runs:
            raise OutputError(ValidationIssue("no finished run here", str(folder), allowed="`sweep run` of its study"))
        answers = [_finish(run.folder, began_s) for run in runs]
        problem = next((answer.problem for answer in answers if answer.problem is not None), None)
        lines = report_sensors(Manifest(folder), runs)
    return Answer(lines, {"folder": str(folder), "runs": [answer.facts for answer in answers]}, problem)


def _finish(folder: Path, began_s: float, *, repair: bool = False, parallel: Parallel = in_turn) -> Answer:
    """Draw figures and report of a finished run; a problem if the run's own check failed."""
    from ..report import make_report, read_output, summary_lines  # noqa: PLC0415  (loaded while workers compute)

    result = read_output(folder)
    make_report(result, repair=repair, parallel=parallel)
    lines, check = summary_lines(result, time.monotonic() - began_s), result.provenance.check
    problem: SweepError | None = None
    if check is not None and not check.passed:
        problem = ErrorBoundExceededError(ValidationIssue(check.sentence.removesuffix("."), key=check.scenario))
    elif result.none_feasible and (result.table["status"] == "ok").any():
        problem = InfeasibleError(ValidationIssue("no design meets every constraint", str(folder)))
    facts = result.provenance.model_dump(mode="json")
    return Answer([*lines], {"folder": str(folder), **{key: facts[key] for key in _JSON_KEYS}}, problem)
