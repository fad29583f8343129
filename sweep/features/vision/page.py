"""Benchmark of vision of a run: errors of each design and reader, and their predictors, with intervals, as tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from scipy.stats import rankdata

from ...base.types import Array, Bool, BoolArray, Float, IndexArray, Int
from ...report.numbers import SHARE, amount
from ...report.panels import INK, Answer, Lines, Section, axis_over
from ...report.run import Run, words_of
from ...report.tables import Axis, Column, Marks, Table
from ...results.output import Output
from ...results.tables import RGGB
from . import VISION, VISION_CONDITIONS, VISION_LEARNING
from .keys import Vision
from .readers import OBSERVER
from .scenes import PROTOTYPES, SHUFFLED, UNSEEN, states_of
from .scores import Interval, confusion_matrix, interval_of_seeds, mean_of

READER_NAMES = {
    OBSERVER: "ideal observer",
    PROTOTYPES: "prototype network",
}
_FEWEST_RANKED = 5
"""Designs that a rank correlation between designs needs."""
PREDICTORS = {
    "csd": "CSD",
    "dprime": "d'",
    "pair_error": "pairwise error in closed form",
    OBSERVER: "ideal observer's error",
}
_FALLS = ("csd", "dprime")
"""Predictors of which more is better."""


@dataclass(frozen=True, eq=False)
class Benchmark:
    """Images of a run and the answers to them."""

    vision: Vision
    seed: int
    images: pd.DataFrame
    conditions: pd.DataFrame
    learning: pd.DataFrame

    @cached_property
    def designs(self) -> list[str]:
        """Names of the designs, in order."""
        return list(dict.fromkeys(self.images["name"]))

    @property
    def reference(self) -> str:
        """Design that the others are compared with."""
        return RGGB if RGGB in self.designs else self.designs[0]

    @cached_property
    def readers(self) -> list[str]:
        """Readers of the images."""
        return [reader for reader in READER_NAMES if self.images[reader].notna().any()]

    @property
    def main_reader(self) -> str:
        """Reader by which designs are compared: the prototype network, or the observer."""
        return self.learners[0] if self.learners else OBSERVER

    @property
    def learners(self) -> list[str]:
        """Readers that learn."""
        return [reader for reader in self.readers if reader != OBSERVER]

    def _answers(self, order: str, lamps: str = UNSEEN) -> pd.DataFrame:
        return self.images[(self.images["order"] == order) & (self.images["lamps"] == lamps)]

    @lru_cache  # noqa: B019  (a benchmark lives as long as its report)
    def wrong(self, reader: str, order: str, lamps: str = UNSEEN) -> pd.DataFrame:
        """Return 1 where an image was read wrongly.

        Returns one row per scene (seed, image), one column per design.
        """
        rows = self._answers(order, lamps)
        rows = rows.assign(wrong=(rows[reader] != rows["state"]).astype(float))
        return rows.pivot(index=["seed", "image"], columns="name", values="wrong")[self.designs]

    @lru_cache  # noqa: B019
    def risk(self, reader: str) -> pd.DataFrame:
        """Return the error to expect by the observer for each answer, lenses in any order, as rows of `wrong`.

        On average over scenes it is the share of wrong answers, and scatters less.
        """
        rows = self._answers(SHUFFLED)
        return rows.pivot(index=["seed", "image"], columns="name", values=f"{reader}_risk")[self.designs]

    @lru_cache  # noqa: B019
    def seeds(self, order: str, lamps: str = UNSEEN) -> Int[IndexArray, " scenes"]:
        """Return the seed of each scene of `wrong`."""
        return np.asarray(self.scenes(order, lamps)["seed"].to_numpy(), dtype=np.intp)

    def error(self, design: str, reader: str, order: str, lamps: str = UNSEEN) -> Interval:
        """Return the share of images that were read wrongly."""
        return mean_of(self.wrong(reader, order, lamps)[design].to_numpy(), self.seeds(order, lamps))

    def difference(self, design: str, order: str, reader: str = "") -> Interval:
        """Return the error of a design less that of the reference on the same scenes; of the main reader by default."""
        wrong = self.wrong(reader or self.main_reader, order)
        return mean_of((wrong[design] - wrong[self.reference]).to_numpy(), self.seeds(order))

    def scenes(self, order: str, lamps: str = UNSEEN) -> pd.DataFrame:
        """Return the scenes of `wrong` in the same order."""
        rows = self._answers(order, lamps)
        return rows[rows["name"] == self.designs[0]].sort_values(["seed", "image"])

    def answers(self, design: str, reader: str, order: str) -> pd.DataFrame:
        """Return the answers on unseen lamps: columns state, said, p."""
        rows = self._answers(order)
        rows = rows[rows["name"] == design]
        return rows[["state", reader, f"{reader}_p"]].set_axis(["state", "said", "p"], axis=1)

    def confusion(self, design: str, reader: str, order: str) -> pd.DataFrame:
        """Return the number of answers by true state (row) and answer (column)."""
        states, rows = list(states_of(self.vision)), self.answers(design, reader, order)
        truth, answered = (np.array([states.index(value) for value in rows[column]]) for column in ("state", "said"))
        return pd.DataFrame(confusion_matrix(truth, answered, len(states)), states, states)


def benchmark_of(output: Output) -> Benchmark:
    """Return the benchmark of a run whose study has one."""
    vision = output.study.key("vision")
    tables = (output.tables[name] for name in (VISION, VISION_CONDITIONS, VISION_LEARNING))
    return output.cached("vision", lambda: Benchmark(vision, output.study.seed, *tables))


@dataclass(frozen=True)
class Ranks:
    """Rank correlations of each of `PREDICTORS` with the rarity of a reader's errors: 1 predicts every order.

    `everywhere` is over all designs, distances and levels; `between` is the mean over distances and levels of the
    correlation between designs. `conditions` has one row per design, distance and level, with predictors and `error`.
    """

    everywhere: dict[str, Interval]
    between: dict[str, Interval]
    conditions: pd.DataFrame


@lru_cache(maxsize=8)
def ranks_of(benchmark: Benchmark, reader: str) -> Ranks:
    """Return the rank correlations with the errors to expect of a reader, lenses in any order, by seeds."""
    scenes, seeds = benchmark.scenes(SHUFFLED), benchmark.seeds(SHUFFLED)
    # The first row is of all scenes, then one of each seed.
    of_seed = seeds == np.unique(seeds)[:, None]
    weights = np.vstack([np.ones(len(seeds)), of_seed]).astype(float)
    where = list(dict.fromkeys(zip(benchmark.conditions["distance_m"], benchmark.conditions["level"], strict=True)))
    here = np.stack([((scenes["distance_m"] == d) & (scenes["level"] == v)).to_numpy() for d, v in where])
    # [1 + n_seeds, designs, conditions]
    errors = {name: _by_condition(benchmark.risk(name), here, weights) for name in dict.fromkeys((OBSERVER, reader))}
    table = benchmark.conditions.set_index(["name", "distance_m", "level"])
    known = {n: np.array([[table[n][d, *at] for at in where] for d in benchmark.designs]) for n in list(PREDICTORS)[:3]}
    wrong_shares = errors[reader]
    everywhere, between = {}, {}
    for name in PREDICTORS:
        given = errors[name] if name in errors else np.broadcast_to(known[name], wrong_shares.shape)
        if reader == name:
            continue
        sign = -1.0 if name in _FALLS else 1.0
        flat = _spearman(sign * given.reshape(len(given), -1), wrong_shares.reshape(len(wrong_shares), -1))
        everywhere[name] = interval_of_seeds(float(flat[0]), flat[1:]).within(-1.0, 1.0)
        if len(benchmark.designs) < _FEWEST_RANKED:  # chance alone gives large rank correlations of fewer
            continue
        at_each = np.stack([_spearman(sign * given[:, :, at], wrong_shares[:, :, at]) for at in range(len(where))])
        mean = np.ma.masked_invalid(at_each).mean(axis=0).filled(np.nan)
        between[name] = interval_of_seeds(float(mean[0]), mean[1:]).within(-1.0, 1.0)
    conditions = pd.DataFrame(
        [{"design": d, "distance_m": m, "level": level} for d in benchmark.designs for m, level in where]
    )
    for name in everywhere:
        conditions[name] = (errors[name][0] if name in errors else known[name]).ravel()
    conditions["error"] = wrong_shares[0].ravel()
    return Ranks(everywhere, between, conditions)


class Lesson(NamedTuple):
    """A reader that has learned from some images: error over the observer's by design, and what the CSD says of it."""

    reader: str
    images: int
    times: dict[str, float]
    csd: Interval


