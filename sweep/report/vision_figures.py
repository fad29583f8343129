"""Figures of the benchmark of vision: errors over distance, what predicts them, and images that were read wrongly."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..results.output import Output
from ..results.tables import VISION_MISREAD
from .figures import CURVE_CYCLE, Drawing, canvas_grid, empty_figure
from .vision import OBSERVER, READER_NAMES, Benchmark, said_interval
from .vision_ranks import PREDICTORS, Ranks, ranks_of

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

_COLUMNS, _ROWS = 8, 5
_LEAST_ERROR = 1e-12
"""Where an error that is less is drawn."""
_MARKERS = "osD^vP*X<>hp"
_LABELS = {"csd": "smallest CSD / DN", "dprime": "smallest d'", "pair_error": "pairwise error", OBSERVER: "its error"}


@dataclass(frozen=True)
class ConditionsFigure:
    """Conditions of a benchmark and what predicts their errors: designs, illuminance of each level (lux), the judge."""

    designs: Sequence[str]
    levels: Mapping[str, float]
    judge: str
    ranks: Ranks


@dataclass(frozen=True)
class MisreadFigure:
    """Images that were read wrongly: a title and the false colors, ndarray[rows, columns, 3] of uint8, of each."""

    titles: Sequence[str]
    pixels: Sequence[NDArray[np.uint8]]


def vision_drawings(output: Output, benchmark: Benchmark) -> Iterator[tuple[str, str, Drawing]]:
    """(file name, caption, drawing) of a benchmark."""
    ranks = ranks_of(benchmark)
    levels = {name: level.illuminance_lx for name, level in benchmark.vision.levels.items()}
    figure = ConditionsFigure(benchmark.designs, levels, benchmark.judge, ranks)
    who = READER_NAMES[benchmark.judge]
    yield "vision-errors", f"Images that the {who} reads wrongly, over the distance", partial(_draw_errors, figure)
    if ranks.between:
        yield "vision-ranks", f"What predicts the {who}'s errors", partial(_draw_ranks, figure)
    pictures = output.vision[VISION_MISREAD]
    if len(pictures):
        caption = f"Images that the {who} read wrongly, lenses shuffled, in false colors: what it is > what was said"
        yield "vision-misread", caption, partial(_draw_misread, _misread_figure(benchmark, pictures))


def _misread_figure(benchmark: Benchmark, pictures: pd.DataFrame) -> MisreadFigure:
    """Choose a few images of every design for the contact sheet."""
    per_design = max(1, _COLUMNS * _ROWS // pictures["name"].nunique())
    shown = pictures.groupby("name", sort=False).head(per_design).head(_COLUMNS * _ROWS).to_dict("records")
    answers = benchmark.images
    answers = answers[(answers["order"] == "shuffled") & (answers["lamps"] == "unseen")]
    known = {(row["name"], row["seed"], row["image"]): row for row in answers.to_dict("records")}
    titles = []
    for row in shown:
        answer = known[row["name"], row["seed"], row["image"]]
        where = f"{answer['distance_m']:g} m, {answer['level']}"
        titles.append(f"{row['name']}\n{where}\n{answer['state']} > {answer[benchmark.judge]}")
    pixels = [np.frombuffer(r["pixels"], dtype=np.uint8).reshape(r["rows"], r["columns"], 3) for r in shown]
    return MisreadFigure(titles, pixels)


def _draw_errors(shown: ConditionsFigure) -> Figure:
    """A panel per level: the judge's error with each design; dashed the ideal observer's."""
    levels = list(shown.levels)
    figure, panels = canvas_grid(1, len(levels), 4.2 * len(levels), 4.2)
    for axes, level in zip(panels, levels, strict=True):
        for design, color in zip(shown.designs, CURVE_CYCLE * 4, strict=False):
            own = sorted(
                (c for c in shown.ranks.conditions if (c.design, c.level) == (design, level)),
                key=lambda c: c.distance_m,
            )
            x = [c.distance_m for c in own]
            axes.plot(x, [100 * c.error for c in own], "o-", color=color, label=design, linewidth=1.4, markersize=3.5)
            if all(OBSERVER in c.predictors for c in own):
                axes.plot(x, [100 * c.predictors[OBSERVER] for c in own], "--", color=color, linewidth=1.0)
        axes.set_title(f"{level}, {shown.levels[level]:g} lx")
        axes.set_xlabel("distance / m")
        axes.set_ylim(bottom=0)
    panels[0].set_ylabel("images read wrongly / %")
    told = "dashed: ideal observer" if shown.judge != OBSERVER else None
    panels[-1].legend(
        title=told, fontsize=8, title_fontsize=8, loc="upper left", bbox_to_anchor=(1.01, 1.0), frameon=False
    )
    return figure


def _draw_ranks(shown: ConditionsFigure) -> Figure:
    """A panel per predictor: a point per design, distance and level; the color is the design, the marker the level."""
    names, levels = list(shown.ranks.everywhere), list(shown.levels)
    figure, panels = canvas_grid(1, len(names), 3.7 * len(names), 4.4)
    for axes, name in zip(panels, names, strict=True):
        for design, color in zip(shown.designs, CURVE_CYCLE * 4, strict=False):
            for level, marker in zip(levels, _MARKERS, strict=False):
                own = [c for c in shown.ranks.conditions if (c.design, c.level) == (design, level)]
                label = design if level == levels[0] else None
                least = _LEAST_ERROR if name == "pair_error" else 0.0
                x, y = [max(c.predictors[name], least) for c in own], [100 * c.error for c in own]
                axes.plot(x, y, marker, color=color, markersize=4, label=label, alpha=0.8)
        if name in ("csd", "dprime"):
            axes.set_xscale("symlog")
        elif name == "pair_error":
            axes.set_xscale("log")
        between, everywhere = shown.ranks.between[name], shown.ranks.everywhere[name]
        axes.set_title(
            f"{PREDICTORS[name]}\nrank correlation between CFAs {said_interval(between)}\n"
            f"over everything {said_interval(everywhere)}",
            fontsize=8,
        )
        axes.set_xlabel(_LABELS[name])
    panels[0].set_ylabel(f"images that the {READER_NAMES[shown.judge]} reads wrongly / %")
    panels[-1].legend(fontsize=8, loc="upper left", bbox_to_anchor=(1.01, 1.0), frameon=False)
    return figure


def _draw_misread(shown: MisreadFigure) -> Figure:
    """Draw the contact sheet."""
    rows = -(-len(shown.titles) // _COLUMNS)
    figure = empty_figure(1.5 * _COLUMNS, 1.85 * rows)
    for at, (title, pixels) in enumerate(zip(shown.titles, shown.pixels, strict=True), 1):
        axes = figure.add_subplot(rows, _COLUMNS, at)
        axes.imshow(pixels, interpolation="nearest")
        axes.set_axis_off()
        axes.set_title(title, fontsize=6)
    return figure
