"""Read finished runs, compare them, write page, picture and table."""

from __future__ import annotations

import hashlib
import os
import string
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from ...base.errors import Fault, OutputError, SweepError
from ...results.atomic import write_bytes, write_text
from ...results.tables import write_csv
from ...study import folder_name
from .. import Output, read_output
from ..answer import who_else
from ..pages import inlined, page, rows
from ..terms import constraint_told
from .best import best_of_runs, parameters_of, plain_differences, quantities_in, ranking, side_by_side
from .differences import curve_notes, origin_differences, scene_notes, study_differences
from .drawing import FrontLine, FrontsFigure, Mark, pictures
from .fronts import ComparedFront, Region, box_of, common_scenarios, fronts, hypervolumes, on_the_same_axes

PAGE, PICTURE, TABLE = "compare.html", "fronts", "compare.csv"
_KINDS = ("png", "svg")
_MARK = b'<meta name="generator" content="sweep compare">'
"""The line of the page's template by which a folder is known to hold a comparison."""
_MARK_WITHIN = 1024
_LETTERS = string.ascii_uppercase
_MOST_LETTERS = 100
_MOST_PARAMETERS = 12
_MOST_SCENARIOS = 4
"""Scenarios whose hypervolumes are printed; the page has all."""


@dataclass(frozen=True)
class Areas:
    """What the fronts of a scenario dominate in a box; `table` as `fronts.hypervolumes` gives it."""

    scenario: str
    box: Region
    table: pd.DataFrame

    def __str__(self) -> str:
        low, high = self.box.reference, self.box.top
        return (
            f"Fronts in {self.scenario}, whatever the constraints ask of the two axes; hypervolume (DN x sensitivity) "
            f"above the reference of {low[0]:g} DN at a sensitivity of {low[1]:g}, in the box up to {high[0]:.1f} DN "
            f"at {high[1]:.4f} ({self.box.area:.4g}):"
        )


@dataclass(frozen=True)
class Fronts:
    """What there is to say of the fronts, scenario by scenario, and the picture's data."""

    areas: Sequence[Areas]
    figure: FrontsFigure | None
    notes: Sequence[str]


@dataclass(frozen=True)
class Comparison:
    """What was found: lines for people; the same as tables by their names; the folder of the files."""

    folder: Path
    lines: Sequence[str]
    tables: Mapping[str, pd.DataFrame]
    notes: Sequence[str]


def compare_runs(folders: Sequence[Path], to: Path | None) -> Comparison:
    """Compare finished runs, write `compare.html`, `compare.csv`, `fronts.png`, `fronts.svg`, and say what was found.

    `to`: default outputs/compare-<a>-<b>. Raises SweepError unless there are 2 to 26; OutputError for a folder without
    a finished run, where a file would be replaced that no comparison wrote, and as `atomic.atomic` does.
    """
    if not 2 <= len(folders) <= len(_LETTERS):
        allowed = f"2 to {len(_LETTERS)} folders"
        raise SweepError(Fault("cannot be compared", None, None, "FOLDERS", len(folders), allowed))
    target = to or Path("outputs") / _folder_of(folders)
    _refuse_other(target)
    outputs = [read_output(folder) for folder in folders]
    runs = {f"{letter} {_one_line(o.study.study)}": o for letter, o in zip(_LETTERS, outputs, strict=False)}
    compared = compare_fronts(runs)
    answer = [*ranking(runs), *_largest(compared)]
    answer += [f"{run}: {line}" for run, output in runs.items() for line in who_else(output)]
    notes = [*_same_folders(runs), *curve_notes(runs), *scene_notes(runs), *_constraint_note(runs), *compared.notes]
    best = best_of_runs(runs)
    shown, left_out = side_by_side(best, _MOST_PARAMETERS, parameters_of(runs), quantities_in(runs))
    plain, same = plain_differences(runs)
    studies, origins = study_differences(runs), origin_differences(runs)
    drawn = {} if compared.figure is None else pictures(compared.figure)
    html = page(
        "compare.html.j2",
        runs={run: str(output.folder) for run, output in runs.items()},
        answer=answer,
        notes=notes,
        best=rows(shown),
        left_out=left_out,
        picture=inlined(drawn["png"]) if drawn else None,
        caption="" if compared.figure is None else compared.figure.title,
        hypervolumes=[(str(areas), rows(areas.table)) for areas in compared.areas],
        plain=rows(plain),
        same=same or "The runs share no plain CFA and no named design.",
        studies=rows(studies),
        origins=rows(origins),
    )
    write_text(html, target / PAGE)
    write_csv(best, target / TABLE)
    for kind in _KINDS:
        _write_or_remove(drawn.get(kind), target / f"{PICTURE}.{kind}")
    lines = [f"{run}: {output.folder}" for run, output in runs.items()]
    lines += _section("What differs in the studies", studies, "nothing")
    lines += _section("What differs in how they were computed", origins, "nothing")
    lines += _section("Best designs", shown, "none")
    lines += [f"({left_out} more parameters in {TABLE}.)"] if left_out else []
    lines += _section("Plain CFAs and named designs", plain, same or "none in common")
    for areas in compared.areas[:_MOST_SCENARIOS]:
        lines += ["", str(areas), *_aligned(areas.table)]
    if len(compared.areas) > _MOST_SCENARIOS:
        lines.append(f"({len(compared.areas) - _MOST_SCENARIOS} more scenarios in {PAGE}.)")
    lines += ["", *answer, *(f"Note: {note}" for note in notes)]
    names = [PAGE, TABLE, *(f"{PICTURE}.{kind}" for kind in drawn)]
    areas_of_all = [areas.table.assign(scenario=areas.scenario) for areas in compared.areas]
    tables = {"best": best, "plain": plain, "studies": studies, "origins": origins}
    tables["hypervolumes"] = pd.concat(areas_of_all, ignore_index=True) if areas_of_all else pd.DataFrame()
    lines.append(f"Files: {target}/: {', '.join(names)}.")
    return Comparison(target, lines, tables, notes)


