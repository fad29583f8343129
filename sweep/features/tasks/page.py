"""Answer and sections of further tasks: times as good as the reference, and color error against noise."""

from __future__ import annotations

import numpy as np

from ...report.answers import Columns, figures, trade_off
from ...report.numbers import SAME, span
from ...report.panels import Answer, Lines, Section, axis_over, styles_of
from ...report.run import Run
from ...report.sections import Sections
from ...report.tables import Axis, Column, Marks, Table
from . import TRADED
from .figures import FIGURES

LIGHTS = {"D65": "daylight", "A": "incandescent", "LED": "white LED", "HPS": "sodium", "LPS": "low-pressure sodium"}
_MOST_OTHERS = 3
_INCANDESCENT = "low_light_lux_a"


def score(run: Run) -> Answer:
    """Each measure of other tasks, times as good as the reference."""
    table = measures(run)
    if not table.rows or run.hero == run.reference:
        return trade_off(run)
    factors = {measure: float(row[run.hero]) for measure, row in table.rows.items()}  # type: ignore[arg-type]
    tasks: dict[str, list[float]] = {}
    for measure, factor in factors.items():
        tasks.setdefault(min((measure.partition(f" {words}")[0] for words in _figure_words()), key=len), []).append(
            factor
        )
    order = sorted(tasks, key=lambda task: min(tasks[task]))
    shown = {task: f"{task} {span(tasks[task])}" for task in order}
    facts = {
        "better": sum(factor > 1 + SAME for factor in factors.values()),
        "worse": sum(factor < 1 - SAME for factor in factors.values()),
        "of": len(factors),
        "gains": [shown[task] for task in reversed(order) if min(tasks[task]) > 1 + SAME],
        "losses": [shown[task] for task in order if min(tasks[task]) < 1 - SAME][:_MOST_OTHERS],
    }
    return Answer(
        "score",
        Section(f"Other tasks, times as good as {run.reference}", table),
        facts,
        [Section("Designs", figures(run))],
        of_all=True,
    )


def _figure_words() -> list[str]:
    """Return the names of figures of tasks."""
    return [figure.words for group in FIGURES.values() for figure in group]


def measures(run: Run) -> Table:
    """Return how many times as good as the reference each design is in each measure of a task."""
    first = {f"task_{figure.what}" for group in FIGURES.values() for figure in group if figure.first}
    factors: dict[str, dict[str, float]] = {}
    styles = styles_of(run.here)
    designs = sorted((name for name in run.here if name != run.reference), key=lambda name: name != run.hero)
    for column in run.output.columns.values():
        values = run.values(column.name)
        if column.metric not in first or column.extreme or not min(values.values()) > 0:
            continue
        if max(values.values()) < 10.0**-column.digits:
            continue
        light = next((light for light in LIGHTS if column.words.endswith(f" {light}")), "")
        words = f"{column.words.removesuffix(f' {light}')}, {LIGHTS[light]}" if light else column.words
        power = 1 if column.direction == "more" else -1
        factors[words] = {name: (values[name] / values[run.reference]) ** power for name in designs}
    every = [factor for row in factors.values() for factor in row.values()]
    axis = Axis("times as good", "", min([0.5, *every]), max([2.0, *every]), True, 1.0)
    tracks = {
        m: Marks((), [(row[name], styles[name].color) for name in reversed(designs)]) for m, row in factors.items()
    }
    columns: Columns = {"track": (Column("times as good", axis=axis), tracks)}
    columns |= {
        name: (Column(name, "", "more", base=1.0), {m: row[name] for m, row in factors.items()}) for name in designs
    }
    return Table.of(columns, hero=run.hero, head="measure")


def tasks(run: Run) -> Sections:
    """Yield the measures of other tasks."""
    if run.study.key("tasks") is not None and (table := measures(run)).rows:
        yield Section(f"Other tasks, times as good as {run.reference}", table)


def colors(run: Run) -> Sections:
    """Yield color error against noise under two lights."""
    traded, panels = run.output.tables.get(TRADED), []
    if traded is None:
        return
    for light, of in list(traded[traded["scenario"] == run.output.scenarios[0]].groupby("light", sort=False))[:2]:
        lines = {
            str(name): (curve["snr"].to_numpy(dtype=float), curve["delta_e_mean"].to_numpy(dtype=float))
            for name, curve in ((name, part.sort_values("snr")) for name, part in of.groupby("name", sort=False))
        }
        x, y = (np.concatenate([line[at] for line in lines.values()]) for at in (0, 1))
        across, up = axis_over("SNR of 18 % gray", "", x, log=True), axis_over("", "", y, log=True)
        title = f"Mean color error ΔE00, {LIGHTS.get(str(light).upper(), light)}"
        panels.append(Lines(title, across, up, run.hero, lines=lines))
    yield Section(
        "Color against noise",
        None,
        tuple(panels),
        "Better is down and to the right: a stronger color matrix multiplies noise.",
    )


def _asked(run: Run) -> bool:
    return run.study.key("tasks") is not None and run.facts.search is None and not run.study.sweeps


KINDS = {"score": (70, _asked, score)}
SECTIONS = {tasks: 60, colors: 70}
PRICES = {
    "low_light_lux_led": "lux for SNR 10, white LED",
    _INCANDESCENT: "lux for SNR 10, incandescent",
    "color_delta_e_mean_d65": "color error ΔE00, daylight",
}
PRICES_IF_LIMITED = {_INCANDESCENT: True}
