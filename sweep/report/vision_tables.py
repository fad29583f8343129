"""The benchmark of vision in sentences and tables."""

from __future__ import annotations

from collections.abc import Iterator

import pandas as pd

from ..metrics.share import told_share
from ..results.output import Output
from ..vision.scenes import FIXED, SEEN, SHUFFLED
from ..vision.scores import costs, macro_f1
from .vision import NETWORK, OBSERVER, READER_NAMES, Benchmark, benchmark_of, said_interval, said_percent
from .vision_ranks import PREDICTORS, Ranks, ranks_of

_WELL = 0.5
"""A rank correlation from which on something is said to predict well."""


def vision_sentences(output: Output) -> Iterator[str]:
    """Predictors of the errors, who errs less than the reference, and how far the network is from the best reader."""
    benchmark = benchmark_of(output)
    ranks = ranks_of(benchmark)
    csd = ranks.between.get("csd")
    who = READER_NAMES[benchmark.judge]
    if csd is not None:
        how = "does not predict" if not csd.low > 0 else "predicts" if csd.value >= _WELL else "predicts badly"
        others = ", ".join(f"{PREDICTORS[n]} {said_interval(v)}" for n, v in ranks.between.items() if n != "csd")
        yield (
            f"The color separation {how} which CFA the {who} reads best at the same distance and light: its rank "
            f"correlation is {said_interval(csd)} (1: it does, below 0: the other way round); {others}."
        )
    yield from _against_reference(benchmark)
    if benchmark.judge == NETWORK:
        pairs = [
            (d, benchmark.error(d, NETWORK, SHUFFLED), benchmark.error(d, OBSERVER, SHUFFLED))
            for d in benchmark.designs
        ]
        best = min(pairs, key=lambda each: each[1].value)
        yield (
            f"The network reads {said_percent(best[1])} % of the images of {best[0]} wrongly, the ideal observer "
            f"{said_percent(best[2])} % (lamps not seen in training, lenses in any order)."
        )


def _against_reference(benchmark: Benchmark) -> Iterator[str]:
    groups: dict[str, list[str]] = {"less often with ": [], "more often with ": [], "not told apart from it: ": []}
    less, more, same = groups.values()
    for design in benchmark.designs:
        if design != benchmark.reference:
            difference = benchmark.difference(design, SHUFFLED)
            if difference.excludes_zero:
                (less if difference.value < 0 else more).append(f"{design} {100 * difference.value:+.1f}")
            else:
                same.append(design)
    parts = [f"{words}{', '.join(designs)}" for words, designs in groups.items() if designs]
    who = READER_NAMES[benchmark.judge]
    yield f"Beside {benchmark.reference}, the {who} errs (percent of the images) {'; '.join(parts)}."


def vision_table(benchmark: Benchmark) -> pd.DataFrame:
    """A row per design: errors by reader, order of lenses and lamps, differences, F1, and what "unknown" saves."""
    rows = []
    for design in benchmark.designs:
        row: dict[str, str] = {"design": design}
        for reader in benchmark.readers:
            for order in (FIXED, SHUFFLED):
                title = f"{READER_NAMES[reader]}, lenses {'in order' if order == FIXED else 'shuffled'}"
                row[f"error %: {title}"] = said_percent(benchmark.error(design, reader, order))
        if benchmark.judge == NETWORK:
            seen = benchmark.error(design, NETWORK, SHUFFLED, SEEN)
            row["error %: network, shuffled, lamps seen in training"] = said_percent(seen)
        if design == benchmark.reference:
            row[f"less that of {benchmark.reference} %"] = "-"
        else:
            difference = benchmark.difference(design, SHUFFLED)
            note = "" if difference.excludes_zero else ", not told apart"
            row[f"less that of {benchmark.reference} %"] = said_percent(difference) + note
        row["F1"] = f"{macro_f1(benchmark.confusion(design, benchmark.judge, SHUFFLED).to_numpy()):.3f}"
        for reader in benchmark.readers[:2]:
            row[f"cost with unknown (share): {READER_NAMES[reader]}"] = _unknown(benchmark, design, reader)
        rows.append(row)
    return pd.DataFrame(rows)


def _unknown(benchmark: Benchmark, design: str, reader: str) -> str:
    """Mean cost of an answer where "unknown" is allowed, and how often it is given."""
    rows, cost = benchmark.said(design, reader, SHUFFLED), benchmark.vision.unknown_cost
    wrong = (rows["said"] != rows["state"]).to_numpy(dtype=bool)
    cost_of, unknown = costs(wrong, rows["p"].to_numpy(dtype=float), cost)
    return f"{cost_of.mean():.3f} ({told_share(float(unknown.mean()), 0)})"


def vision_conditions_table(benchmark: Benchmark, ranks: Ranks) -> pd.DataFrame:
    """A row per level and distance: percent read wrongly with each design, and in brackets by the ideal observer."""
    rows = ranks.conditions
    levels = {name: f"{name} ({level.illuminance_lx:g} lx)" for name, level in benchmark.vision.levels.items()}
    text = (100 * rows["error"]).map("{:.1f}".format)
    if OBSERVER in rows:
        text += (100 * rows[OBSERVER]).map(" ({:.1f})".format)
    keys = {"light": rows["level"].map(levels), "distance / m": rows["distance_m"].map("{:g}".format)}
    long = rows.assign(text=text, **keys).set_index([*keys, "design"])["text"]
    table = long.unstack().reindex(pd.MultiIndex.from_frame(pd.DataFrame(keys).drop_duplicates()))
    return table[benchmark.designs].reset_index().rename_axis(columns=None)


def confusion_table(benchmark: Benchmark) -> pd.DataFrame:
    """Counts of states as the judge takes them, a row per design and state, lenses in any order."""
    parts = {design: benchmark.confusion(design, benchmark.judge, SHUFFLED) for design in benchmark.designs}
    table = pd.concat(parts, names=["design", "state"])
    return table.rename(columns=lambda name: f"said {name}").reset_index()


def ranks_table(ranks: Ranks) -> pd.DataFrame:
    """A row per predictor: its rank correlations with their intervals."""
    rows = [
        {
            "predictor": PREDICTORS[name],
            "over designs, distances and levels": said_interval(ranks.everywhere[name]),
            "between designs at one distance and level": said_interval(ranks.between[name]),
        }
        for name in ranks.everywhere
    ]
    return pd.DataFrame(rows)


def vision_parts(benchmark: Benchmark) -> dict[str, pd.DataFrame]:
    """Every table of the report, by its title."""
    ranks = ranks_of(benchmark)
    who = READER_NAMES[benchmark.judge]
    beside = ", in brackets by the ideal observer" if benchmark.judge == NETWORK else ""
    return {
        "Errors of each design, percent of the images, with 95 % intervals": vision_table(benchmark),
        f"Percent of the images that the {who} reads wrongly{beside}; lenses shuffled": vision_conditions_table(
            benchmark, ranks
        ),
        f"Rank correlation with how rarely the {who} errs, with 95 % intervals": ranks_table(ranks),
        f"What the {who} says of each state; lenses shuffled": confusion_table(benchmark),
    }