def lessons_of(benchmark: Benchmark) -> list[Lesson]:
    """Return what readers of fewer images reach, and the mean rank correlation of CSD and errors between designs.

    Correlations are of one distance and level, means over all of them; intervals over the seeds.
    """
    where, lessons = ["distance_m", "level"], list[Lesson]()
    csd = benchmark.conditions.pivot(index=where, columns="name", values="csd")[benchmark.designs]
    for reader in benchmark.learners:
        of_reader = benchmark.learning[benchmark.learning["reader"] == reader]
        for images in sorted(of_reader["images"].unique()):
            rows = of_reader[of_reader["images"] == images]
            # Conditions have equally many images, but for one.
            by_seed = rows.pivot(index=["seed", *where], columns="name", values="risk")[benchmark.designs]
            means = [by_seed.groupby(where).mean(), *(own.droplevel("seed") for _, own in by_seed.groupby("seed"))]
            ranks = [_spearman(-csd.loc[own.index].to_numpy(), own.to_numpy()) for own in means]
            known = np.array([own[np.isfinite(own)].mean() if np.isfinite(own).any() else np.nan for own in ranks])
            if len(benchmark.designs) < _FEWEST_RANKED:
                known = np.full_like(known, np.nan)
            sums = rows[["risk", "observer_risk"]].mul(rows["test_images"], axis=0).groupby(rows["name"]).sum()
            ratios = sums["risk"] / sums["observer_risk"].where(sums["observer_risk"] > 0)
            times = {name: float(ratios[name]) for name in benchmark.designs}
            found = interval_of_seeds(float(known[0]), known[1:]).within(-1.0, 1.0)
            lessons.append(Lesson(reader, int(images), times, found))
    return lessons