def compare_fronts(runs: Mapping[str, Output]) -> Fronts:
    """Fronts of the runs with the same axes, in the scenarios that these share."""
    group, notes = on_the_same_axes(runs)
    if not group:
        return Fronts([], None, notes)
    scenarios = common_scenarios(group)
    every = {name for output in group.values() for name in output.scenarios}
    if not scenarios:
        return Fronts([], None, [*notes, "The runs have no scenario of the same name, so no fronts are compared."])
    if len(every) > len(scenarios):
        notes.append(f"Fronts are compared in the scenarios that all have: {', '.join(scenarios)}.")
    found = {name: fronts(group, name) for name in scenarios}
    notes += _cfa_note([front for own in found.values() for front in own])
    boxes = {name: box_of(own) for name, own in found.items() if own}
    areas = [Areas(name, box, hypervolumes(found[name], box)) for name, box in boxes.items()]
    shown = next(iter(boxes), None)
    return Fronts(areas, None if shown is None else _figure(group, list(runs), shown, found[shown]), notes)


def _largest(compared: Fronts) -> list[str]:
    """Which front dominates most, where there are several to compare."""
    if not compared.areas or compared.areas[0].table["run"].nunique() < 2:
        return []
    areas = compared.areas[0]
    most = areas.table.nlargest(1, "hypervolume").to_dict("records")[0]
    share = f"{most['hypervolume']:.4g} of {areas.box.area:.4g} DN x sensitivity"
    return [f"Largest hypervolume in {areas.scenario}: {most['run']}, {most['CFA']} ({most['front']}): {share}."]


def _figure(
    group: Mapping[str, Output], order: Sequence[str], scenario: str, found: Sequence[ComparedFront]
) -> FrontsFigure:
    separation, sensitivity = next(iter(group.values())).trade_off
    lines = [FrontLine(f.name, order.index(f.run), f.points[:, 1], f.points[:, 0], f.traced) for f in found]
    marks = []
    for run, output in group.items():
        best = output.best[output.best["scenario"] == scenario]
        if len(best):
            row = best.iloc[0]
            marks.append(
                Mark(run.partition(" ")[0], order.index(run), float(row[sensitivity.name]), float(row[separation.name]))
            )
    title = (
        f"{', '.join(group)}: fronts in {scenario}" if len(group) <= 3 else f"Fronts of {len(group)} runs in {scenario}"
    )
    return FrontsFigure(title, sensitivity.words, separation.axis, lines, marks)


def _cfa_note(found: Sequence[ComparedFront]) -> list[str]:
    by_run: dict[str, list[str]] = {}
    for front in found:
        by_run.setdefault(front.run, []).append(front.cfa)
    if len({frozenset(cfas) for cfas in by_run.values()}) < 2:
        return []
    each = "; ".join(f"{run}: {', '.join(dict.fromkeys(cfas))}" for run, cfas in by_run.items())
    return [f"The fronts are of different CFAs ({each})."]


def _same_folders(runs: Mapping[str, Output]) -> list[str]:
    places: dict[Path, list[str]] = {}
    for run, output in runs.items():
        places.setdefault(output.folder.resolve(), []).append(run)
    return [f"{' and '.join(own)} are the same folder." for own in places.values() if len(own) > 1]


def _constraint_note(runs: Mapping[str, Output]) -> list[str]:
    each = {
        run: " and ".join(constraint_told(output, *asked) for asked in sorted(output.constraints.items())) or "none"
        for run, output in runs.items()
    }
    if len(set(each.values())) < 2:
        return []
    return [f"The best designs meet different constraints ({'; '.join(f'{r}: {c}' for r, c in each.items())})."]


def _folder_of(folders: Sequence[Path]) -> str:
    """A name from those of the runs, short enough for every file system."""
    name = "-".join(["compare", *(folder_name(folder.resolve().name) for folder in folders)])
    if len(name) <= _MOST_LETTERS:
        return name
    digest = hashlib.sha256(name.encode("utf-8")).hexdigest()[:8]
    return f"{name[: _MOST_LETTERS - len(digest) - 1]}-{digest}"


def _refuse_other(target: Path) -> None:
    """Raises OutputError where one of the files is there without a page that says a comparison wrote it."""
    try:
        with (target / PAGE).open("rb") as handle:
            if _MARK in handle.read(_MARK_WITHIN):
                return
    except OSError:
        pass  # what is there, if anything, is told below
    for name in (PAGE, TABLE, *(f"{PICTURE}.{kind}" for kind in _KINDS)):
        if os.path.lexists(target / name):
            raise OutputError(Fault("holds something else already", str(target / name), allowed="another --output"))


def _write_or_remove(content: bytes | None, path: Path) -> None:
    """A file of this comparison, or its absence: an older picture would be of something else."""
    if content is not None:
        write_bytes(content, path)
        return
    try:
        path.unlink(missing_ok=True)
    except OSError as error:
        raise OutputError(Fault(f"cannot be removed: {error.strerror or error}", str(path))) from None


def _section(title: str, table: pd.DataFrame, otherwise: str) -> list[str]:
    return ["", f"{title}:", *_aligned(table)] if len(table) else ["", f"{title}: {otherwise}"]


def _aligned(table: pd.DataFrame) -> list[str]:
    """A table as lines of text."""
    cells = rows(table)
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    return ["  ".join(c.ljust(w) for c, w in zip(line, widths, strict=True)).rstrip() for line in cells]


def _one_line(text: str) -> str:
    return " ".join(text.split())
