"""Benchmark of vision in sentences, tables and figures."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ..metrics.share import format_share
from ..results.output import Output
from ..results.tables import VISION_STREET, VISION_STREETS
from ..vision.detections import ALL, precision_scores
from ..vision.readers import OBSERVER
from ..vision.scenes import FIXED, NETWORK, SEEN, SHUFFLED
from ..vision.scores import Interval, costs, macro_f1
from .figures import CURVE_CYCLE, Drawing, canvas_grid, legend_beside, panel_grid
from .vision import (
    PREDICTORS,
    READER_NAMES,
    Benchmark,
    Ranks,
    benchmark_of,
    format_interval,
    format_percent,
    ranks_of,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_COLUMNS, _ROWS = 8, 5
_LEAST_ERROR = 1e-12
"""Where an error that is less is drawn."""
_MARKERS = "osD^vP*X<>hp"
_LABELS = {"csd": "smallest CSD / DN", "dprime": "smallest d'", "pair_error": "pairwise error", OBSERVER: "its error"}
_WELL = 0.5
"""A rank correlation from which on something is said to predict well."""


def vision_sentences(output: Output) -> Iterator[str]:
    """Yield predictors of the errors, designs with fewer errors than the reference, and the network's excess error."""
    benchmark = benchmark_of(output)
    ranks = ranks_of(benchmark)
    csd = ranks.between.get("csd")
    who = READER_NAMES[benchmark.main_reader]
    if csd is not None:
        how = "does not predict" if not csd.low > 0 else "predicts" if csd.value >= _WELL else "predicts badly"
        others = ", ".join(f"{PREDICTORS[n]} {format_interval(v)}" for n, v in ranks.between.items() if n != "csd")
        yield (
            f"The color separation {how} which CFA the {who} reads best at the same distance and light: its rank "
            f"correlation is {format_interval(csd)} (1: it does, below 0: the other way round); {others}."
        )
    yield from _against_reference(benchmark)
    if benchmark.main_reader == NETWORK:
        pairs = [
            (d, benchmark.error(d, NETWORK, SHUFFLED), benchmark.error(d, OBSERVER, SHUFFLED))
            for d in benchmark.designs
        ]
        errors = [f"{design} {100 * ours.value:.1f} and {100 * least.value:.1f}" for design, ours, least in pairs]
        yield (
            "Percent of the images that the network and the ideal observer read wrongly (lamps not seen in training, "
            f"lenses in any order): {', '.join(errors)}."
        )


def _against_reference(benchmark: Benchmark) -> Iterator[str]:
    groups: dict[str, list[str]] = {"less often with ": [], "more often with ": [], "not separated from it: ": []}
    less, more, same = groups.values()
    for design in benchmark.designs:
        if design != benchmark.reference:
            difference = benchmark.difference(design, SHUFFLED)
            if difference.excludes_zero:
                (less if difference.value < 0 else more).append(f"{design} {100 * difference.value:+.1f}")
            else:
                same.append(design)
    parts = [f"{words}{', '.join(designs)}" for words, designs in groups.items() if designs]
    who = READER_NAMES[benchmark.main_reader]
    yield f"Beside {benchmark.reference}, the {who} errs (percent of the images) {'; '.join(parts)}."


def _vision_table(benchmark: Benchmark) -> pd.DataFrame:
    """Return one row per design: errors by reader, lenses and lamps, differences, F1, and the gain by "unknown"."""
    rows = []
    for design in benchmark.designs:
        row: dict[str, str] = {"design": design}
        for reader in benchmark.readers:
            for order in (FIXED, SHUFFLED):
                title = f"{READER_NAMES[reader]}, lenses {'in order' if order == FIXED else 'shuffled'}"
                row[f"error %: {title}"] = format_percent(benchmark.error(design, reader, order))
        if benchmark.main_reader == NETWORK:
            seen = benchmark.error(design, NETWORK, SHUFFLED, SEEN)
            row["error %: network, shuffled, lamps seen in training"] = format_percent(seen)
        if design == benchmark.reference:
            row[f"less that of {benchmark.reference} %"] = "-"
        else:
            difference = benchmark.difference(design, SHUFFLED)
            note = "" if difference.excludes_zero else ", not separated"
            row[f"less that of {benchmark.reference} %"] = format_percent(difference) + note
        row["F1"] = f"{macro_f1(benchmark.confusion(design, benchmark.main_reader, SHUFFLED).to_numpy()):.3f}"
        for reader in benchmark.readers[:2]:
            row[f"cost with unknown (share): {READER_NAMES[reader]}"] = _unknown(benchmark, design, reader)
        rows.append(row)
    return pd.DataFrame(rows)


