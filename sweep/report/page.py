"""A page, an answer for the terminal, a block of a document: one object from the answer of a run and its sections."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from importlib import resources
from itertools import chain, groupby
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape

from ..base.types import Parallel, delayed, in_turn
from ..features import gathered
from ..results.lock import locked
from ..results.manifest import Manifest
from ..results.output import Output
from ..results.tables import MANIFEST, REPORT, RESULTS, SEARCHED, SWEPT, is_drawn
from .answers import answer_of, figures
from .explorer import explorer_data
from .numbers import unit_shown
from .panels import Answer, Panel, Section, png, styles_of, svg
from .run import Run, name_of, words_of
from .sections import Pairs, conditions, method, sections_of
from .tables import PROVEN, Column, Table

PICTURE = "pareto"
"""Name of the picture of the first panels, as files for slides."""
_TOLD = ("left out", "checked", "failed")
"""Pairs of conditions and method that the terminal says."""


@lru_cache(maxsize=1)
def _templates() -> Environment:
    loader = PackageLoader("sweep.report", "templates")
    found = Environment(
        loader=loader,
        autoescape=lambda name: name is None or name.endswith(".html.j2"),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    found.policies["json.dumps_kwargs"] = {"sort_keys": False, "allow_nan": False}
    return found


def _file(name: str) -> Markup:
    """Return a file beside the templates as it is."""
    text = resources.files("sweep.report").joinpath("templates", name).read_text(encoding="utf-8")
    return Markup(text.replace("</script", "<\\/script"))


def filled(facts: Mapping[str, Any]) -> str:
    """Return the sentence of a kind of answer; `**` around the numbers that decide."""
    text = (
        _templates()
        .get_template("answers.j2")
        .render({"hero": "", "recipe": "", "place": "", "light": "", "dark": "", "at": "", **facts})
        .strip()
    )
    return text if "_" in text.split(maxsplit=1)[0] else text[:1].upper() + text[1:]  # not a name like paper_N4


def sentence(run: Run, answer: Answer) -> str:
    """Return the answer in one sentence, which quotes the table of its section."""
    if run.output.none_feasible:
        return _none_feasible(run)
    table = answer.section.table
    if table is None or (run.hero not in (*table.rows, *table.columns) and not answer.of_all):
        return f"{run.hero or 'No design'}: see the tables."
    proven = [
        (name, key)
        for name in table.rows
        if name.startswith(PROVEN)
        for key in ("goal", "worst")
        if key in table.columns
    ]
    searched = run.hero in run.here and run.here[run.hero]["kind"] in (SEARCHED, SWEPT)
    against = table.cell(run.hero, "goal") if answer.kind == "trade_off" else None
    facts = {
        "kind": answer.kind, "hero": run.hero, "recipe": run.recipe(run.hero) if searched else "", "reference": run.reference,
        "quantity": words_of(run.goal), "scale": run.full_scale, "cell": table.quoted, "table": table,
        "strict": _strict(run),
        "bounds": [table.cell(name, key).text for name, key in proven], "place": run.place if searched else "", "light": _light(run),
        "stricter": table.cell(run.hero, _strict(run)).against if _strict(run) in table.columns and against else "",
        "better": against and against.against, "below": against and against.kind == "loss", **_of_features(run), **answer.facts,
    }  # fmt: skip
    clauses = gathered("CLAUSES", "page")
    return filled(facts) + (clauses[answer.kind](run) if answer.kind in clauses else "")


def _of_features(run: Run) -> dict[str, Any]:
    return {key: value for facts_of in gathered("FACTS", "page").values() for key, value in facts_of(run).items()}


def _strict(run: Run) -> str:
    return f"chromatic_pixel_csd_{'_'.join(run.goal.pair)}" if run.goal.pair else ""


def _light(run: Run) -> str:
    """Return the light of the design that answers, and of the reference."""
    light = figures(run)
    return light.quoted("light") if run.hero in light.rows else ""


def _none_feasible(run: Run) -> str:
    """Return that no design meets the constraints, and which comes nearest."""
    rows = run.output.kind(SWEPT, SEARCHED)
    if (rows["status"] != "ok").all():
        return f"Every design failed: {rows['status'].iloc[0]}."
    limits = dict(conditions(run)).get("constraints", "")
    text = f"**No design** meets every constraint ({limits})."
    near = rows.dropna(subset=["violation"]).sort_values("violation", kind="stable").head(1).to_dict("records")
    if not near:
        return text
    near_by = [
        f"{words_of(run.output.columns[n])} {run.output.columns[n].formatted(near[0][n])}"
        for n in run.output.constraints
    ]
    where = f" in {near[0]['scenario']}" if len(run.output.scenarios) > 1 else ""
    return f"{text} The nearest{where} is {name_of(near[0])}: {', '.join(near_by)}."


@dataclass(frozen=True)
class Report:
    """An answer and its sections, in all forms."""

    name: str
    title: str
    sentence: str
    lead: Section
    sections: Sequence[Section]
    conditions: Pairs
    method: Pairs
    files: Sequence[str]
    explorer: dict[str, Any] | None = None
    mark: str = ""

    @property
    def lines(self) -> list[str]:
        """The answer for a terminal: the sentence and its table."""
        table = self.lead.table
        return [plain(self.sentence), *(table.lines if table is not None and table.rows else [])]

    @property
    def markdown(self) -> str:
        """The answer for a document."""
        table = self.lead.table
        return plain(self.sentence, keep=True) + (f"\n\n{table.markdown}" if table is not None else "")

    def _repr_html_(self) -> str:
        table = self.lead.table
        return f"<p>{marked(self.sentence)}</p>{table_html(table) if table is not None else ''}"

    def html(self, parallel: Parallel = in_turn) -> str:
        """Return the page; `parallel` draws the panels."""
        sections = [self.lead, *self.sections]
        panels = [panel for section in sections for panel in section.panels]
        drawn = iter([*parallel(delayed(svg, panel, f"p{at}") for at, panel in enumerate(panels))])
        views = [_view(section, [Markup(next(drawn)) for _ in section.panels]) for section in sections]
        return _templates().get_template("page.html.j2").render(
            page={
                "name": self.name, "title": self.title, "answer": marked(self.sentence), "lead": views[0], "sections": views[1:],
                "conditions": self.conditions, "method": self.method, "files": self.files, "explorer": self.explorer,
                "mark": Markup(self.mark), "style": _file("page.css"), "script": _file("page.js"),
            }
        )  # fmt: skip


def report_of(output: Output) -> Report:
    """Return the report of a run."""
    run, study = Run(output), output.study
    answer = answer_of(run)
    sections = {answer.section.title: answer.section}
    for section in chain(answer.more, sections_of(run)):
        sections.setdefault(section.title, section)
    files = [
        RESULTS,
        *(name for name in sorted(Manifest(output.folder).files) if "/" not in name and not is_drawn(name)),
        MANIFEST,
    ]
    title = study.title or study.question or study.study
    rest = [section for section in sections.values() if section is not answer.section]
    return Report(
        study.study,
        title,
        sentence(run, answer),
        answer.section,
        rest,
        conditions(run),
        method(run),
        files,
        explorer_data(run),
    )


def make_report(output: Output, *, repair: bool = False, parallel: Parallel = in_turn) -> None:
    """Write the page, the picture of its first panels, and files of features; with `repair` only damaged ones.

    Raises OutputError if a file of others has its name, or the disk refuses.
    """
    with locked(output.folder):
        manifest = Manifest(output.folder)
        listed = [name for name in manifest.files if is_drawn(name)]
        if repair and not manifest.wrong({REPORT, *listed}):
            return
        report = report_of(output)
        contents = {
            REPORT: report.html(parallel).encode("utf-8"),
            **pictures_of(report.lead.panels),
            **{name: of for files in gathered("REPORT_FILES", "page").values() for name, of in files(output).items()},
        }
        manifest.write(contents)
        manifest.remove(name for name in listed if name not in contents)


def pictures_of(panels: Sequence[Panel], name: str = PICTURE) -> dict[str, bytes]:
    """Return the first panels as files for slides."""
    return {} if not panels else {f"{name}.png": png(panels[:2]), f"{name}.svg": svg(panels[-1], name).encode("utf-8")}


def summary_lines(output: Output, took_s: float | None = None) -> list[str]:
    """Return the answer with its table, what was left out, the check and the files; the last line is the folder."""
    report = report_of(output)
    told = [
        f"{name[:1].upper()}{name[1:]}: {words}."
        for name, words in [*report.conditions, *report.method]
        if name in _TOLD
    ]
    took = f"Took {took_s:.1f} s; f" if took_s is not None else "F"
    return [*report.lines, *told, f"{took}iles: {REPORT}, {RESULTS}, provenance.json in", str(output.folder)]


def _table_view(table: Table) -> dict[str, Any]:
    """Return a table for the template."""
    columns = []
    for column in table.columns.values():
        axis = column.axis
        ticks = [] if axis is None else [(axis.percent(at), words) for at, words in axis.ticks]
        words = "" if axis is None else unit_shown(axis.unit)[1]
        unit = f" / {words}" if words else ""
        columns.append(
            {"label": f"{column.label}{unit}", "meaning": column.meaning, "ticks": ticks, "group": column.group}
        )
    groups = [(name, len([*of])) for name, of in groupby(column["group"] for column in columns)]
    styles, rows = styles_of(table.rows), []
    for name in table.rows:
        kind = (
            "hero"
            if name == table.hero
            else "ref"
            if name == table.reference
            else "bound"
            if name.startswith(PROVEN)
            else ""
        )
        cells = [{"cell": table.cell(name, key), "level": _level(column)} for key, column in table.columns.items()]
        color = "#9a9ea4" if table.head or kind == "bound" else styles[name].color
        rows.append({"name": name, "cells": cells, "kind": kind, "color": color})
    shown = groups if any(name for name, _ in groups) else []
    return {
        "head": table.head,
        "columns": columns,
        "rows": rows,
        "note": table.note,
        "groups": shown,
        "of": table.reference,
    }


def _level(column: Column) -> float | None:
    return None if column.axis is None or column.axis.level is None else column.axis.percent(column.axis.level)


def table_html(table: Table) -> str:
    """Return a table as HTML, for a notebook."""
    module: Any = _templates().get_template("page.html.j2").module
    return f"<style>{_file('page.css')}</style>{module.table(_table_view(table))}"


def _view(section: Section, drawn: Sequence[Markup]) -> dict[str, Any]:
    table = section.table if section.table is not None and section.table.rows else None
    return {"title": section.title, "table": table and _table_view(table), "panels": drawn, "note": section.note}


def marked(text: str) -> Markup:
    """Return a text whose numbers between `**` are bold."""
    return Markup(re.sub(r"\*\*(.+?)\*\*", r"<b>\1</b>", str(escape(text))))


def plain(text: str, *, keep: bool = False) -> str:
    """Return a text for a terminal, or with its marks for a document."""
    text = text.replace("\u00a0", " ")
    return text if keep else text.replace("**", "")
