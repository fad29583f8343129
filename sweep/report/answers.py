"""The answer of a run: one of few kinds, each a table with its panels; its sentence quotes the table."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ..base.types import Array, Float
from ..features import gathered
from ..metrics.columns.chromatic import CHROMATIC_ERROR
from ..metrics.columns.confusion import STATE_ERROR
from ..metrics.quantity import DN, WORST_CASE
from ..results.tables import CROSSINGS, FRONT, NAMED, REFERENCE, SATURATED, SWEPT
from .numbers import ERROR, SAME, SHARE, Span, amount, change, joined, span
from .panels import Answer, Curves, Lines, Panel, Points, Section, axis_over, styles_of
from .run import LIGHT, Run, Series, unit_of, words_of
from .tables import Axis, Cell, Column, Marks, Table

_ERROR_TICKS = ((0.5, "1 in 2"), (1e-3, "1 in 1,000"), (1e-6, "1 in 10⁶"), (1e-9, "1 in 10⁹"), (1e-12, "rarer"))
_RAREST = 1e-12
_LEAST_DRAWN = 0.3
"""DN below which a line on a logarithmic axis is at its foot."""
_MOST_OTHERS = 3
"""Designs that a sentence names beside the one that answers."""
_SMALLEST_GAP = 5.0
"""Gaps of a bar that are narrower, in percent of the axis, are left out."""
_COUNTS = (
    "Each channel: equal pixels count once. Every pixel: each of the tile counts, as noise sees it. Any brightness: lamps may be of any. "
    "Light: of all pixels, against a sensor without filters. N: the pixel that is modified. ▲ ▼: better or worse than the first row."
)
Columns = dict[str, tuple[Column, Mapping[str, Any]]]
Line = Float[Array, " _scenes"]


def trade_off(run: Run) -> Answer:
    """Separation and light of every design in one scene."""
    panels = (*filters(run), *front(run))
    of, goal, table = run.value(run.reference, run.goal.name), run.values(run.goal.name), figures(run)
    others = [
        f"{name} {table.cell(name, 'goal').text} ({change(goal[name], of or 1.0)})"
        for name in goal
        if name != run.reference
    ]
    alike = {name: run.goal.extreme or abs(value - goal[run.hero]) <= SAME * value for name, value in goal.items()}
    named = [name for name, row in run.here.items() if row["kind"] == NAMED and name != run.hero and alike[name]]
    asked = run.output.columns[run.asked] if run.asked else None
    kept = run.value(run.hero, run.asked) if asked is not None and asked.role == "light" else None
    facts = {
        "found": run.found, "others": others, "asked": asked and words_of(asked), "price": price(run, table),
        "lost": kept and amount(1 - kept, SHARE), "tiles": run.facts.search is not None and bool(run.facts.search.features), "beside": [f"{name} {table.cell(name, 'goal').text}" for name in named] if run.goal.extreme
        else [f"as much as {joined(named)}"] * bool(named),
    }  # fmt: skip
    return Answer("trade_off", Section("Designs", table, panels), facts)


def price(run: Run, table: Table) -> list[str]:
    """Return what a separation costs beside light: the first figure of each kind in which the answer loses."""
    found: dict[str, str] = {}
    for key in run.prices:
        cell = table.cell(run.hero, key) if key in table.columns and run.hero in table.rows else Cell("")
        if cell.kind == "loss" or (cell.text and run.limit(key)):
            label, limit = table.columns[key].label.split(",")[0], run.limit(key)
            found.setdefault(label, f"{label} {cell.text} ({limit})" if limit else f"{label} {cell.against}")
    return [*found.values()]


def figures(run: Run) -> Table:
    """Return the figures that matter of every design in the scene that answers, with the proven bound as a row."""
    keys = {run.goal.name: "goal", run.asked: "asked", LIGHT: "light"}
    columns: Columns = {keys.get(name, name): run.figure(name) for name in run.figures}
    columns["recipe"] = Column("filter"), {name: run.recipe(name) for name in run.values(LIGHT)}
    columns["meets"] = meets(run)
    note = _COUNTS if run.goal.pair else ""
    return Table.of(with_bound(run, "goal", columns), reference=run.reference, hero=run.hero, note=note)


def meets(run: Run) -> tuple[Column, dict[str, str]]:
    """Return which designs meet the constraints, if one does not."""
    known = {name: run.broken(name) for name, row in run.here.items() if row["kind"] != REFERENCE}
    return Column("meets the constraints"), known if any(text != "yes" for text in known.values()) else {}


def with_bound(run: Run, key: str, columns: Columns) -> Columns:
    """Add the proven bound to a column, as a row of its own."""
    column, values = columns[key]
    return columns if run.bound is None else columns | {key: (column, {**values, run.bound[0]: run.bound[1]})}


def front(run: Run) -> list[Points]:
    """Return the goal over light: designs, the front of the search, its bound, and those that were swept."""
    goal, table = run.goal, run.output.table
    points = {name: (float(row[LIGHT]), float(row[goal.name])) for name, row in run.here.items()}
    points = {name: place for name, place in points.items() if np.isfinite(place).all()}
    if run.hero not in points:
        return []
    lines: dict[str, Any] = {}
    searched = run.output.tables.get(FRONT) if run.output.goal.name == goal.name else None
    if searched is not None:
        for key, *pair in (("front", "cfa_sensitivity", "objective"), ("bound", "cfa_sensitivity_min", "upper_bound")):
            known = searched[pair].dropna().sort_values(pair[0])
            if len(known) > 1:
                lines[key] = known[pair[0]].to_numpy(dtype=float), known[pair[1]].to_numpy(dtype=float)
    swept = table[(table["kind"] == SWEPT) & table["pareto"] & table["feasible"] & (table["scenario"] == run.scene)]
    if len(swept):
        lines["cloud"] = swept[LIGHT].to_numpy(dtype=float), swept[goal.name].to_numpy(dtype=float)
    heights = [*(y for _, y in points.values()), *np.concatenate([[0.0], *(line[1] for line in lines.values())])]
    y = axis_over(words_of(goal), unit_of(goal), heights, log=False, level=run.value(run.reference, goal.name))
    widths = [
        *(x for x, _ in points.values()),
        *np.concatenate([[points[run.hero][0]], *(line[0] for line in lines.values())]),
    ]
    x = axis_over("light of the whole CFA", SHARE, widths, zero=False, log=False)
    return [Points(f"What it costs in light: {y.label}", x, y, run.hero, points=points, **lines)]


def filters(run: Run) -> list[Curves]:
    """Return the modified channels of the design that answers beside the curves between which they lie."""
    curves = run.modified(run.hero)
    if not curves:
        return []
    plain = [*dict.fromkeys(run.between(str(run.here[run.hero]["cfa"])))]
    shown = {**{key: run.output.curves.sensor[key] for key in plain}, **curves}
    nm = run.output.curves.wavelength_nm
    top = Axis(high=1.12 * max(float(curve.max()) for curve in shown.values()))
    across = Axis("wavelength", "nm", float(nm[0]), float(nm[-1]))
    title, color = f"Quantum efficiency of {run.hero}", styles_of(run.here)[run.hero].color
    return [Curves(title, across, top, next(iter(curves)), nm, shown, run.lamps, run.edges(run.hero), color, plain)]


def errors(run: Run) -> Answer:
    """Where noise confuses two lamps at most as often as allowed, over each series."""
    recognition = run.study.recognition
    assert recognition is not None
    allowed, sections = recognition.error_max, []
    words = amount(allowed, ERROR)
    for one in run.series:
        lines = run.over(one, CHROMATIC_ERROR)
        if not lines:
            continue
        usable = {
            name: one.marks(_without_gaps(one, crossed(run, one, CHROMATIC_ERROR, name, y <= allowed)), 2)
            for name, y in lines.items()
        }
        equal = {
            name: one.marks(crossed(run, one, STATE_ERROR, name, y <= allowed), 2).text
            for name, y in run.over(one, STATE_ERROR).items()
        }
        order = sorted(
            usable, key=lambda name: -sum(one.axis.percent(b) - one.axis.percent(a) for a, b in usable[name].spans)
        )
        columns: Columns = {
            "usable": (
                Column("any brightness", axis=one.axis, group=f"errors of at most {words}"),
                {n: usable[n] for n in order},
            ),
            "equal": (Column("equal brightness", group=f"errors of at most {words}"), equal),
            "light": run.figure(LIGHT),
            "full": full_from(run, one),
        }
        drawn = {name: (one.x, np.maximum(y, _RAREST)) for name, y in lines.items()}
        panel = Lines(
            "How often the two most alike are confused", one.axis, Axis("error", "", _RAREST / 2, 1, True), run.hero,
            lines=drawn, zone=(allowed, 1, f"more than {words}"), ticks=_ERROR_TICKS,
        )  # fmt: skip
        table = Table.of(columns, reference=run.reference, hero=run.hero)
        sections.append(Section(f"Over {one.axis.name}", table, (panel, *over_numbers(run, one))))
    states = joined([*(recognition.states or run.output.curves.bundles)])
    facts = {"allowed": words.replace("1 in", "1 error in"), "states": states}
    if len(sections) == 1:
        only = sections[0].table
        assert only is not None
        texts = {name: only.cell(name, "usable").text for name in only.rows}
        ahead = next(iter(texts), "")
        return Answer("errors", sections[0], facts | {
            "ahead": ahead, "ranges": texts, "nowhere": joined([name for name, text in texts.items() if text == "nowhere"]),
            "others": [name for name, text in texts.items() if name != ahead and text != "nowhere"][:_MOST_OTHERS],
        })  # fmt: skip
    rows: dict[str, dict[str, Any]] = {}
    for section in sections:
        assert section.table is not None
        rows[section.title.removeprefix("Over ")] = {
            name: section.table.cell(name, "usable").text for name in section.table.rows
        }
    for one in run.series:
        for name, y in run.over(one, run.goal.name).items():
            if name in (run.hero, run.reference) and one.axis.name in rows:
                rows[one.axis.name][f"least {name}"] = float(np.nanmin(y))
    every = [name for row in rows.values() for name in (run.hero, run.reference, *row) if name in row]
    names = dict.fromkeys(name for name in every if not name.startswith("least "))
    heads = {name: Column(name, group=f"errors of at most {words}, any brightness") for name in names}
    least = {f"least {name}": name for name in (run.hero, run.reference)}
    heads |= {key: run.column(run.goal.name, name, f"least {words_of(run.goal)}") for key, name in least.items()}
    return Answer(
        "errors_over", Section("By what varies", Table(heads, rows, head="over")), facts, sections, of_all=True
    )


def _without_gaps(one: Series, spans: Sequence[Span]) -> list[Span]:
    """Return ranges, joined over gaps that are too narrow to see."""
    joined_up: list[Span] = []
    for low, high in spans:
        near = joined_up and one.axis.percent(low) - one.axis.percent(joined_up[-1][1]) < _SMALLEST_GAP
        joined_up[-1:] = [(joined_up[-1][0], high)] if near else [*joined_up[-1:], (low, high)]
    return joined_up


def crossed(run: Run, one: Series, quantity: str, name: str, mask: Any) -> list[Span]:
    """Return ranges in which something holds, by the run's refined crossings where they fit, else by the numbers."""
    known = run.output.tables.get(CROSSINGS)
    if known is not None:
        own = (known["series"] == one.name) & (known["key"] == one.key)
        of = known[own & (known["quantity"] == quantity) & (known["name"] == name)]
        if len(of) % 2 == int(mask[0] != mask[-1]):
            return one.spans(mask, np.sort(of["at"].to_numpy(dtype=float)).tolist())
    return one.above(np.where(mask, 1.0, -1.0), 0.0)


