"""Draw the figures and write the HTML report of a finished run."""

from __future__ import annotations

import base64
import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

import pandas as pd
import pyarrow as pa
from jinja2 import Environment, PackageLoader, StrictUndefined

from ..figures import draw_chart, draw_clouds, draw_curves, draw_pareto, rendered
from ..objectives import Objective
from ..series import draw_series
from ..store import write_bytes, write_table, write_text
from . import content
from .comparison import PUBLISHED_CSV, PUBLISHED_PARQUET, comparison_with_published
from .noise import noise_figures, recognition_table
from .outputs import Output
from .summary import answer_sentences, summary_lines

if TYPE_CHECKING:
    from matplotlib.figure import Figure

REPORT = "report.html"
FIGURES = "figures"


def make_report(output: Output) -> None:
    """Write `pareto.png`/`.svg`, `figures/*`, the comparison with published figures and `report.html`.

    Errors as for `store.atomic`.
    """
    images = []
    for name, caption, figure in _drawings(output):
        files = {kind: rendered(figure, kind) for kind in ("png", "svg")}
        folder = output.folder if name.startswith("pareto") else output.folder / FIGURES
        for kind, content_bytes in files.items():
            write_bytes(content_bytes, folder / f"{name}.{kind}")
        images.append((caption, "data:image/png;base64," + base64.b64encode(files["png"]).decode("ascii")))
    published = comparison_with_published(output)
    if len(published):
        write_text(published.to_csv(index=False), output.folder / PUBLISHED_CSV)
        write_table(pa.Table.from_pandas(published, preserve_index=False), output.folder / PUBLISHED_PARQUET)
    template = _environment().get_template("report.html.j2")
    page = template.render(
        study=output.study,
        objective=str(Objective.model_validate(output.study["objective"])),
        answer=answer_sentences(output),
        images=images,
        comparison=_rows(content.comparison_table(output)),
        best=_rows(content.best_table(output)),
        recognition=_rows(recognition_table(output)),
        geometry=_rows(content.geometry_table(output)),
        published=_rows(published),
        plans=_rows(content.plan_table(output)),
        constraints={name: str(bound) for name, bound in output.constraints.items()},
        summary=summary_lines(output),
        provenance=output.provenance,
    )
    write_text(page, output.folder / REPORT)


def _drawings(output: Output) -> Iterator[tuple[str, str, Figure]]:
    """(file name, caption, figure) of everything that is drawn."""
    scenario = next(iter(output.study["scenarios"]))
    cfas = list(dict.fromkeys(str(m["cfa"]) for m in content.modifications(output)))
    for number, cfa in enumerate(cfas or [None]):
        figure = draw_pareto(content.pareto_figure(output, scenario, cfa))
        yield ("pareto" if number == 0 else f"pareto-{number + 1}"), f"Trade-off{f' of {cfa}' if cfa else ''}", figure
    for number, cfa in enumerate(cfas):
        yield f"filters-{number + 1}", f"Filters of {cfa}", draw_curves(content.filters_figure(output, cfa))
    for number, series in enumerate([*content.series_figures(output), *noise_figures(output)]):
        yield f"series-{number + 1}", series.title, draw_series(series)
    yield "sensor", "Quantum efficiency of the sensor", draw_curves(content.sensor_figure(output))
    yield "signals", "Spectra of the signals", draw_curves(content.lights_figure(output))
    yield "chart", "The color checker chart", draw_chart(content.chart_figure(output))
    for name, caption, kinds in (
        ("clouds-cfas", "Signals in the channels of the plain CFAs", ("reference",)),
        ("clouds-designs", "Signals in the channels of the named and the found designs", ("design", "search")),
    ):
        rows = content.clouds(output, *kinds)
        if rows:
            yield name, caption, draw_clouds(rows, caption, max(1.0, 1.05 * float(output.points["dn"].max())))


def _rows(table: pd.DataFrame) -> list[list[str]]:
    """Header and cells as text; what does not exist is a dash."""
    if table.empty:
        return []
    body = [[_cell(value) for value in row] for row in table.itertuples(index=False)]
    return [[str(name) for name in table.columns], *body]


def _cell(value: object) -> str:
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return "-"
    return (
        ("yes" if value else "no")
        if isinstance(value, bool)
        else f"{value:g}"
        if isinstance(value, float)
        else str(value)
    )


def _environment() -> Environment:
    loader = PackageLoader("sweep", "templates")
    return Environment(loader=loader, autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
