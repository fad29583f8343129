"""Compare finished runs: page, picture and table."""

from __future__ import annotations

import hashlib
import os
import string
from collections.abc import Mapping, Sequence
from pathlib import Path

import pandas as pd

from ..base.answer import Answer
from ..base.errors import OutputError, SweepError, ValidationIssue
from ..results.atomic import write_bytes, write_text
from ..results.folder import run_folder
from ..results.output import Output, read_output
from ..results.tables import write_csv
from ..study import folder_name
from .compare_fronts import Fronts, front_table, front_words, fronts_in, on_the_same_axes, scene_names
from .compare_tables import (
    best_of_runs,
    curve_notes,
    plain_differences,
    ranking,
    side_by_side,
    with_units_in_cells,
)
from .page import page_of
from .pages import aligned
from .panels import Picture
from .section import Told, table_of
from .sections.trade_off import TradeOff
from .terms import format_constraint

PAGE, PICTURE, TABLE = "compare.html", "fronts", "compare.csv"
_KINDS = ("png", "svg")
_MARK = b'<meta name="generator" content="sweep compare">'
"""The line of the page's template by which a folder is known to hold a comparison."""
_MARK_WITHIN = 1024
_LETTERS = string.ascii_uppercase
_MOST_LETTERS = 100
OF_FRONTS = "whatever the constraints ask of the two axes"
_MOST_SCENARIOS = 4
"""Scenes whose fronts are printed; the page has all."""


def compare(*folders: Path | str | Sequence[Path | str], output: Path | str | None = None) -> Answer:
    """Compare finished runs: studies, best designs, fronts, versions; as a page, a picture and a table.

    Parameters
    ----------
    *folders : path-like, or one sequence of them
        Output folders of 2 to 26 studies, or their names.
    output : path-like, optional
        Folder of the comparison; left out, outputs/compare-A-B.

    Returns
    -------
    Answer
        What the runs say beside each other; ``facts`` has the tables as records.

    Raises
    ------
    SweepError
        If there are fewer or more runs, a folder holds no finished run, or a file of others would be replaced.
    """
    groups = [[group] if isinstance(group, str | os.PathLike) else group for group in folders]
    places = [run_folder(place) for group in groups for place in group]
    if not 2 <= len(places) <= len(_LETTERS):
        allowed = f"2 to {len(_LETTERS)} folders"
        raise SweepError(ValidationIssue("cannot be compared", None, None, "FOLDERS", len(places), allowed))
    target = Path("outputs") / _folder_of(places) if output is None else Path(output)
    _refuse_other(target)
    outputs = [read_output(place) for place in places]
    runs = {f"{letter} {' '.join(o.study.study.split())}": o for letter, o in zip(_LETTERS, outputs, strict=False)}
    fronts, figure, notes = compare_fronts(runs)
    answer = ranking(runs)
    answer += [
        f"{run}: {line}"
        for run, output in runs.items()
        for trade_off in TradeOff.of(output)
        for line in trade_off.limits
        if "separates more" in line
    ]
    notes = [*_same_folders(runs), *curve_notes(runs), *_constraint_note(runs), *notes]
    best = best_of_runs(runs)
    shown, left_out = side_by_side(best, runs)
    plain, same = plain_differences(runs)
    plain_words, words_of = with_units_in_cells(plain), {name: front_words(table) for name, table in fronts.items()}
    sections = [
        Told("Fronts", (f"In {name}, {OF_FRONTS}.",), None, table_of(table)) for name, table in words_of.items()
    ]
    if not words_of:
        sections.append(Told("Fronts", ("There are no fronts to compare.",)))
    sections.append(
        Told(
            "Plain CFAs and named designs",
            () if len(plain) else (same or "The runs share none.",),
            None,
            table_of(plain_words),
        )
    )
    note = f"{left_out} more parameters in {TABLE}." if left_out else ""
    lead = Told("Best designs", (), figure, table_of(shown, note, len(shown)))
    drawn = {} if figure is None else figure.files(PICTURE)
    of_runs = "; ".join(f"{run}: {output.folder}" for run, output in runs.items())
    html = page_of(
        "compare", f"Comparison of {', '.join(runs)}", answer, of_runs, lead, sections, kind="comparison of runs",
        limits=notes, files=[TABLE, *drawn], mark=_MARK.decode(),
    )  # fmt: skip
    write_text(html, target / PAGE)
    write_csv(best, target / TABLE)
    for kind in _KINDS:
        _write_or_remove(drawn.get(f"{PICTURE}.{kind}"), target / f"{PICTURE}.{kind}")
    lines = [f"{run}: {output.folder}" for run, output in runs.items()]
    lines += _section("Best designs", shown, "none")
    lines += [f"({left_out} more parameters in {TABLE}.)"] if left_out else []
    lines += _section("Plain CFAs and named designs", plain_words, same or "none in common")
    for name in list(fronts)[:_MOST_SCENARIOS]:
        lines += _section(f"Fronts in {name}, {OF_FRONTS}", words_of[name], "none")
    if len(fronts) > _MOST_SCENARIOS:
        lines.append(f"({len(fronts) - _MOST_SCENARIOS} more scenes in {PAGE}.)")
    lines += [
        "",
        *answer,
        *(f"Note: {note}" for note in notes),
    ]
    lines.append(f"Files: {target}/: {', '.join([PAGE, TABLE, *drawn])}.")
    of_all = [table.assign(scene=name) for name, table in fronts.items()]
    tables = {"best": best, "plain": plain}
    tables["fronts"] = pd.concat(of_all, ignore_index=True) if of_all else pd.DataFrame()
    records = {name: table.to_dict("records") for name, table in tables.items()}
    return Answer(lines, {"folder": str(target), **records, "notes": notes})