def full_from(run: Run, one: Series) -> tuple[Column, Mapping[str, float]]:
    """Return the first number of a series at which a lamp fills a pixel of each design, in its last capture."""
    rows = run.rows.merge(run.output.tables[SATURATED][["design_id", "full_signals"]], on="design_id")
    rows = rows[rows["scenario"].isin([*one.scenes]) & (rows["full_signals"] > 0)]
    column = Column("full from", one.axis.unit, "more", "from here on a lamp fills a pixel, even in its last capture")
    first = rows["scenario"].map(one.scenes).astype(float).groupby(rows["name"]).min()
    return column, {str(name): float(value) for name, value in first.items()}


def over_numbers(
    run: Run, one: Series, lines: Mapping[str, Line] | None = None, title: str = "", unit: str | None = None
) -> list[Lines]:
    """Return the goal, or other lines, over a series; logarithmic where it nearly vanishes."""
    lines = run.over(one, run.goal.name) if lines is None else lines
    if not lines:
        return []
    unit, every = unit_of(run.goal) if unit is None else unit, np.concatenate([*lines.values()])
    log = bool(unit == DN and np.nanmax(every) > 30 * max(float(np.nanmin(every)), 1e-9))
    least = _LEAST_DRAWN if log else -np.inf
    y = axis_over(title or words_of(run.goal), unit, np.maximum(every, least), log=log)
    drawn = {name: (one.x, np.maximum(line, least)) for name, line in lines.items()}
    return [Lines(y.label[:1].upper() + y.label[1:], one.axis, y, run.hero, lines=drawn)]