def _by_condition(
    wrong: pd.DataFrame, here: Bool[BoolArray, "conditions images"], weights: Float[Array, "draws images"]
) -> Float[Array, "draws _readers conditions"]:
    """Return errors; NaN where a row has no scene of a condition."""
    values = wrong.to_numpy(dtype=float)
    errors = np.full((len(weights), values.shape[1], len(here)), np.nan)
    for at, scenes in enumerate(here):
        total = weights[:, scenes].sum(axis=1, keepdims=True)
        sums = weights[:, scenes] @ values[scenes]
        errors[:, :, at] = np.divide(sums, total, out=np.full_like(sums, np.nan), where=total > 0)
    return errors


def _spearman(x: Float[Array, "draws values"], y: Float[Array, "draws values"]) -> Float[Array, " draws"]:
    """Return the rank correlation along the last axis; NaN if one side is constant."""
    a, b = (rankdata(values, axis=1) for values in (x, y))
    a, b = (ranks - ranks.mean(axis=1, keepdims=True) for ranks in (a, b))
    scale = np.sqrt((a**2).sum(axis=1) * (b**2).sum(axis=1))
    out = np.full(len(a), np.nan)
    return np.asarray(np.divide((a * b).sum(axis=1), scale, out=out, where=scale > 0), dtype=float)


_MOST_LEVELS = 3


def vision_answer(run: Run) -> Answer:
    """Return how often readers err with each design, how the separation ranks designs, streets, and lessons."""
    benchmark = benchmark_of(run.output)
    reader = benchmark.main_reader
    ranks = ranks_of(benchmark, reader)
    errors = {
        "wrong": (READER_NAMES[reader], {name: benchmark.error(name, reader, SHUFFLED) for name in benchmark.designs}),
        "apart": (f"less that of {benchmark.reference}", {
            name: benchmark.difference(name, SHUFFLED) for name in benchmark.designs if name != benchmark.reference
        }),
        **{other: (READER_NAMES[other], {name: benchmark.error(name, other, SHUFFLED) for name in benchmark.designs})
           for other in benchmark.readers if other != reader},
    }  # fmt: skip
    columns: dict[str, tuple[Column, Mapping[str, Any]]] = {
        key: _shares(label, intervals) for key, (label, intervals) in errors.items()
    }
    columns["wrong_alone"] = (
        Column("wrong", SHARE, "less"),
        {name: error.value for name, error in errors["wrong"][1].items()},
    )
    hero = (
        run.hero
        if run.hero in benchmark.designs
        else min(benchmark.designs, key=lambda name: errors["wrong"][1][name].value)
    )
    table = Table.of(columns, reference=benchmark.reference, hero=hero)
    lead = Section(
        "Images read wrongly",
        table,
        tuple(_over_distance(benchmark, ranks, hero)),
        "Unseen lamps, lenses in any order.",
    )
    between = ranks_of(benchmark, OBSERVER).between.get("csd")
    least = min(((name, one.value) for name, one in errors["wrong"][1].items()), key=lambda of: of[1])
    observer = benchmark.error(hero, OBSERVER, SHUFFLED)
    facts = {
        "fewest": f"{amount(least[1], SHARE)} with {least[0]}", "least": amount(observer.value, SHARE),
        "reader": READER_NAMES[reader], "by": READER_NAMES[OBSERVER], "quantity": words_of(run.goal),
        "rank": "unknown" if between is None else f"{between.value:.2f} ({between.low:.2f} to {between.high:.2f})",
    }  # fmt: skip
    return Answer("vision", lead, facts, [*_predictors(benchmark, ranks), *_lessons(benchmark)], of_all=True)


