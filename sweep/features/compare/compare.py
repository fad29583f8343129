"""Finished runs beside each other: best designs, designs that they share, fronts, and what differs in their studies."""

from __future__ import annotations

import hashlib
import os
import string
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from ...base.answer import Answer
from ...base.errors import OutputError, SweepError, ValidationIssue
from ...report.numbers import SHARE, joined
from ...report.page import Report
from ...report.panels import Lines, Section, axis_over, png, svg
from ...report.run import LIGHT, Run, unit_of, words_of
from ...report.sections import conditions
from ...report.tables import Column, Table
from ...results.atomic import write_bytes, write_text
from ...results.folder import run_folder
from ...results.output import read_output
from ...results.tables import csv_of
from ...study import folder_name

PAGE, PICTURE, TABLE = "compare.html", "fronts", "compare.csv"
_MARK = '<meta name="generator" content="sweep compare">'
"""The line of the page by which a folder is known to hold a comparison."""
_MARK_WITHIN = 1024
_MOST_LETTERS, _MOST_KEYS, _LETTERS_OF_VALUE = 100, 40, 60
_LEFT_OUT = ("study", "title", "question")
Columns = dict[str, tuple[Column, Mapping[str, Any]]]


def compare(*folders: Path | str | Sequence[Path | str], output: Path | str | None = None) -> Answer:
    """Compare finished runs: studies, best designs, fronts; as a page, a picture and a table.

    Parameters
    ----------
    *folders : path-like, or one sequence of them
        Output folders of 2 to 26 studies, or their names.
    output : path-like, optional
        Folder of the comparison; left out, outputs/compare-A-B.

    Returns
    -------
    Answer
        What is the best of each run, and the files.

    Raises
    ------
    SweepError
        If a run is not finished, or the folder holds something else.
    """
    groups = [[group] if isinstance(group, str | os.PathLike) else group for group in folders]
    given = [run_folder(place) for group in groups for place in group]
    if not 2 <= len(given) <= len(string.ascii_uppercase):
        allowed = f"2 to {len(string.ascii_uppercase)}"
        raise SweepError(ValidationIssue("a number of runs that cannot be compared", value=len(given), allowed=allowed))
    read = [Run(read_output(folder)) for folder in given]
    runs = {f"{letter} {run.study.study}": run for letter, run in zip(string.ascii_uppercase, read, strict=False)}
    to = Path("outputs") / _folder_of(read) if output is None else Path(output)
    _refuse_others(to)
    report = report_of_runs(runs)
    write_text(report.html(), to / PAGE)
    assert report.lead.table is not None
    write_text(csv_of(report.lead.table.frame.rename_axis("run").reset_index()), to / TABLE)
    for kind in ("svg", "png"):
        (to / f"{PICTURE}.{kind}").unlink(missing_ok=True)
    for panel in report.lead.panels:
        write_text(svg(panel, PICTURE), to / f"{PICTURE}.svg")
        write_bytes(png([panel]), to / f"{PICTURE}.png")
    files = [PAGE, TABLE, *(f"{PICTURE}.{kind}" for kind in ("svg", "png") if report.lead.panels)]
    shared = next((s.table for s in report.sections if s.title == _SHARED), None)
    lines = [*report.lines, *(["", f"{_SHARED}:", *shared.lines] if shared is not None and shared.rows else [])]
    facts = {"folder": str(to), "best": _records(report.lead.table), "shared": _records(shared)}
    return Answer([*lines, f"Files: {to}/: {', '.join(files)}."], facts)


def _records(table: Table | None) -> list[Any]:
    return [] if table is None else table.frame.rename_axis("name").reset_index().to_dict("records")


_SHARED = "Designs that they share"


def report_of_runs(runs: Mapping[str, Run]) -> Report:
    """Return the report over several runs; gains and losses are against the first one."""
    first, best, apart = next(iter(runs)), _best(runs), _apart(runs)
    found = [name for name, run in runs.items() if len(run.output.best)]
    if apart or len(found) < 2:
        text = f"Not ranked: {joined(apart)} differ." if apart else "Fewer than two runs have a design that was found."
    else:
        hero = max(found, key=lambda name: np.nan_to_num(_goal(runs[name])))
        best = Table(best.columns, best.rows, first, hero, head="run")
        text = f"**{hero}** has the most {words_of(runs[first].goal)}, each under its own constraints: {best.quoted('goal')}."
    for name in (name for name in runs if name not in found):
        text += f" {name} has no design that was swept or searched and meets its constraints."
    sections = [Section(_SHARED, _shared(runs)), Section("What differs in the studies", _differences(runs))]
    held = [(name, "; ".join(words for _, words in conditions(run)[:2])) for name, run in runs.items()]
    files = [(name, str(run.output.folder)) for name, run in runs.items()]
    lead = Section("Best designs", best, tuple(_fronts(runs)))
    return Report("compare", f"Comparison of {', '.join(runs)}", text, lead, sections, held, files, [TABLE], mark=_MARK)