def series(run: Run, kind: str = "series") -> Answer:
    """Where a design has more than the reference, over each series, and its figures at the ends."""
    found = [section for one in run.series if (section := over(run, one, run.over(one, run.goal.name))) is not None]
    if not found:
        return trade_off(run)
    least, most = (amount(end, run.series[0].axis.unit, trim=True) for end in run.series[0].whole)
    facts = {
        "over": f"from {least} to {most}",
        "others": others_over(run, found[0].table),
    }
    if len(found) == 1 or kind not in ("series", "least"):
        return Answer(kind, found[0], facts, found[1:])
    return Answer("several", several(run), facts, found, of_all=True)


def others_over(run: Run, table: Table | None) -> list[str]:
    """Return where further designs are ahead in a part of the numbers."""
    cells = {} if table is None else {name: table.cell(name, "ahead") for name in table.rows}
    part = {name: cell.text for name, cell in cells.items() if cell.track and not cell.text.startswith("any of")}
    names = [name for name in part if name not in (run.hero, run.reference)][:_MOST_OTHERS]
    last = "" if table is None else table.columns["last"].label
    return (
        [f"{name} {part[name]} ({table.cell(name, 'last').text} {last})" for name in names] if table is not None else []
    )


def several(run: Run) -> Section:
    """Return a row for each series: where the design that answers is ahead, and what it has at the ends."""
    rows: dict[str, dict[str, Any]] = {}
    for one in run.series:
        lines = run.over(one, run.goal.name)
        if run.hero not in lines:
            continue
        its, of = lines[run.hero], lines.get(run.reference, np.zeros(len(one.x)))
        low, high = (amount(end, one.axis.unit, trim=True) for end in one.whole)
        times = its / np.where(of > 0, of, np.nan)
        rows[f"{one.axis.name}{f', {one.name}' if one.name else ''}"] = {
            "from": low,
            "to": high,
            "ahead": one.marks(_ahead(run, one, run.hero, its, of), 2).text,
            "first": float(its[0]),
            "last": float(its[-1]),
            "times": span([float(np.nanmin(times)), float(np.nanmax(times))]) if np.isfinite(times).any() else "",
        }
    goal, group = run.goal, f"{words_of(run.goal)} of {run.hero}"
    columns = {
        "from": Column("from"),
        "to": Column("to"),
        "ahead": Column(f"more than {run.reference}"),
        "first": Column("at the first", unit_of(goal), group=group),
        "last": Column("at the last", unit_of(goal), group=group),
        "times": Column(f"times {run.reference}"),
    }
    return Section("By what varies", Table(columns, rows, head="over"))


