"""Draw the figures and write the HTML report of a finished run."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import partial
from itertools import chain, islice
from typing import Any

import pandas as pd
import pyarrow as pa

from ..base.types import Parallel, delayed, in_turn
from ..metrics.objective import COMBINED
from ..results.lock import locked
from ..results.manifest import Manifest
from ..results.output import Output
from ..results.tables import FIGURES, REPORT, VISION_FIGURES, csv_of, encoded, is_drawn
from . import signal_figures as signals
from . import tables
from . import values as content
from .answer import answer_parts, headline_numbers
from .captures import capture_drawings
from .colors import color_drawings
from .figures import Drawing, draw_curves, pictures_of
from .lamps import lamp_drawings, lamp_table
from .leaders import leaders_of
from .noise import all_series, recognition_table
from .over_series import searched_series
from .page_data import payload
from .pages import inlined, page, rows, script
from .parameter_map import map_drawing
from .price import price_table
from .scenes import scene_groups, scene_table
from .scorecard import draw_scorecard, scorecard
from .sensor_map import map_drawings
from .series import draw_series, scene_in_words
from .stated import stated_lines
from .summary import counts_line
from .tables import PUBLISHED_CSV, PUBLISHED_PARQUET, comparison_with_published
from .terms import format_constraints, term_definitions
from .trade_off import draw_trade_off, overview_figure, pareto_figure, traded_cfas

_MOST_SERIES = 3
"""Figures over scenarios that the page shows unfolded."""
_RASTERED = ("cfas", "pareto")
"""Pictures that are also PNG, for slides."""
_SHOWN = {
    "images": ("tiles", "sensor", "signals", "chart"),
    "lamp_images": ("regions",),
    "vision_images": (VISION_FIGURES,),
    "score_images": ("scorecard", "color-noise", "rendered"),
    "map_images": ("places-",),
    "parameter_images": ("map",),
}
"""Places of the page -> how the names of the pictures there begin; the page draws all other figures itself."""


def make_report(output: Output, *, repair: bool = False, parallel: Parallel = in_turn) -> None:
    """Write `pareto.png`/`.svg`, `figures/*`, the comparison with published figures and `report.html`.

    Raises OutputError if a file of others has one of the names, or the disk refuses.
    """
    with locked(output.folder):
        manifest = Manifest(output.folder)
        listed = [name for name in manifest.files if is_drawn(name)]
        wrong = manifest.wrong({REPORT, *listed})
        if repair and not wrong:
            return
        names = wrong if repair and REPORT not in wrong else None
        contents = _contents(output, names, parallel)
        manifest.write({n: content for n, content in contents.items() if not repair or n in wrong or n not in listed})
        manifest.remove(n for n in listed if n not in contents and (names is None or n in names))


def _contents(output: Output, shown_names: Iterable[str] | None, parallel: Parallel) -> dict[str, bytes]:
    """Return the files of the report with their content: some of them, or all, since the page holds every picture."""
    contents, drawn = dict[str, bytes](), []
    images: dict[str, list[tuple[str, str]]] = {place: [] for place in _SHOWN}
    for name, caption, figure in drawings(output):
        where = name if name.startswith(("cfas", "pareto")) else f"{FIGURES}/{name}"
        kinds = ("png", "svg") if name in _RASTERED else ("svg",)
        if shown_names is None or {f"{where}.{kind}" for kind in kinds} & {*shown_names}:
            drawn.append((name, caption, where, figure, kinds))
    pictures = parallel(delayed(pictures_of, figure, kinds) for *_, figure, kinds in drawn)
    begun = [*islice(pictures, 1)]  # workers make the others while the page is written
    published = comparison_with_published(output)
    parts = _parts(output, published) if shown_names is None else {}
    for (name, caption, where, *_), by_kind in zip(drawn, chain(begun, pictures), strict=True):
        contents |= {f"{where}.{kind}": content for kind, content in by_kind.items()}
        for place, names in _SHOWN.items():
            if name.startswith(names):
                images[place].append((caption, inlined(by_kind["svg"])))
    if len(published):
        contents[PUBLISHED_CSV] = csv_of(published).encode("utf-8")
        contents[PUBLISHED_PARQUET] = encoded(pa.Table.from_pandas(published, preserve_index=False))
    if shown_names is None:
        contents[REPORT] = page("report.html.j2", **parts, **images).encode("utf-8")
    return contents


def _parts(output: Output, published: pd.DataFrame) -> dict[str, Any]:
    """Return the content of the page without its pictures."""
    drawn = payload(output)
    answer, further = answer_parts(output)
    over_all = len(output.scenarios) == 1 or searched_series(output) is not None
    series_first = bool(drawn["series"]) and output.best.empty
    return {
        "output": output,
        "study": output.study,
        "card": scorecard(output),
        "card_first": output.best.empty and not series_first and output.study.tasks is not None,
        "objective": _objective(output),
        "numbers_in": "" if over_all else f"in {scene_in_words(leaders_of(output).scenario)}",
        "series_first": series_first,
        "most_series": _MOST_SERIES,
        "terms_first": series_first and drawn["series"][0]["y_label"] == output.trade_off[0].axis,
        "answer": answer,
        "stated": stated_lines(output),
        "further": further,
        "numbers": headline_numbers(output),
        "price": rows(price_table(output)),
        "counts": counts_line(output),
        "interactive": drawn,
        "plotly": script("plotly-gl2d.min.js"),
        "script": script("report.js"),
        "scenes": rows(scene_table(scene_groups(output))),
        "lamps": rows(lamp_table(output)),
        "vision": _vision(output),
        "comparison": rows(tables.comparison_table(output)),
        "best": rows(tables.best_table(output)),
        "recognition": rows(recognition_table(output)),
        "left_out": rows(tables.costliest_omission(output)),
        "geometry": rows(tables.geometry_table(output)),
        "published": rows(published),
        "constraints": format_constraints(output),
        "terms": term_definitions(output),
        "provenance": output.provenance.model_dump(mode="json"),
    }


def _vision(output: Output) -> list[tuple[str, list[list[str]]]]:
    """Return title and rows of each table of the benchmark of vision; none if the study has none."""
    if output.study.vision is None:
        return []
    from .vision_report import vision_parts  # noqa: PLC0415  (only where a study asks for images)

    return [(title, rows(table)) for title, table in vision_parts(output).items()]


def drawings(output: Output) -> Iterator[tuple[str, str, Drawing]]:
    """Yield name, caption and drawing of all pictures."""
    yield from _drawings(output)
    yield from _vision_drawings(output)


def _vision_drawings(output: Output) -> Iterator[tuple[str, str, Drawing]]:
    """Yield drawings of the benchmark of vision; none if the study has none."""
    if output.study.vision is not None:
        from .vision_report import vision_drawings  # noqa: PLC0415  (only where a study asks for images)

        yield from vision_drawings(output)


def _objective(output: Output) -> str:
    """Return the objective in words, and its column if it is one."""
    name = output.goal.name
    words = str(output.objective) if output.goal.words == name else f"the {output.goal.words}"
    return words if name in (words, COMBINED) else f"{words} ({name} in the files)"


def _drawings(output: Output) -> Iterator[tuple[str, str, Drawing]]:
    """Yield all drawings, the slowest first, so that no core waits for it."""
    scenario = output.scenarios[0]
    yield "cfas", "All CFAs", partial(draw_trade_off, overview_figure(output, scenario))
    for number, cfa in enumerate(traded_cfas(output), 1):
        figure = partial(draw_trade_off, pareto_figure(output, scenario, cfa))
        yield ("pareto" if number == 1 else f"pareto-{number}"), f"Trade-off of {cfa}", figure
    for number, series in enumerate(all_series(output), 1):
        yield f"series-{number}", series.title, partial(draw_series, series)
    yield from capture_drawings(output)
    card = scorecard(output)
    if card is not None:
        yield "scorecard", f"Every figure relative to {card.names[0]}", partial(draw_scorecard, card)
    yield from map_drawings(output)
    yield from map_drawing(output)
    yield from color_drawings(output)
    yield from lamp_drawings(output)
    tiles = partial(signals.draw_tiles, signals.first_mosaics(output), signals.replaced_channels(output))
    yield "tiles", "Tiles of the CFAs; a hatched pixel is modified", tiles
    yield "sensor", "Quantum efficiency of the sensor", partial(draw_curves, content.sensor_figure(output))
    yield "signals", "Spectra of the signals", partial(draw_curves, content.lights_figure(output))
    yield "chart", "The color checker chart", partial(signals.draw_chart, signals.chart_patches(output))