def _unknown(benchmark: Benchmark, design: str, reader: str) -> str:
    """Return the mean cost of an answer with "unknown", and its frequency."""
    rows, cost = benchmark.answers(design, reader, SHUFFLED), benchmark.vision.unknown_cost
    wrong = (rows["said"] != rows["state"]).to_numpy(dtype=bool)
    cost_of, unknown = costs(wrong, rows["p"].to_numpy(dtype=float), cost)
    return f"{cost_of.mean():.3f} ({format_share(float(unknown.mean()), 0)})"


def _vision_conditions_table(benchmark: Benchmark, ranks: Ranks) -> pd.DataFrame:
    """Return one row per level and distance: percent read wrongly with each design, in brackets by the observer."""
    rows = ranks.conditions
    levels = {name: f"{name} ({level.illuminance_lx:g} lx)" for name, level in benchmark.vision.levels.items()}
    text = (100 * rows["error"]).map("{:.1f}".format)
    if OBSERVER in rows:
        text += (100 * rows[OBSERVER]).map(" ({:.1f})".format)
    keys = {"light": rows["level"].map(levels), "distance / m": rows["distance_m"].map("{:g}".format)}
    long = rows.assign(text=text, **keys).set_index([*keys, "design"])["text"]
    table = long.unstack().reindex(pd.MultiIndex.from_frame(pd.DataFrame(keys).drop_duplicates()))
    return table[benchmark.designs].reset_index().rename_axis(columns=None)


def _confusion_table(benchmark: Benchmark) -> pd.DataFrame:
    """Return counts of answers, one row per design and state, lenses in any order."""
    parts = {design: benchmark.confusion(design, benchmark.main_reader, SHUFFLED) for design in benchmark.designs}
    table = pd.concat(parts, names=["design", "state"])
    return table.rename(columns=lambda name: f"said {name}").reset_index()


def _ranks_table(ranks: Ranks) -> pd.DataFrame:
    """Return one row per predictor: rank correlations with their intervals."""
    rows = [
        {
            "predictor": PREDICTORS[name],
            "over designs, distances and levels": format_interval(ranks.everywhere[name]),
            "between designs at one distance and level": _between(ranks, name),
        }
        for name in ranks.everywhere
    ]
    return pd.DataFrame(rows)


def vision_parts(output: Output) -> dict[str, pd.DataFrame]:
    """Return every table of the benchmark."""
    benchmark = benchmark_of(output)
    ranks = ranks_of(benchmark)
    who = READER_NAMES[benchmark.main_reader]
    beside = ", in brackets by the ideal observer" if benchmark.main_reader == NETWORK else ""
    parts = {
        "Errors of each design, percent of the images, with 95 % intervals": _vision_table(benchmark),
        f"Percent of the images that the {who} reads wrongly{beside}; lenses shuffled": _vision_conditions_table(
            benchmark, ranks
        ),
        f"Rank correlation with how rarely the {who} errs, with 95 % intervals": _ranks_table(ranks),
        f"What the {who} says of each state; lenses shuffled": _confusion_table(benchmark),
    }
    if VISION_STREET in output.vision:
        title = "Streets: average precision of the simplest detector, with 95 % intervals, mean over signal types"
        parts[title] = _street_table(output.vision[VISION_STREET], benchmark.reference)
    return parts