def _shares(label: str, intervals: Mapping[str, Interval], group: str = "wrong") -> tuple[Column, dict[str, Marks]]:
    """Return shares with their intervals as a track."""
    ends = [end for one in intervals.values() for end in (one.low, one.high)]
    axis = Axis("", SHARE, min(0.0, *ends), max(1e-3, *ends), level=0.0 if min(ends) < 0 else None)
    cells = {
        name: Marks(
            [(one.low, one.high)],
            [(one.value, INK)],
            f"{100 * one.value:.1f} ({100 * one.low:.1f} to {100 * one.high:.1f})\u00a0%",
        )
        for name, one in intervals.items()
    }
    return Column(label, SHARE, axis=axis, group=group), cells


def _over_distance(benchmark: Benchmark, ranks: Ranks, hero: str) -> list[Lines]:
    """Return errors over distance, a panel for each light, with bands down to the ideal observer."""
    panels, rows = [], ranks.conditions
    for level, of in list(benchmark.vision.levels.items())[:_MOST_LEVELS]:
        here, lines, floors = rows[rows["level"] == level].sort_values("distance_m"), {}, {}
        for design, line in here.groupby("design", sort=False):
            lines[str(design)] = line["distance_m"].to_numpy(dtype=float), line["error"].to_numpy(dtype=float)
            if OBSERVER in line:
                floors[str(design)] = line[OBSERVER].to_numpy(dtype=float)
        across = axis_over("distance", "m", here["distance_m"], zero=False, log=False)
        up = axis_over("", SHARE, here["error"], log=False)
        panels.append(
            Lines(f"Wrong / %: {level}, {of.illuminance_lx:g} lx", across, up, hero, lines=lines, floors=floors)
        )
    return panels


def _predictors(benchmark: Benchmark, ranks: Ranks) -> list[Section]:
    """Return how each predictor ranks designs and conditions by a reader's errors."""
    columns = {
        "between": _correlations("between designs", ranks.between),
        "everywhere": _correlations("designs, distances and levels", ranks.everywhere),
    }
    note = f"Rank correlation with the rarity of errors of the {READER_NAMES[benchmark.main_reader]}; 1: every order."
    table = Table.of(columns, head="predictor")
    return [Section("What predicts errors", table, note=note)] if table.rows else []


def _correlations(label: str, known: Mapping[str, Interval]) -> tuple[Column, dict[str, Marks]]:
    cells = {
        PREDICTORS[name]: Marks(
            [(one.low, one.high)], [(one.value, INK)], f"{one.value:.2f} ({one.low:.2f} to {one.high:.2f})"
        )
        for name, one in known.items()
    }
    return Column(label, axis=Axis("", "", -1.0, 1.0, level=0.0)), cells


def _lessons(benchmark: Benchmark) -> list[Section]:
    """Return errors of readers over the ideal observer's, over the images that they have learned from."""
    lessons, panels = lessons_of(benchmark), []
    for reader in benchmark.learners:
        own = [lesson for lesson in lessons if lesson.reader == reader]
        images = np.array([float(lesson.images) for lesson in own])
        lines = {name: (images, np.array([lesson.times[name] for lesson in own])) for name in benchmark.designs}
        every = np.concatenate([line for _, line in lines.values()])
        across, up = axis_over("images learned from", "", images, log=True), axis_over("", "", every, log=True)
        panels.append(Lines(f"{READER_NAMES[reader]}: times the ideal observer's error", across, up, lines=lines))
    rows = {
        f"{READER_NAMES[lesson.reader]}, {lesson.images:,} images": {
            "times": _ends([t for t in lesson.times.values() if np.isfinite(t)]), "csd": lesson.csd.value,
        }
        for lesson in lessons
    }  # fmt: skip
    columns = {
        "times": (Column("times the ideal observer's error"), {name: row["times"] for name, row in rows.items()}),
        "csd": (
            Column("rank correlation of the separation", "", "more"),
            {name: row["csd"] for name, row in rows.items()},
        ),
    }
    return [Section("What a reader learns", Table.of(columns, head="reader"), tuple(panels))] if lessons else []


def _ends(values: Sequence[float]) -> str:
    return f"{min(values):.2f} to {max(values):.2f}" if values else ""


KINDS = {"vision": (0, lambda run: run.study.key("vision") is not None, vision_answer)}
