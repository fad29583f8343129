"""Run a study, or several of one file, or say the work that a run would do; draw the report of a finished run."""

from __future__ import annotations

import hashlib
import os
import re
import sys
import time
import webbrowser
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .. import runs as runner
from ..base.answer import Answer
from ..base.errors import (
    ErrorBoundExceededError,
    InfeasibleError,
    OutputError,
    SweepError,
    ValidationIssue,
)
from ..base.types import Progress, in_turn, silent
from ..features import modules
from ..results.folder import run_folder
from ..results.identity import run_facts
from ..results.manifest import Manifest
from ..results.tables import MANIFEST, REPORT
from ..runs.workers import backend_here, workers
from ..study import SensorAndLights, Study, folder_name, load_study, sensor_studies_in
from ..study.shipped import study_path
from .check import Changes

if TYPE_CHECKING:
    from ..base.types import Parallel

_JSON_KEYS = ("filters", "designs", "failed", "duration_s", "search", "check", "warnings")
"""Keys of provenance that an answer repeats."""
_LONGEST_NAME = 120


@dataclass(frozen=True)
class How:
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
    how = How(
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
    answer = run_one(how.load(path), how) if several is None else _several().run_several(path, several, how)
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
    return run_one(study, How(output, time.monotonic(), jobs=jobs, command=("sweep", "from Python")))


def run_one(study: Study, how: How, member: SensorAndLights | None = None) -> Answer:
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
        answer = finish(folder, how.began_s, repair=True, parallel=parallel)
    return replace(answer, facts={"computed": bool(computed), **answer.facts})


def changed_name(changes: Mapping[str, Any]) -> str:
    """Return the folder, within that of a study, for a run with changed keys; empty without any."""
    stated = ",".join(f"{key}={value}" for key, value in sorted(changes.items()))
    name = re.sub(r"[^a-zA-Z0-9_.,=+-]", "_", stated)
    if len(name) > _LONGEST_NAME:
        name = f"{name[:_LONGEST_NAME]}-{hashlib.sha256(stated.encode()).hexdigest()[:8]}"
    return name


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
    folder, began_s = run_folder(folder), time.monotonic() if began_s is None else began_s
    if not Manifest(folder).runs:
        return finish(folder, began_s)
    answer: Answer = _several().report_several(folder, began_s)
    return answer


def _several() -> Any:
    """Return the feature of studies of several sensors."""
    return next(iter(modules("several")))


def finish(folder: Path, began_s: float, *, repair: bool = False, parallel: Parallel = in_turn) -> Answer:
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