def over(run: Run, one: Series, lines: Mapping[str, Line]) -> Section | None:
    """Return a separation over a series: where each design is ahead, figures at some numbers, and what pulses do."""
    if run.hero not in lines:
        return None
    of = lines.get(run.reference, np.zeros(len(one.x)))
    ahead: dict[str, Marks] = {run.reference: Marks()} if run.reference in lines else {}
    for name, y in lines.items():
        if name != run.reference:
            ahead[name] = one.marks(_ahead(run, one, name, y, of), 2)
    columns: Columns = {"ahead": (Column(f"ahead of {run.reference}", axis=one.axis), ahead)}
    for key, at in (("first", 0), ("middle", len(one.x) // 2), ("last", -1)):
        label = f"at {amount(float(one.x[at]), one.axis.unit, trim=True)}"
        columns[key] = (
            run.column(run.goal.name, label, words_of(run.goal)),
            {name: float(y[at]) for name, y in lines.items()},
        )
    lowest = {name: min([float(np.nanmin(y)), *run.worst(one, run.goal.name, name)]) for name, y in lines.items()}
    columns["least"] = replace(run.column(run.goal.name, "least", words_of(run.goal)), promise=True), lowest
    panels: list[Panel] = [*over_numbers(run, one, lines)]
    for more_of in gathered("OVER", "page").values():
        more, drawn = more_of(run, one)
        columns |= more
        panels += drawn
    columns |= {"full": full_from(run, one), "light": run.figure(LIGHT)}
    title = f"Over {one.axis.name}{f', {one.name}' if len(run.series) > 1 and one.name else ''}"
    return Section(title, Table.of(columns, reference=run.reference, hero=run.hero), tuple(panels))


def _ahead(run: Run, one: Series, name: str, y: Line, of: Line) -> list[Span]:
    """Return where a design has more than the reference, by the run's refined crossings where they fit."""
    y = np.where(np.maximum(y, of) >= (1.0 if run.goal.unit == DN else 0.0), y, -np.inf)
    known, mask = run.output.tables.get(CROSSINGS), y > of * (1 + SAME)
    if known is not None and "against" in known:
        pair = [name, run.reference]
        rows = known[(known["series"] == one.name) & (known["key"] == one.key) & (known["quantity"] == run.goal.name)]
        rows = rows[rows["name"].isin(pair) & rows["against"].isin(pair)]
        if len(rows) and len(rows) % 2 == int(mask[0] != mask[-1]):
            return _without_gaps(one, one.spans(mask, np.sort(rows["at"].to_numpy(dtype=float)).tolist()))
    return _without_gaps(one, one.above(y, of * (1 + SAME)))


def worst(run: Run) -> Answer:
    """Return the worst case beside the nominal one, yields, and when a design falls below the reference."""
    goal, nominal = run.goal.name, run.goal.of
    order = sorted(run.here, key=lambda name: -np.nan_to_num(run.here[name][goal]))
    spans = {name: (run.value(name, goal) or 0.0, run.value(name, nominal) or 0.0) for name in order}
    level = run.value(run.reference, goal)
    axis = axis_over("worst to nominal", unit_of(run.goal), np.ravel([*spans.values()]), log=False, level=level)
    columns: Columns = {
        "track": (Column("worst to nominal", axis=axis), {name: Marks([ends]) for name, ends in spans.items()}),
        "worst": run.figure(goal, "worst case"),
        "nominal": run.figure(nominal, "nominal"),
        "breaks": (
            Column(f"below {run.reference} from", "times", "more", "times the stated range of lamps and production"),
            run.values("breaks_at"),
        ),
        "light": run.figure(LIGHT),
        "meets": meets(run),
    }
    table = Table.of(with_bound(run, "worst", columns), reference=run.reference, hero=run.hero)
    panels, traced = [*filters(run)], run.output.tables.get(FRONT)
    lead = Section("In the worst case", table, (*panels, *_worst_front(run, traced, level)))
    best = max(spans, key=lambda name: spans[name][1])
    costs = f"{change(spans[run.hero][1], spans[best][1])} against {best}" if best != run.hero else ""
    return Answer("worst", lead, {"costs": costs}, [Section("The price", figures(run))])


def _worst_front(run: Run, traced: Any, level: float | None) -> list[Lines]:
    """Return the worst case over the light that the modified pixel keeps."""
    if traced is None or len(traced) < 2:
        return []
    lines = {run.hero: traced["objective"].to_numpy(dtype=float), "proven": traced["upper_bound"].to_numpy(dtype=float)}
    x = traced["sensitivity_min"].to_numpy(dtype=float)
    known = {name: (x, y) for name, y in lines.items() if np.isfinite(y).any()}
    y_axis = axis_over(words_of(run.goal), unit_of(run.goal), np.concatenate([*lines.values()]), log=False, level=level)
    across = axis_over("light that the pixel keeps", SHARE, x, zero=False)
    return [Lines(f"What it costs in light: {y_axis.label}", across, y_axis, run.hero, lines=known)]


Kind = tuple[int, Callable[[Run], Any], Callable[[Run], Answer]]
KINDS: dict[str, Kind] = {
    "least": (
        20,
        lambda run: run.series and run.facts.search is not None and run.facts.search.scenarios > 1,
        lambda run: series(run, "least"),
    ),
    "errors": (
        30,
        lambda run: run.series and run.study.recognition is not None and CHROMATIC_ERROR in run.rows,
        errors,
    ),
    "worst": (50, lambda run: run.goal.extreme == WORST_CASE, worst),
    "series": (60, lambda run: run.series and run.facts.search is None, series),
    "trade_off": (80, lambda _: True, trade_off),
}
"""Kinds of answers with their ranks: a page has the first that its study calls for."""


def answer_of(run: Run) -> Answer:
    """Return the answer of a run."""
    kinds = sorted((KINDS | gathered("KINDS", "page")).values(), key=lambda kind: kind[0])
    answer: Answer = next(make(run) for _, called, make in kinds if called(run))
    return answer
