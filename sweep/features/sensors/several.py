"""Runs of a study of several sensors: each of them, what they have in common, their report and their state."""

from __future__ import annotations

import os
import time
from collections.abc import Mapping
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

from ... import runs as runner
from ...api.run import How, changed_name, finish, run_one
from ...base.answer import Answer
from ...base.errors import InterruptedRunError, OutputError, SweepError, ValidationIssue
from ...results.answers import Answers
from ...results.dataset import encoded_part, part_name
from ...results.folder import begin, run_in
from ...results.identity import several_facts
from ...results.lock import locked
from ...results.manifest import Manifest
from ...results.tables import PROVENANCE, REPORT, RESULTS, json_of
from ...runs.kept import CachedCalls
from ...runs.runner import discard
from ...runs.status import lines_of_files, require_whole, status
from ...runs.workers import workers
from ...study import SensorAndLights, SensorStudies, Study, folder_name
from . import ALL_SENSORS
from .all_sensors import all_sensors_table
from .page import SensorRun, report_sensors, rows_of_all, runs_in


def run_several(path: Path, several: SensorStudies, how: How) -> Answer:
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
                answers[member] = run_one(studies[member], in_folder, member)
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
    how: How,
    *,
    began_s: float,
) -> list[str]:
    """Write what several sensors have in common, where it is missing or damaged; return the answer."""
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


def report_several(folder: Path, began_s: float) -> Answer:
    """Draw the reports of all runs of a study of several sensors, and their page."""
    with locked(folder):
        runs = runs_in(folder)
        if not runs:
            raise OutputError(ValidationIssue("no finished run here", str(folder), allowed="`sweep run` of its study"))
        answers = [finish(run.folder, began_s) for run in runs]
        problem = next((answer.problem for answer in answers if answer.problem is not None), None)
        lines = report_sensors(Manifest(folder), runs)
    return Answer(lines, {"folder": str(folder), "runs": [answer.facts for answer in answers]}, problem)


def status_of_several(manifest: Manifest, *, verify: bool, running: bool) -> Answer:
    """Return the state of a study of several sensors or lights: a line for each of them."""
    folder, lines, states = manifest.folder, [], {}
    require_whole(manifest, verify=verify, running=running)
    for member in manifest.runs:
        inner = folder / folder_name(member.name)
        if run_in(inner) is None:
            states[member.name] = "not run"
            lines.append(f"{member.name}: not run.")
            continue
        of_member = status(inner, verify=verify)
        states[member.name] = str(of_member.facts["state"])
        lines.append(f"{member.name}: {of_member.lines[0]}")
    count = sum(state == "finished" for state in states.values())
    is_complete = count == len(states) and PROVENANCE in manifest.files
    state = "running" if running else "finished" if is_complete else "interrupted"
    lines.append(
        f"{state}: {count} of {len(states)} runs finished"
        f"{'' if is_complete or running else '; the same command continues'}."
    )
    finished = PROVENANCE in manifest.files
    lines += lines_of_files(manifest, finished=finished, verified=verify and not running)
    return Answer(lines, {"folder": str(folder), "state": state, "verified": verify, "runs": states})