def compare_fronts(runs: Mapping[str, Output]) -> tuple[dict[str, pd.DataFrame], Picture | None, list[str]]:
    """Compare the fronts of runs with the same axes, in equal scenes."""
    group, notes = on_the_same_axes(runs)
    places: dict[str, dict[str, tuple[Output, str]]] = {}
    for run, scenarios in scene_names(group).items():
        for scenario, scene in scenarios.items():
            places.setdefault(scene, {})[run] = group[run], scenario
    shared = [scene for scene, there in places.items() if len(there) > 1]
    if not group:
        return {}, None, notes
    if not shared:
        return {}, None, [*notes, "The runs have no equal scene, so no fronts are compared."]
    if len(places) > len(shared) or any(len(places[scene]) < len(group) for scene in shared):
        within = f"{', '.join(shared)}" if len(shared) <= _MOST_SCENARIOS else f"{len(shared)} of {len(places)}"
        notes.append(f"Fronts are compared in the scenes that two runs or more have: {within}.")
    fronts = {scene: those for scene in shared if (those := fronts_in(places[scene]))}
    if not fronts:
        return {}, None, notes
    scene, shown = next(iter(fronts.items()))
    separation, sensitivity = next(iter(group.values())).trade_off
    marks = []
    for run, (output, scenario) in places[scene].items():
        for row in output.best[output.best["scenario"] == scenario].head(1).to_dict("records"):
            marks.append((run, float(row[sensitivity.name]), float(row[separation.name])))
    of = ", ".join(places[scene]) if len(places[scene]) <= 3 else f"{len(places[scene])} runs"
    labels = sensitivity.words, separation.axis
    tables = {scene: front_table(those) for scene, those in fronts.items()}
    return (
        tables,
        Picture(
            (Fronts(f"{labels[1]}: fronts in {scene}", labels, tuple(runs), tuple(shown), tuple(marks)),),
            f"Fronts of {of}.",
            "Stars: the best design of each run.",
        ),
        notes,
    )


def _same_folders(runs: Mapping[str, Output]) -> list[str]:
    runs_of_folder: dict[Path, list[str]] = {}
    for run, output in runs.items():
        runs_of_folder.setdefault(output.folder.resolve(), []).append(run)
    return [f"{' and '.join(names)} are the same folder." for names in runs_of_folder.values() if len(names) > 1]


def _constraint_note(runs: Mapping[str, Output]) -> list[str]:
    requested = {
        run: " and ".join(format_constraint(output, *bound) for bound in sorted(output.constraints.items())) or "none"
        for run, output in runs.items()
    }
    if len(set(requested.values())) < 2:
        return []
    return [f"The best designs meet different constraints ({'; '.join(f'{r}: {c}' for r, c in requested.items())})."]


def _folder_of(folders: Sequence[Path]) -> str:
    """Return a folder name from those of the runs, short enough for every file system."""
    name = "-".join(["compare", *(folder_name(folder.resolve().name) for folder in folders)])
    if len(name) <= _MOST_LETTERS:
        return name
    digest = hashlib.sha256(name.encode("utf-8")).hexdigest()[:8]
    return f"{name[: _MOST_LETTERS - len(digest) - 1]}-{digest}"


def _refuse_other(target: Path) -> None:
    """Raise OutputError if a file is there without the page of a comparison."""
    try:
        with (target / PAGE).open("rb") as handle:
            if _MARK in handle.read(_MARK_WITHIN):
                return
    except OSError:
        pass  # a message about the file follows below
    for name in (PAGE, TABLE, *(f"{PICTURE}.{kind}" for kind in _KINDS)):
        if os.path.lexists(target / name):
            raise OutputError(
                ValidationIssue("holds something else already", str(target / name), allowed="another --output")
            )


def _write_or_remove(content: bytes | None, path: Path) -> None:
    """Write a file of this comparison, or remove an older one."""
    if content is not None:
        write_bytes(content, path)
        return
    try:
        path.unlink(missing_ok=True)
    except OSError as error:
        raise OutputError(ValidationIssue(f"cannot be removed: {error.strerror or error}", str(path))) from None


def _section(title: str, table: pd.DataFrame, otherwise: str) -> list[str]:
    return ["", f"{title}:", *aligned(table)] if len(table) else ["", f"{title}: {otherwise}"]
