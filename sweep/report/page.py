"""Make the page of a finished run from its sections, and its answer for the terminal."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterable, Sequence
from itertools import chain
from typing import Any

import pyarrow as pa
from markupsafe import Markup, escape

from ..base.types import Parallel, delayed, in_turn
from ..results.lock import locked
from ..results.manifest import Manifest
from ..results.output import Output
from ..results.tables import MANIFEST, REPORT, RESULTS, SEARCHED, SWEPT, csv_of, encoded, is_drawn
from .explorer import explorer_data
from .hold import holds_for, saturation_limits
from .leaders import label
from .pages import page, script
from .panels import Picture
from .published import PUBLISHED_CSV, PUBLISHED_PARQUET, comparison_with_published
from .section import Section
from .sections.clouds import Clouds
from .sections.colors import Colors
from .sections.curves import SensorCurves
from .sections.deeper_reds import DeeperReds
from .sections.edges import Edges
from .sections.field import Field
from .sections.flicker import Flicker
from .sections.lamps import Lamps
from .sections.left_out import LeftOut
from .sections.method import Method
from .sections.noise import Noise
from .sections.other_cameras import OtherCameras
from .sections.price import Price
from .sections.published import Published
from .sections.scenes import Scenes
from .sections.series import Series
from .sections.tasks import Tasks
from .sections.tiles import AllTiles
from .sections.trade_off import TradeOff
from .sections.uncertain import Uncertain
from .series import scene_in_words
from .terms import edges_in_words, edges_of, format_constraints, unknown_lines
from .words import joined, quantity, quoted, scaled

ORDER: tuple[type[Section], ...] = (
    *(
        Flicker,
        Noise,
        Lamps,
        Field,
        Series,
        TradeOff,
        Scenes,
        Edges,
        Clouds,
        DeeperReds,
        Tasks,
        Colors,
        Uncertain,
        AllTiles,
        OtherCameras,
        LeftOut,
        Published,
        SensorCurves,
    ),
)
"""Sections of a page. The first that a study calls for and that `leads` answers it; a search answers before series."""
_OF_SERIES = (Flicker, Noise, Series)
MOST_PICTURES = 6
_MOST_ANSWERS, _MOST_LIMITS, _MOST_FURTHER = 3, 5, 2
_LINES, _LETTERS = 8, 120
PARETO_PICTURE = "pareto"
"""Name of the picture of the trade-off, as files for slides."""


def _kinds(output: Output) -> tuple[type[Section], ...]:
    """Return the kinds of sections that a study may call for."""
    if output.study.vision is None:
        return ORDER
    from .sections.vision import Vision  # noqa: PLC0415  (few studies have images)

    return Vision, *ORDER


def sections_of(output: Output) -> tuple[Section | None, list[Section]]:
    """Return the section that answers the study's question, and the others in order."""
    found = list(chain.from_iterable(kind.of(output) for kind in _kinds(output)))
    candidates = [section for section in found if section.leads and section.answer]
    search = output.provenance.search
    if not output.best.empty and (search is None or search.scenarios < 2):
        last = (*_OF_SERIES, Tasks, *(() if search is not None or len(output.scenarios) == 1 else (TradeOff,)))
        candidates = sorted(candidates, key=lambda section: isinstance(section, last))
    elif not output.best.empty:
        candidates = sorted(candidates, key=lambda section: not (isinstance(section, Series) and section.searched))
    elif output.study.tasks is not None and len(output.scenarios) == 1:
        candidates = sorted(candidates, key=lambda section: not isinstance(section, Tasks))
    lead = next(iter(candidates), None)
    return lead, [section for section in found if section is not lead]


def answer_of(output: Output) -> list[str]:
    """Return the answer to the study's question, a sentence each; `**` around the numbers that decide."""
    if output.none_feasible:
        searched = output.kind(SWEPT, SEARCHED)
        if (searched["status"] != "ok").all():
            return [f"Every design failed: {searched['status'].iloc[0]}."]
        under = format_constraints(output)
        none = f"No design meets every constraint{f': {under}' if under else ''}."
        return [none, *_nearest_to_feasible(output), *unknown_lines(output)]
    lead, _ = sections_of(output)
    sentences = [] if lead is None else lead.answer
    first, *rest = sentences[:_MOST_ANSWERS] or [_of_scenes(output)]
    return (
        [scaled(output, first), *rest]
        if " DN" in first or "\u00a0DN" in first
        else [first, *(scaled(output, line) if at == 0 else line for at, line in enumerate(rest))]
    )


