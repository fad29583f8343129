"""Scores of detections: average precision as pycocotools has it, and the share that is found, with intervals.

A detection is right that overlaps a target of its state which no better one has found: by 0.5 (intersection over union)
or by 0.5, 0.55 ... 0.95, averaged. Precision is averaged at 101 recalls.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ..base.types import Array, Float, FloatArray, IndexArray, Int
from .detection_kernels import average_precisions, match
from .scenes import OFF
from .scores import CONFIDENCE, Interval

ALL = "all"
"""In place of a state, light level, distance or intensity: all of them."""
_THRESHOLDS = np.linspace(0.5, 0.95, 10)
_RECALLS = np.linspace(0.0, 1.0, 101)
_MOST_IN_AN_IMAGE = 100
"""Detections of one image and category that count, best first."""
_DRAWS = 500
FALSE_PER_IMAGE = 0.03, 0.3
"""False positives per image (FPPI) of lit states: `found` is the recall, mean over nine of them, evenly in their
logarithm, as in Dollar et al., PAMI 2012."""


class Matched(NamedTuple):
    """Detections of one design, seed and state, by falling score, with what they find.

    `target`: the one found at each threshold, or -1; `image`: of the seed, by number; `distance_m`: of a target of
    their size, NaN where they have none.
    """

    targets: pd.DataFrame
    target: Int[IndexArray, "thresholds detections"]
    image: Int[IndexArray, " detections"]
    score: Float[Array, " detections"]
    distance_m: Float[Array, " detections"]


def match_detections(targets: pd.DataFrame, found: pd.DataFrame) -> Matched:
    """Match detections of a state with its targets.

    `targets`: of `targets_of`; `found`: `image`, `left`, `top`, `width`, `height`, `score`.
    """
    targets = targets.sort_values("image", kind="stable")
    found = found.sort_values(["image", "score"], ascending=[True, False], kind="stable")
    found = found[found.groupby("image").cumcount() < _MOST_IN_AN_IMAGE]
    n_images = 1 + int(max([*targets["image"], *found["image"]], default=0))
    starts = [np.searchsorted(table["image"].to_numpy(), np.arange(n_images + 1)) for table in (found, targets)]
    boxes = [table[["left", "top", "width", "height"]].to_numpy(dtype=float) for table in (found, targets)]
    target = np.empty((_THRESHOLDS.size, len(found)), dtype=np.intp)
    match(boxes[0], starts[0], boxes[1], starts[1], _THRESHOLDS, target)
    by_score = np.argsort(-found["score"].to_numpy(dtype=float), kind="stable")
    image, score = (found[name].to_numpy()[by_score] for name in ("image", "score"))
    sizes = np.sqrt(boxes[0][:, 2] * boxes[0][:, 3])[by_score]
    return Matched(targets, target[:, by_score], image, score, _distances(targets, sizes))


def _distances(targets: pd.DataFrame, sizes: Float[Array, " detections"]) -> Float[Array, " detections"]:
    """Return the distance whose targets are nearest in size."""
    if targets.empty:
        return np.full(len(sizes), np.nan)
    area = (targets["width"] * targets["height"]).groupby(targets["distance_m"]).median()
    known = np.log(np.sqrt(np.maximum(area.to_numpy(dtype=float), 1e-12)))
    away = np.abs(np.log(np.maximum(sizes, 1e-6))[:, None] - known)
    return np.asarray(area.index.to_numpy(dtype=float)[away.argmin(axis=1)])


class Subset(NamedTuple):
    """Which targets count; `ALL` for any."""

    state: str = ALL
    distance_m: float | str = ALL
    level: str = ALL
    intensity_cd: float | str = ALL


def _counted(own: Matched, of: Subset, level_of_image: NDArray[Any]) -> tuple[NDArray[np.bool_], NDArray[np.int8]]:
    """Return which targets count, and whether detections are right (1), false (0) or do not count (-1)."""
    table = own.targets
    counts = np.ones(len(table), dtype=bool)
    for name in ("distance_m", "level", "intensity_cd"):
        if getattr(of, name) != ALL:
            counts &= (table[name] == getattr(of, name)).to_numpy()
    hits = np.where(own.target >= 0, np.where(np.append(counts, False)[own.target], 1, -1), 0).astype(np.int8)
    away = np.zeros(len(own.image), dtype=bool)
    if of.level != ALL:
        away |= level_of_image[own.image] != of.level
    if of.distance_m != ALL:
        away |= np.isfinite(own.distance_m) & (own.distance_m != of.distance_m)
    hits[:, away] = np.where(hits[:, away] == 0, -1, hits[:, away])
    return counts, hits


@dataclass(frozen=True)
class Judge:
    """Targets and detections of one kind, of one design and seed, by state.

    `weights`: of the images; the first row is what is told, the others are draws for its interval.
    """

    by_state: Mapping[str, Matched]
    levels: NDArray[Any]
    weights: Float[Array, "draws images"]
    _known: dict[Subset, tuple[FloatArray, FloatArray]] = field(default_factory=dict)

    def precisions(self, of: Subset) -> tuple[Float[Array, "draws thresholds"], Float[Array, "draws thresholds"]]:
        """Return average precision and largest recall, mean over the states that have targets."""
        precisions, recalls = [], []
        for state in (state for state in self.by_state if of.state in (ALL, state)):
            precision, recall = self._precisions(of._replace(state=state))
            precisions.append(precision)
            recalls.append(recall)
        return _mean(precisions), _mean(recalls)

    def _precisions(self, of: Subset) -> tuple[Float[Array, "draws thresholds"], Float[Array, "draws thresholds"]]:
        """Return average precision and largest recall of one state, each computed once."""
        if of not in self._known:
            own = self.by_state[of.state]
            counts, hits = _counted(own, of, self.levels)
            total = self.weights[:, own.targets["image"].to_numpy(dtype=np.intp)[counts]].sum(axis=1)
            precision, recall = (np.empty((len(self.weights), len(hits))) for _ in range(2))
            average_precisions(hits, own.image, self.weights, total, _RECALLS, precision, recall)
            self._known[of] = precision, recall
        return self._known[of]

    @cached_property
    def _scores(self) -> Float[Array, "numbers draws"]:
        """Scores above which lit states have each number of `FALSE_PER_IMAGE` false boxes an image."""
        false = [(own.score, own.image, own.target[0] < 0) for state, own in self.by_state.items() if state != OFF]
        score, image = (np.concatenate([part[at][part[2]] for part in false]) for at in (0, 1))
        order = np.argsort(-score, kind="stable")
        cumulated = np.cumsum(self.weights[:, image[order]], axis=1)
        images = self.weights.sum(axis=1, keepdims=True)
        first = [(cumulated <= number * images).sum(axis=1) for number in np.geomspace(*FALSE_PER_IMAGE, 9)]
        return np.asarray(np.append(score[order], -np.inf)[np.stack(first)], dtype=float)

    def found(self, of: Subset) -> Float[Array, " draws"]:
        """Return the recall of lit targets, mean over `FALSE_PER_IMAGE`."""
        right, total = np.zeros(len(self.weights)), np.zeros(len(self.weights))
        for state, own in self.by_state.items():
            if state != OFF and of.state in (ALL, state):
                counts, hits = _counted(own, of, self.levels)
                total += self.weights[:, own.targets["image"].to_numpy(dtype=np.intp)[counts]].sum(axis=1)
                here = hits[0] > 0
                weights = self.weights[:, own.image[here]]
                for least in self._scores:
                    right += (weights * (own.score[here] > least[:, None])).sum(axis=1) / len(self._scores)
        return np.asarray(np.divide(right, total, out=np.full_like(right, np.nan), where=total > 0), dtype=float)

    def statistics(self, of: Subset) -> dict[str, Float[Array, " draws"]]:
        """Return average precision at 0.5 and over all thresholds, average recall, and recall at `FALSE_PER_IMAGE`."""
        precision, recall = self.precisions(of)
        whole = {"ap50": precision[:, 0], "ap": precision.mean(axis=1), "recall": recall.mean(axis=1)}
        return whole | {"found": self.found(of)}


def _mean(parts: Sequence[FloatArray]) -> FloatArray:
    """Return the mean of what is known."""
    values = np.stack(parts)
    known = np.isfinite(values)
    total = np.where(known, values, 0.0).sum(axis=0)
    mean = np.divide(total, known.sum(axis=0), out=np.full_like(total, np.nan), where=known.any(axis=0))
    return np.asarray(mean, dtype=float)


def judge_of(
    states: Sequence[str],
    targets: pd.DataFrame,
    found: pd.DataFrame,
    levels: NDArray[Any],
    weights: Float[Array, "draws images"],
) -> Judge:
    """Match the detections of a design and seed: columns as of `match_detections`, and `state`."""
    by_state = {
        state: match_detections(targets[targets["state"] == state], found[found["state"] == state]) for state in states
    }
    return Judge(by_state, levels, weights)


def draws_of(levels: NDArray[Any], seed: tuple[int, ...]) -> Float[Array, "draws images"]:
    """Return how often each image counts: once, then as drawn with replacement among those of its light level."""
    rng = np.random.default_rng(seed)
    weights = np.zeros((1 + _DRAWS, levels.size))
    weights[0] = 1.0
    for level in dict.fromkeys(levels.tolist()):
        here = np.flatnonzero(levels == level)
        weights[1:, here] = rng.multinomial(here.size, np.full(here.size, 1 / here.size), size=_DRAWS)
    return weights


def scores_of_draws(judges: Mapping[str, Sequence[Judge]], of: Subset, reference: str) -> Iterator[dict[str, Any]]:
    """Yield a row for each design: statistics, mean over the seeds, their differences from the reference, intervals.

    `judges`: of each seed, by design. Each seed is scored apart, and its scenes are drawn.
    """
    by_name = {name: _of_seeds([judge.statistics(of) for judge in own]) for name, own in judges.items()}
    for name, own in judges.items():
        n_targets = sum(
            int(_counted(of_state, of, judge.levels)[0].sum())
            for judge in own
            for state, of_state in judge.by_state.items()
            if of.state in (ALL, state)
        )
        row: dict[str, Any] = {"name": name, "targets": n_targets}
        for statistic, values in by_name[name].items():
            row |= _interval(values).within(0.0, 1.0).columns(statistic)
            row |= _interval(values - by_name[reference][statistic]).columns(f"{statistic}_apart")
        yield row


def _of_seeds(parts: Sequence[Mapping[str, Float[Array, " draws"]]]) -> dict[str, Float[Array, " draws"]]:
    return {name: _mean([part[name] for part in parts]) for name in parts[0]}


def _interval(values: Float[Array, " draws"]) -> Interval:
    """Return a value with the interval that holds 95 % of the draws, mirrored at it.

    Average precision of few scenes is too large, of draws of them twice so (the basic bootstrap: Davison and Hinkley,
    Bootstrap Methods, 1997, 2.4).
    """
    drawn = values[1:][np.isfinite(values[1:])]
    if not drawn.size:
        return Interval(float(values[0]), np.nan, np.nan)
    low, high = np.quantile(drawn, [(1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2])
    return Interval(float(values[0]), float(2 * values[0] - high), float(2 * values[0] - low))
