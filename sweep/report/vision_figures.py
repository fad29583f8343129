"""Figures of the benchmark of vision: errors over distance, what predicts them, and images that were read wrongly."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from ..results.output import Output
from ..results.tables import VISION_MISREAD
from .figures import CURVE_CYCLE, Drawing, canvas_grid, empty_figure
from .vision import OBSERVER, READER_NAMES, Benchmark, said_interval
from .vision_ranks import PREDICTORS, Ranks, ranks_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_COLUMNS, _ROWS = 8, 5
_LEAST_ERROR = 1e-12
"""Where an error that is less is drawn."""
_MARKERS = "osD^vP*X<>hp"
_LABELS = {"csd": "smallest CSD / DN", "dprime": "smallest d'", "pair_error": "pairwise error", OBSERVER: "its error"}


def vision_drawings(output: Output, benchmark: Benchmark) -> Iterator[tuple[str, str, Drawing]]:
    """(file name, caption, drawing) of a benchmark."""
    ranks = ranks_of(benchmark)
    who = READER_NAMES[benchmark.judge]
    yield (
        "vision-errors",
        f"Images that the {who} reads wrongly, over the distance",
        partial(_draw_errors, benchmark, ranks),
    )
    if ranks.between:
        yield "vision-ranks", f"What predicts the {who}'s errors", partial(_draw_ranks, benchmark, ranks)
    pictures = output.vision[VISION_MISREAD]
    if len(pictures):
        caption = f"Images that the {who} read wrongly, lenses shuffled, in false colors: what it is > what was said"
        yield "vision-misread", caption, partial(_draw_misread, benchmark, pictures)


def _draw_errors(benchmark: Benchmark, ranks: Ranks) -> Figure:
    """A panel per level: the judge's error with each design; dashed the ideal observer's."""
    levels = list(benchmark.vision.levels)
    figure, panels = canvas_grid(1, len(levels), 4.2 * len(levels), 4.2)
    for axes, level in zip(panels, levels, strict=True):
        for design, color in zip(benchmark.designs, CURVE_CYCLE * 4, strict=False):
            own = sorted(
                (c for c in ranks.conditions if (c.design, c.level) == (design, level)), key=lambda c: c.distance_m
            )
            x = [c.distance_m for c in own]
            axes.plot(x, [100 * c.error for c in own], "o-", color=color, label=design, linewidth=1.4, markersize=3.5)
            if all(OBSERVER in c.predictors for c in own):
                axes.plot(x, [100 * c.predictors[OBSERVER] for c in own], "--", color=color, linewidth=1.0)
        axes.set_title(f"{level}, {benchmark.vision.levels[level].illuminance_lx:g} lx")
        axes.set_xlabel("distance / m")
        axes.set_ylim(bottom=0)
    panels[0].set_ylabel("images read wrongly / %")
    told = "dashed: ideal observer" if benchmark.judge != OBSERVER else None
    panels[-1].legend(
        title=told, fontsize=8, title_fontsize=8, loc="upper left", bbox_to_anchor=(1.01, 1.0), frameon=False
    )
    return figure


def _draw_ranks(benchmark: Benchmark, ranks: Ranks) -> Figure:
    """A panel per predictor: a point per design, distance and level; the color is the design, the marker the level."""
    names, levels = list(ranks.everywhere), list(benchmark.vision.levels)
    figure, panels = canvas_grid(1, len(names), 3.7 * len(names), 4.4)
    for axes, name in zip(panels, names, strict=True):
        for design, color in zip(benchmark.designs, CURVE_CYCLE * 4, strict=False):
            for level, marker in zip(levels, _MARKERS, strict=False):
                own = [c for c in ranks.conditions if (c.design, c.level) == (design, level)]
                label = design if level == levels[0] else None
                least = _LEAST_ERROR if name == "pair_error" else 0.0
                x, y = [max(c.predictors[name], least) for c in own], [100 * c.error for c in own]
                axes.plot(x, y, marker, color=color, markersize=4, label=label, alpha=0.8)
        if name in ("csd", "dprime"):
            axes.set_xscale("symlog")
        elif name == "pair_error":
            axes.set_xscale("log")
        between, everywhere = ranks.between[name], ranks.everywhere[name]
        axes.set_title(
            f"{PREDICTORS[name]}\nrank correlation between CFAs {said_interval(between)}\n"
            f"over everything {said_interval(everywhere)}",
            fontsize=8,
        )
        axes.set_xlabel(_LABELS[name])
    panels[0].set_ylabel(f"images that the {READER_NAMES[benchmark.judge]} reads wrongly / %")
    panels[-1].legend(fontsize=8, loc="upper left", bbox_to_anchor=(1.01, 1.0), frameon=False)
    return figure


def _draw_misread(benchmark: Benchmark, pictures: pd.DataFrame) -> Figure:
    """A contact sheet: a few images of every design."""
    each = max(1, _COLUMNS * _ROWS // pictures["name"].nunique())
    some = pictures.groupby("name", sort=False).head(each).head(_COLUMNS * _ROWS)
    answers = benchmark.images
    answers = answers[(answers["order"] == "shuffled") & (answers["lamps"] == "unseen")]
    known = {(row["name"], row["seed"], row["image"]): row for row in answers.to_dict("records")}
    figure = empty_figure(1.5 * _COLUMNS, 1.85 * -(-len(some) // _COLUMNS))
    for at, row in enumerate(some.to_dict("records"), 1):
        axes = figure.add_subplot(-(-len(some) // _COLUMNS), _COLUMNS, at)
        pixels = np.frombuffer(row["pixels"], dtype=np.uint8).reshape(row["rows"], row["columns"], 3)
        axes.imshow(pixels, interpolation="nearest")
        axes.set_axis_off()
        told = known[row["name"], row["seed"], row["image"]]
        title = f"{row['name']}\n{told['distance_m']:g} m, {told['level']}\n{told['state']} > {told[benchmark.judge]}"
        axes.set_title(title, fontsize=6)
    return figure