def _nearest_to_feasible(output: Output) -> list[str]:
    """Return the design that comes nearest to the constraints, in a sentence."""
    rows = output.kind(SWEPT, SEARCHED).dropna(subset=["violation"])
    if rows.empty:
        return []
    nearest = rows.sort_values("violation", kind="stable").iloc[0].to_dict()
    figures = []
    for name in output.constraints:
        figures.append(f"{output.words(name)} {output.columns[name].formatted(nearest[name])}")
    where = "" if len(output.scenarios) == 1 else f" in {scene_in_words(str(nearest['scenario']))}"
    edges = edges_in_words(edges_of(nearest)).replace("**", "")
    return [f"The nearest is {label(nearest)}{f' ({edges})' if edges else ''}{where}: {', '.join(figures)}."]


def _of_scenes(output: Output) -> str:
    """Return in how many scenes each CFA or design has the largest separation."""
    column, rows = output.trade_off[0], output.named_rows
    known = rows[(rows["status"] == "ok") & rows[column.name].notna()]
    if known.empty:
        return "No CFA or design of this study could be computed."
    best = known.loc[known.groupby("scenario", observed=True, sort=False)[column.name].idxmax(), "name"].value_counts()
    parts = [f"**{quoted(str(name))}** in {count}" for name, count in best.items() if count]
    return f"Of {len(output.scenarios):,} scenes, the largest {quantity(column)} has {joined(parts)}."


def limits_of(output: Output) -> list[str]:
    """Return what limits the answer, a sentence each."""
    lead, _ = sections_of(output)
    return [*failed_lines(output), *([] if lead is None else lead.limits[:_MOST_LIMITS]), *saturation_limits(output)]


def failed_lines(output: Output) -> list[str]:
    """Return how many rows failed; nothing without any."""
    failed = output.counts.failed
    rows = "1 row, whose values are" if failed == 1 else f"{failed:,} rows, whose values are"
    return [f"Failed: {rows} unknown here; status in {RESULTS} says why."] if failed else []


def make_report(output: Output, *, repair: bool = False, parallel: Parallel = in_turn) -> None:
    """Write the page, the picture of the trade-off, and published figures beside ours; with `repair` only damaged ones.

    Raises OutputError if a file of others has its name, or the disk refuses.
    """
    with locked(output.folder):
        manifest = Manifest(output.folder)
        listed = [name for name in manifest.files if is_drawn(name)]
        if repair and not manifest.wrong({REPORT, *listed}):
            return
        contents = {REPORT: report_page(output, sorted(manifest.files), parallel).encode("utf-8"), **_published(output)}
        for trade_off in TradeOff.of(output):
            contents |= {} if trade_off.picture is None else trade_off.picture.files(PARETO_PICTURE)
        manifest.write(contents)
        manifest.remove(name for name in listed if name not in contents)


def _published(output: Output) -> dict[str, bytes]:
    """Return the files of the comparison with published figures."""
    table = comparison_with_published(output)
    if not len(table):
        return {}
    return {
        PUBLISHED_CSV: csv_of(table).encode("utf-8"),
        PUBLISHED_PARQUET: encoded(pa.Table.from_pandas(table, preserve_index=False)),
    }


def report_page(output: Output, files: Iterable[str], parallel: Parallel = in_turn) -> str:
    """Return the page of a run."""
    lead, others = sections_of(output)
    price = (
        next(iter(Price.of(output)), None) if output.study.vision is None and not isinstance(lead, _OF_SERIES) else None
    )
    shown = [
        section for section in others if section.answer or section.picture is not None or section.table is not None
    ]
    pictured = [section for section in shown if section.picture is not None][: MOST_PICTURES - 1]
    study = output.study
    return page_of(
        study.study,
        study.title or study.question or study.study,
        answer_of(output),
        holds_for(output),
        lead,
        [section for section in shown if section.picture is None or section in pictured],
        price=price,
        limits=limits_of(output),
        method=next(iter(Method.of(output))).limits,
        files=[
            RESULTS,
            *(name for name in files if not name.startswith((RESULTS, REPORT)) and not is_drawn(name)),
            MANIFEST,
        ],
        explorer=explorer_data(output),
        parallel=parallel,
    )


