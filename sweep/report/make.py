"""Draw the figures and write the HTML report of a finished run."""

from __future__ import annotations

import base64
import math
from collections.abc import Iterator

import pandas as pd
from jinja2 import Environment, PackageLoader, StrictUndefined

from ..figures import draw_curves, draw_pareto, rendered
from ..store import atomic, write_text
from . import content
from .outputs import Output
from .summary import answer_sentences, summary_lines

REPORT = "report.html"


def make_report(output: Output) -> None:
    """Write `pareto.png`, `pareto.svg` and the self-contained `report.html`; errors as for `store.atomic`."""
    images = list(_images(output))
    page = (
        _environment()
        .get_template("report.html.j2")
        .render(
            study=output.study,
            answer=answer_sentences(output),
            images=images,
            comparison=_rows(content.comparison_table(output)),
            best=_rows(content.best_table(output)),
            geometry=_rows(content.geometry_table(output)),
            constraints={name: str(bound) for name, bound in output.constraints.items()},
            summary=summary_lines(output),
            provenance=output.provenance,
        )
    )
    write_text(page, output.folder / REPORT)


def _images(output: Output) -> Iterator[tuple[str, str]]:
    """(caption, data URI) of each figure; the trade-off is kept as files, too."""
    scenario = next(iter(output.study["scenarios"]))
    cfas = list(dict.fromkeys(str(m["cfa"]) for m in content.modifications(output)))
    for number, cfa in enumerate(cfas or [None]):
        drawn = draw_pareto(content.pareto_figure(output, scenario, cfa))
        stem = "pareto" if number == 0 else f"pareto-{number + 1}"
        for kind in ("png", "svg"):
            with atomic(output.folder / f"{stem}.{kind}") as hidden:
                hidden.write_bytes(rendered(drawn, kind))
        yield f"Trade-off{f' of {cfa}' if cfa else ''}", _data_uri(rendered(drawn, "png"))
    for cfa in cfas:
        yield f"Filters of {cfa}", _data_uri(rendered(draw_curves(content.filters_figure(output, cfa)), "png"))
    yield "Sensor", _data_uri(rendered(draw_curves(content.sensor_figure(output)), "png"))
    yield "Signals", _data_uri(rendered(draw_curves(content.lights_figure(output)), "png"))


def _data_uri(png: bytes) -> str:
    return "data:image/png;base64," + base64.b64encode(png).decode("ascii")


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
