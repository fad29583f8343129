"""Figures of the benchmark of vision: errors over distance, what predicts them, and images that were read wrongly."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..results.output import Output
from ..results.tables import VISION_MISREAD
from ..vision.scenes import SHUFFLED, UNSEEN
from .figures import CURVE_CYCLE, Drawing, canvas_grid, legend_beside, panel_grid
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


def vision_drawings(output: Output, benchmark: Benchmark) -> Iterator[tuple[str, str, Drawing]]:
    """(file name, caption, drawing) of a benchmark."""
    ranks = ranks_of(benchmark)
    levels = {name: level.illuminance_lx for name, level in benchmark.vision.levels.items()}
    who = READER_NAMES[benchmark.judge]
    errors = partial(_draw_errors, ranks.conditions, levels, benchmark.judge)
    yield "vision-errors", f"Images that the {who} reads wrongly, over the distance", errors
    if ranks.between:
        yield "vision-ranks", f"What predicts the {who}'s errors", partial(_draw_ranks, ranks, list(levels), who)
    pictures = output.vision[VISION_MISREAD]
    if len(pictures):
        caption = f"Images that the {who} read wrongly, lenses shuffled, in false colors: what it is > what was said"
        yield "vision-misread", caption, partial(_draw_misread, _misread(benchmark, pictures))


def _misread(benchmark: Benchmark, pictures: pd.DataFrame) -> list[tuple[str, NDArray[np.uint8]]]:
    """Title and false colors, ndarray[rows, columns, 3], of a few images of every design."""
    per_design = max(1, _COLUMNS * _ROWS // pictures["name"].nunique())
    shown = pictures.groupby("name", sort=False).head(per_design).head(_COLUMNS * _ROWS)
    answers = benchmark.images
    answers = answers[(answers["order"] == SHUFFLED) & (answers["lamps"] == UNSEEN)]
    keys = ["name", "seed", "image"]
    columns = [*keys, "distance_m", "level", "state", benchmark.judge]
    rows = shown[[*keys, "rows", "columns", "pixels"]].merge(answers[columns], on=keys, how="left").to_dict("records")
    return [
        (
            f"{row['name']}\n{row['distance_m']:g} m, {row['level']}\n{row['state']} > {row[benchmark.judge]}",
            np.frombuffer(row["pixels"], dtype=np.uint8).reshape(row["rows"], row["columns"], 3),
        )
        for row in rows
    ]


def _draw_errors(conditions: pd.DataFrame, levels: Mapping[str, float], judge: str) -> Figure:
    """A panel per level: the judge's error with each design; dashed the ideal observer's."""
    figure, panels = canvas_grid(1, len(levels), 4.2 * len(levels), 4.2)
    for axes, (level, lux) in zip(panels, levels.items(), strict=True):
        rows = conditions[conditions["level"] == level].sort_values("distance_m")
        for design, color in zip(conditions["design"].unique(), CURVE_CYCLE * 4, strict=False):
            line = rows[rows["design"] == design]
            style: dict[str, Any] = {"color": color, "label": design, "linewidth": 1.4, "markersize": 3.5}
            axes.plot(line["distance_m"], 100 * line["error"], "o-", **style)
            if OBSERVER in line:
                axes.plot(line["distance_m"], 100 * line[OBSERVER], "--", color=color, linewidth=1.0)
        axes.set(title=f"{level}, {lux:g} lx", xlabel="distance / m")
        axes.set_ylim(bottom=0)
    panels[0].set_ylabel("images read wrongly / %")
    legend_beside(panels[-1], "dashed: ideal observer" if judge != OBSERVER else None)
    return figure


def _draw_ranks(ranks: Ranks, levels: Sequence[str], who: str) -> Figure:
    """A panel per predictor: a point per design, distance and level; the color is the design, the marker the level."""
    names, designs = list(ranks.everywhere), ranks.conditions["design"].unique()
    figure, panels = canvas_grid(1, len(names), 3.7 * len(names), 4.4)
    for axes, name in zip(panels, names, strict=True):
        for design, color in zip(designs, CURVE_CYCLE * 4, strict=False):
            for level, marker in zip(levels, _MARKERS, strict=False):
                dots = ranks.conditions[(ranks.conditions[["design", "level"]] == [design, level]).all(axis=1)]
                x = dots[name].clip(lower=_LEAST_ERROR if name == "pair_error" else 0.0)
                label = str(design) if level == levels[0] else None
                axes.plot(x, 100 * dots["error"], marker, color=color, markersize=4, label=label, alpha=0.8)
        if name != OBSERVER:
            axes.set_xscale("log" if name == "pair_error" else "symlog")
        between, everywhere = said_interval(ranks.between[name]), said_interval(ranks.everywhere[name])
        title = f"{PREDICTORS[name]}\nrank correlation between CFAs {between}\nover everything {everywhere}"
        axes.set_title(title, fontsize=8)
        axes.set_xlabel(_LABELS[name])
    panels[0].set_ylabel(f"images that the {who} reads wrongly / %")
    legend_beside(panels[-1])
    return figure


def _draw_misread(images: Sequence[tuple[str, NDArray[np.uint8]]]) -> Figure:
    """Draw the contact sheet."""
    figure, panels = panel_grid(len(images), _COLUMNS, (1.5, 1.85), (0, 0))
    for axes, (title, pixels) in zip(panels, images, strict=True):
        axes.imshow(pixels, interpolation="nearest")
        axes.set_axis_off()
        axes.set_title(title, fontsize=6)
    return figure