def _street_table(table: pd.DataFrame, reference: str) -> pd.DataFrame:
    """Return one row per design: average precision of all light levels and each of them, and less the reference's."""
    scores, rows = precision_scores(table, reference), dict[str, dict[str, str]]()
    for score in scores.to_dict("records"):
        name, level = score["name"], "all levels" if score["level"] == ALL else score["level"]
        rows.setdefault(name, {"design": name})[level] = _of_columns(score, "average_precision")
    for score in scores[scores["level"] == ALL].to_dict("records"):
        difference = "-" if score["name"] == reference else _of_columns(score, "apart")
        rows[score["name"]][f"less that of {reference}"] = difference
    return pd.DataFrame([*rows.values()])


def _of_columns(row: Mapping[Any, Any], name: str) -> str:
    return format_interval(Interval(row[name], row[f"{name}_low"], row[f"{name}_high"]))


def vision_drawings(output: Output) -> Iterator[tuple[str, str, Drawing]]:
    """Yield the drawings of the benchmark."""
    benchmark = benchmark_of(output)
    ranks = ranks_of(benchmark)
    levels = {name: level.illuminance_lx for name, level in benchmark.vision.levels.items()}
    who = READER_NAMES[benchmark.main_reader]
    errors = partial(_draw_errors, ranks.conditions, levels, benchmark.main_reader)
    yield "vision-errors", f"Images that the {who} reads wrongly, over the distance", errors
    if ranks.between:
        yield "vision-ranks", f"What predicts the {who}'s errors", partial(_draw_ranks, ranks, list(levels), who)
    if VISION_STREETS in output.vision:
        caption = "One street for each light level through each design's plain ISP"
        yield "vision-street", caption, street_drawing(output.vision[VISION_STREETS])


def street_drawing(pictures: pd.DataFrame) -> Drawing:
    """Return the drawing of streets, one column per design, one row per light level."""
    rows = pictures.assign(order=pictures.groupby("name").cumcount()).sort_values("order", kind="stable")
    streets = [
        (f"{row['name']}, {row['level']}", _picture(row["pixels"], row["rows"], row["columns"]))
        for row in rows.to_dict("records")
    ]
    return partial(_draw_streets, streets, pictures["name"].nunique())


def _picture(pixels: bytes, rows: int, columns: int) -> NDArray[np.uint8]:
    return np.frombuffer(pixels, dtype=np.uint8).reshape(rows, columns, 3)


def _draw_streets(streets: Sequence[tuple[str, NDArray[np.uint8]]], n_designs: int) -> Figure:
    high, wide = streets[0][1].shape[:2]
    width = 3.2 if n_designs <= 3 else 2.2
    figure, panels = panel_grid(len(streets), n_designs, (width, width * high / wide + 0.25), (0, 0))
    for axes, (title, pixels) in zip(panels, streets, strict=True):
        axes.imshow(pixels, interpolation="nearest")
        axes.set_axis_off()
        axes.set_title(title, fontsize=7)
    return figure


def _between(ranks: Ranks, name: str) -> str:
    """Format the rank correlation of a predictor between designs; a dash for too few designs."""
    return format_interval(ranks.between[name]) if name in ranks.between else "-"


def _draw_errors(conditions: pd.DataFrame, levels: Mapping[str, float], main_reader: str) -> Figure:
    """Draw one panel per level: the error with each design; dashed the ideal observer's."""
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
    legend_beside(panels[-1], "dashed: ideal observer" if main_reader != OBSERVER else None)
    return figure


def _draw_ranks(ranks: Ranks, levels: Sequence[str], who: str) -> Figure:
    """Draw one panel per predictor: one point per design, distance and level."""
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
        between, everywhere = _between(ranks, name), format_interval(ranks.everywhere[name])
        title = f"{PREDICTORS[name]}\nrank correlation between CFAs {between}\nover everything {everywhere}"
        axes.set_title(title, fontsize=8)
        axes.set_xlabel(_LABELS[name])
    panels[0].set_ylabel(f"images that the {who} reads wrongly / %")
    legend_beside(panels[-1])
    return figure