def page_of(
    name: str,
    title: str,
    answer: Sequence[str],
    holds: str,
    lead: Section | None,
    sections: Sequence[Section],
    *,
    kind: str = "report of a sweep",
    price: Section | None = None,
    limits: Sequence[str] = (),
    method: Sequence[str] = (),
    files: Sequence[str] = (),
    explorer: dict[str, Any] | None = None,
    mark: str = "",
    parallel: Parallel = in_turn,
) -> str:
    """Return a page: question, answer, what it holds for, the section that answers, price, limits, further ones."""
    pictures = pictures_of([section.picture for section in [*([] if lead is None else [lead]), *sections]], parallel)
    first = {} if lead is None else part(lead, pictures.pop(0)) | {"table": lead.table}
    return page(
        "page.html.j2",
        mark=Markup(mark),
        style=script("page.css"),
        name=name,
        kind=kind,
        title=title,
        answer=marked(" ".join(answer)),
        holds=marked(holds),
        lead={"title": "", "picture": None, "table": None, **first},
        price=None if price is None else part(price, None),
        limits=limits,
        sections=[part(section, picture) for section, picture in zip(sections, pictures, strict=True)],
        explorer=explorer,
        script=script("explorer.js"),
        method=method,
        files=files,
    )


def pictures_of(pictures: Sequence[Picture | None], parallel: Parallel = in_turn) -> list[dict[str, Any] | None]:
    """Draw pictures for a wide and for a narrow screen."""
    svgs = iter(
        [*parallel(delayed(picture.svgs, f"p{at}") for at, picture in enumerate(pictures) if picture is not None)]
    )
    return [
        None
        if picture is None
        else dict(zip(("wide", "narrow"), map(Markup, next(svgs)), strict=True)) | {"caption": picture.caption}
        for picture in pictures
    ]


def part(section: Section, picture: dict[str, Any] | None) -> dict[str, Any]:
    """Return a section for a template."""
    return {
        "title": section.title,
        "text": marked(section.short),
        "picture": picture,
        "table": section.table if picture is None else None,
        "limits": section.limits[:_MOST_FURTHER] if section.picture is None else [],
    }


def marked(text: str) -> Markup:
    """Return a text whose numbers between `**` are bold."""
    return Markup(re.sub(r"\*\*(.+?)\*\*", r"<b>\1</b>", str(escape(text))))


def plain(text: str) -> str:
    """Return a text for a terminal."""
    return text.replace("**", "").replace("\u00a0", " ")


def summary_lines(output: Output, took_s: float | None = None) -> list[str]:
    """Return answer, limits, what was left out, check and files in eight lines; the last one is the folder."""
    method = next(iter(Method.of(output))).limits
    tail = [*failed_lines(output), *(line for line in method if line.startswith(("Left out", "Checked")))]
    took = f"Took {took_s:.1f} s; f" if took_s is not None else "F"
    tail.append(f"{took}iles: {REPORT}, {RESULTS}, provenance.json in")
    body = textwrap.wrap(plain(" ".join(answer_of(output))), _LETTERS)
    room = _LINES - 1 - len(tail)
    for line in [line for line in limits_of(output) if line not in tail]:
        wrapped = textwrap.wrap(plain(line), _LETTERS)
        if len(body) + len(wrapped) <= room:
            body += wrapped
    if len(body) > room:
        body = [
            *body[: room - 1],
            textwrap.shorten(" ".join(body[room - 1 :]), _LETTERS, placeholder=" ... (more in the report)"),
        ]
    return [*body, *(textwrap.shorten(plain(line), _LETTERS, placeholder=" ...") for line in tail), str(output.folder)]