def _apart(runs: Mapping[str, Run]) -> list[str]:
    """Return what differs, so that figures of the runs are not of one thing: objective, scene, pixel, curves."""

    def scene(run: Run) -> Any:
        return run.study.scenarios[run.scene].model_dump(exclude={"at", "series"})

    def curves(of: Mapping[str, Any]) -> Any:
        return {name: of[name].tobytes() for name in of}

    parts: dict[str, Callable[[Run], Any]] = {
        "objectives": lambda run: run.goal.name,
        "scenes": scene,
        "pixels": lambda run: run.study.pixel,
        "curves of the sensors": lambda run: curves(run.output.curves.sensor),
        "curves of the lamps": lambda run: curves(run.output.curves.bundles),
    }
    first, *others = runs.values()
    return [what for what, of in parts.items() if any(of(other) != of(first) for other in others)]


def _goal(run: Run) -> float:
    return float(run.here[run.hero][run.goal.name]) if run.hero in run.here else float("nan")


def _best(runs: Mapping[str, Run]) -> Table:
    """Return a row for each run: its best design and its figures and parameters."""
    columns: Columns = {"design": (Column("design"), {name: run.hero for name, run in runs.items()})}
    first = next(iter(runs.values()))
    columns["goal"] = first.column(first.goal.name), {name: _goal(run) for name, run in runs.items()}
    keys = chain.from_iterable((*run.figures[1:], *run.output.parameters) for run in runs.values())
    for key in dict.fromkeys(keys):
        column = Column(key.removesuffix("_nm").replace("_", " "), "nm" if key.endswith("_nm") else "")
        column = next((run.column(key) for run in runs.values() if key in run.output.columns), column)
        columns[key] = column, {name: float(run.here.get(run.hero, {}).get(key, np.nan)) for name, run in runs.items()}
    return Table.of(columns, reference=next(iter(runs)), head="run")


def _fronts(runs: Mapping[str, Run]) -> Iterator[Lines]:
    """Yield the fronts of the runs of which everything is alike."""
    first, lines = next(iter(runs.values())), {}
    for name, run in runs.items():
        rows = run.output.table
        rows = rows[rows["pareto"] & (rows["scenario"] == run.scene)].sort_values(LIGHT)
        if len(rows) > 1 and not _apart({"first": first, name: run}):
            lines[name] = rows[LIGHT].to_numpy(dtype=float), rows[run.goal.name].to_numpy(dtype=float)
    if lines:
        x, y = ([*chain.from_iterable(line[at] for line in lines.values())] for at in (0, 1))
        up = axis_over(words_of(first.goal), unit_of(first.goal), y, log=False)
        across = axis_over("light of the whole CFA", SHARE, x, zero=False, log=False)
        yield Lines(f"Fronts: {up.label}", across, up, lines=lines)


def _shared(runs: Mapping[str, Run]) -> Table:
    """Return the goal of designs that several runs have."""
    every = dict.fromkeys(chain.from_iterable(run.here for run in runs.values()))
    names = [name for name in every if sum(name in run.here for run in runs.values()) > 1]
    columns: Columns = {}
    for key, run in runs.items():
        values = {name: run.value(name, run.goal.name) for name in names if name in run.here}
        columns[key] = Column(key, unit_of(run.goal), group=words_of(run.goal)), values
    return Table.of(columns)


def _differences(runs: Mapping[str, Run]) -> Table:
    """Return the keys of the resolved studies that differ."""
    flat = {name: dict(_flattened(run.output.resolved)) for name, run in runs.items()}
    every = dict.fromkeys(chain.from_iterable(flat.values()))
    keys = [
        key for key in every if key.split(".")[0] not in _LEFT_OUT and len({of.get(key) for of in flat.values()}) > 1
    ]
    columns: Columns = {
        name: (Column(name), {key: of.get(key, "") for key in keys[:_MOST_KEYS]}) for name, of in flat.items()
    }
    more = len(keys) - _MOST_KEYS
    return Table.of(columns, head="key", note=f"{more} more keys differ." if more > 0 else "")


def _flattened(value: Any, path: str = "") -> Iterator[tuple[str, str]]:
    """Yield dotted keys and values as text."""
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from _flattened(inner, f"{path}.{key}".lstrip("."))
    else:
        yield path, str(value)[:_LETTERS_OF_VALUE]


def _folder_of(runs: Sequence[Run]) -> str:
    """Return the name of the folder of a comparison."""
    names = "-".join(folder_name(run.study.study) for run in runs)
    if len(names) > _MOST_LETTERS:
        names = f"{names[:_MOST_LETTERS]}-{hashlib.sha256(names.encode()).hexdigest()[:8]}"
    return f"compare-{names}"


def _refuse_others(folder: Path) -> None:
    """Raise OutputError where a file that is no comparison's stands in the place of one."""
    page = folder / PAGE
    others = [
        name
        for name in (PAGE, TABLE, *(f"{PICTURE}.{kind}" for kind in ("svg", "png")))
        if os.path.lexists(folder / name)
    ]
    if not others:
        return
    try:
        with page.open("rb") as file:
            known = _MARK.encode() in file.read(_MARK_WITHIN)
    except OSError:
        known = False
    if not known or page.is_symlink():
        problem = "holds something else already"
        raise OutputError(ValidationIssue(problem, str(folder / others[0]), allowed="another --output"))
