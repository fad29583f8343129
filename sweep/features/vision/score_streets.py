"""Scores of a detector's boxes in the street images of a benchmark, by pycocotools: average precision and recall.

A distance is a range of areas, of boxes whose size is nearest to those there; a light level is its images, a state its
category. Intervals are from draws of the scenes of each light level, the same for all designs.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import redirect_stdout
from importlib.util import find_spec
from io import StringIO
from itertools import product
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from ...base.errors import DataError, SweepError, ValidationIssue
from ...base.types import Array, Float, FloatArray, IndexArray, Int
from ...results.output import Output
from . import VISION
from .boxes import HEAD, targets_of
from .keys import Vision
from .lamps import TEST
from .scenes import ALL, states_of
from .scores import CONFIDENCE, Interval
from .street import draw_streets, street_labels, street_shape

_KEY_OF_DRAWS, _DRAWS = 40, 100
_BOX = ["left", "top", "width", "height"]
_EVERYTHING = (0.0, 1e10)
STATISTICS = ("ap50", "ap", "recall")


class Subset(NamedTuple):
    """Which targets count; `ALL` for any."""

    state: str = ALL
    distance_m: float | str = ALL
    level: str = ALL


def labels_of_test(output: Output) -> pd.DataFrame:
    """Return the labels of a run's test images of streets.

    Returns a row per image, see `street_labels`.
    """
    vision = vision_with_streets(output)
    designs = output.tables[VISION][["design_id", "name", "cfa"]].drop_duplicates().to_dict("records")
    tables = []
    for number in range(vision.seeds):
        assert vision.street is not None
        scenes = draw_streets(vision, vision.street, TEST, (output.study.seed, number))
        for design in designs:
            key, mosaic = {str(name): value for name, value in design.items()}, output.mosaic(design["cfa"])
            tables.append(street_labels(vision, mosaic, scenes, key | {"seed": number}, TEST))
    return pd.concat(tables, ignore_index=True)


def vision_with_streets(output: Output) -> Vision:
    """Return the benchmark of a run with streets; raises SweepError if it has none."""
    vision: Vision | None = output.study.key("vision")
    if vision is None or vision.street is None:
        raise SweepError(ValidationIssue("the study has no `vision.street`", str(output.folder)))
    return vision


def shape_of(output: Output, cfa: str) -> tuple[int, int]:
    """Return the size of the streets of a CFA, pixels."""
    return street_shape(vision_with_streets(output), output.mosaic(cfa).indices.shape)


class Judge:
    """Targets and answers of one design, seed and kind of box, matched by pycocotools."""

    def __init__(
        self, targets: pd.DataFrame, found: pd.DataFrame, states: Sequence[str], n_images: int, *, strict: bool = True
    ) -> None:
        """Match; `targets`: of `targets_of`; `found`: `image`, `state`, box, `score`; not `strict`: by 0.5 alone."""
        from pycocotools.coco import COCO  # noqa: PLC0415  (an extra, which scores of boxes need)
        from pycocotools.cocoeval import COCOeval  # noqa: PLC0415

        numbers = {state: number for number, state in enumerate(states, 1)}
        with redirect_stdout(StringIO()):
            truth = COCO()
            truth.dataset = {
                "images": [{"id": number} for number in range(n_images)],
                "categories": [{"id": number, "name": state} for state, number in numbers.items()],
                "annotations": [
                    box | {"id": at, "iscrowd": 0, "area": box["bbox"][2] * box["bbox"][3]}
                    for at, box in enumerate(_boxes(targets, numbers), 1)
                ],
            }
            truth.createIndex()
            scores = found["score"].tolist()
            answers = [box | {"score": score} for box, score in zip(_boxes(found, numbers), scores, strict=True)]
            self._of = COCOeval(truth, truth.loadRes(answers) if answers else COCO(), "bbox")
            self.distances_m, ranges = _ranges(targets)
            self._of.params.areaRng = [_EVERYTHING, *ranges]
            self._of.params.areaRngLbl = [str(at) for at in range(len(ranges) + 1)]
            self._of.params.maxDets = [100]
            if not strict:
                self._of.params.iouThrs = np.array([0.5])
            self._of.evaluate()
        shape = len(states), 1 + len(ranges), n_images
        self._cells = np.empty(shape, dtype=object)
        self._cells.ravel()[:] = self._of.evalImgs

    def means(self, images: Int[IndexArray, " images"]) -> tuple[Float[Array, "thresholds states sizes"], FloatArray]:
        """Return average precision and largest recall over some images, which may be there several times."""
        self._of.evalImgs = self._cells[:, :, images].ravel().tolist()
        self._of.params.imgIds = self._of._paramsEval.imgIds = list(range(images.size))
        with redirect_stdout(StringIO()):
            self._of.accumulate()
        precision, recall = (np.array(self._of.eval[name][..., 0]) for name in ("precision", "recall"))
        return np.where(precision < 0, np.nan, precision).mean(axis=1), np.where(recall < 0, np.nan, recall)


def _boxes(table: pd.DataFrame, numbers: Mapping[str, int]) -> list[dict[str, Any]]:
    columns = table["image"].tolist(), table["state"].tolist(), table[_BOX].astype(float).to_numpy().tolist()
    return [
        {"image_id": int(image), "category_id": numbers[state], "bbox": box}
        for image, state, box in zip(*columns, strict=True)
    ]


def _ranges(targets: pd.DataFrame) -> tuple[list[float], list[tuple[float, float]]]:
    """Return distances, and the areas nearer to their median one, in ratio, than to others."""
    area = (targets["width"] * targets["height"]).groupby(targets["distance_m"]).median().sort_values()
    ends = np.sqrt(area.to_numpy()[:-1] * area.to_numpy()[1:]).tolist()
    return area.index.tolist(), [*zip([0.0, *ends], [*ends, _EVERYTHING[1]], strict=True)]


def street_scores(output: Output, reader: str, detections: pd.DataFrame, labels: pd.DataFrame) -> pd.DataFrame:
    """Score a detector: rows for each kind of box, and in it for states, distances and light levels.

    Designs without a detection are left out; the others are compared with the first of them.
    """
    vision, tables = vision_with_streets(output), list[pd.DataFrame]()
    for kind, boxes in detections.groupby("kind", sort=False):
        names, states = _answered(reader, boxes, labels), states_of(vision) if kind == HEAD else vision.lenses
        values: dict[str, list[dict[Subset, FloatArray]]] = {name: [] for name in names}
        counts = dict[tuple[str, Subset], int]()
        # All designs show the same scenes: of one seed they are drawn alike.
        for number, of_seed in labels.groupby("seed"):
            levels = of_seed.drop_duplicates("image").sort_values("image")["level"].to_numpy()
            draws = _draws(levels, (output.study.seed, _KEY_OF_DRAWS, int(of_seed["seed"].iloc[0])))
            for name in names:
                images = of_seed[of_seed["name"] == name]
                targets = targets_of(images, str(kind), shape_of(output, images["cfa"].iloc[0]))
                found = boxes[boxes["seed"].eq(number) & boxes["name"].eq(name)]
                values[name].append(_of_seed(vision, states, targets, found, levels, draws))
                for of in values[name][-1]:
                    counts[name, of] = counts.get((name, of), 0) + _count(targets, of)
        for of in values[names[0]][0]:
            by_name = {name: _mean([seed[of] for seed in seeds]) for name, seeds in values.items()}
            where = {key: f"{value:g}" if isinstance(value, float) else value for key, value in of._asdict().items()}
            rows = [
                {"reader": reader, "kind": kind, **where, "name": name, "targets": counts[name, of]}
                | _columns(by_name[name], by_name[names[0]])
                for name in names
            ]
            tables.append(pd.DataFrame(rows))
    return pd.concat(tables, ignore_index=True)


def _of_seed(
    vision: Vision,
    states: Sequence[str],
    targets: pd.DataFrame,
    found: pd.DataFrame,
    levels: np.ndarray,
    draws: Int[IndexArray, "draws images"],
) -> dict[Subset, Float[Array, "rows statistics"]]:
    """Return the statistics of each subset: as they are, then for each draw, of which only `ap50` is computed."""
    matched = Judge(targets, found, states, levels.size), Judge(targets, found, states, levels.size, strict=False)
    result: dict[Subset, list[FloatArray]] = {of: [] for of in _subsets(vision, states)}
    for at, images in enumerate([np.arange(levels.size), *draws]):
        judge = matched[at > 0]
        of_levels = {level: images[levels[images] == level] for level in dict.fromkeys(levels.tolist())}
        of_images = {level: judge.means(some) for level, some in {ALL: images, **of_levels}.items()}
        for of, values in result.items():
            values.append(_statistics(judge, of, states, *of_images[of.level]))
    return {of: np.stack(values) for of, values in result.items()}


def _statistics(
    judge: Judge, of: Subset, states: Sequence[str], precision: FloatArray, recall: FloatArray
) -> Float[Array, " statistics"]:
    """Return `ap50`, `ap` and `recall` of a subset, means over the states that have targets."""
    size = 0 if of.distance_m == ALL else 1 + judge.distances_m.index(float(of.distance_m))
    which = slice(None) if of.state == ALL else [list(states).index(of.state)]
    parts = precision[0, which, size], precision[:, which, size].mean(axis=0), recall[:, which, size].mean(axis=0)
    return np.array([_mean(part.tolist()) for part in parts])


def _mean(parts: Sequence[Any]) -> FloatArray:
    """Return the mean of what is known; NaN of nothing."""
    values = np.array(parts, dtype=float)
    known = np.isfinite(values)
    total, count = np.where(known, values, 0.0).sum(axis=0), known.sum(axis=0)
    return np.asarray(np.divide(total, count, out=np.full(np.shape(total), np.nan), where=count > 0))


def _subsets(vision: Vision, states: Sequence[str]) -> Iterator[Subset]:
    """Yield what is told: all, and each state, distance and level, and each state at each distance."""
    yield Subset()
    yield from (Subset(state=state) for state in states)
    yield from (Subset(distance_m=distance) for distance in vision.distances_m)
    yield from (Subset(level=level) for level in vision.levels)
    yield from (Subset(state=state, distance_m=distance) for state, distance in product(states, vision.distances_m))


def _count(targets: pd.DataFrame, of: Subset) -> int:
    here = [targets[name].eq(value) for name, value in of._asdict().items() if value != ALL]
    return int(np.logical_and.reduce(here).sum()) if here else len(targets)


def _draws(levels: np.ndarray, seed: tuple[int, ...]) -> Int[IndexArray, "draws images"]:
    """Return images as drawn with replacement among those of their light level."""
    rng = np.random.default_rng(seed)
    groups = [np.flatnonzero(levels == level) for level in dict.fromkeys(levels.tolist())]
    return np.stack([np.concatenate([rng.choice(group, group.size) for group in groups]) for _ in range(_DRAWS)])


def _columns(values: Float[Array, "rows statistics"], first: Float[Array, "rows statistics"]) -> dict[str, float]:
    """Return statistics and their differences from the first design; those of `ap50` with intervals."""
    row = dict[str, float]()
    for at, name in enumerate(STATISTICS):
        row |= {name: float(values[0, at]), f"{name}_apart": float(values[0, at] - first[0, at])}
    row |= _interval(values[:, 0]).within(0.0, 1.0).columns(STATISTICS[0])
    return row | _interval(values[:, 0] - first[:, 0]).columns(f"{STATISTICS[0]}_apart")


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


def _answered(reader: str, detections: pd.DataFrame, labels: pd.DataFrame) -> list[str]:
    """Return the designs that a detector has answered, in all seeds; raises DataError where it has not."""
    seeds = labels["seed"].nunique()
    counts = detections.groupby("name")["seed"].nunique()
    for name, count in counts.items():
        if count < seeds:
            problem = f"no detections of {name} in {seeds - count} of {seeds} seeds"
            raise DataError(ValidationIssue(problem, reader, allowed="answers to all streets of the test"))
    return [str(name) for name in labels["name"].unique() if name in counts]


def require_pycocotools() -> None:
    """Raise SweepError if pycocotools is not installed."""
    if find_spec("pycocotools") is None:
        problem = "scores of boxes need pycocotools, which is not installed"
        raise SweepError(ValidationIssue(problem, allowed="pip install 'cfa-sweep[vision]'"))


def of_all_targets(scores: pd.DataFrame) -> pd.DataFrame:
    """Return the scores of all targets of a kind."""
    return scores[(scores[list(Subset._fields)] == ALL).all(axis=1)]


def street_lines(scores: pd.DataFrame) -> Iterator[str]:
    """Yield a line per detector, kind of box and design, over all targets."""
    totals = of_all_targets(scores)
    for (reader, kind), rows in totals.groupby(["reader", "kind"], sort=False):
        first = rows["name"].iloc[0]
        for row in rows.to_dict("records"):
            text = f"{reader}, {kind}s, {row['name']}: average precision {_told(row, 'ap50')}"
            text += f", over overlaps of 0.5 to 0.95 {row['ap']:.3f}"
            if row["name"] != first:
                note = "" if row["ap50_apart_low"] > 0 or row["ap50_apart_high"] < 0 else ", not told apart"
                text += f"; {_told(row, 'ap50_apart', '+')} against {first}{note}"
            if row["ap50"] == 0:
                text += ": no box covers its target by half; corners for sizes, or numbers of categories from 0?"
            yield f"{text}."


def _told(row: Mapping[Any, Any], name: str, sign: str = "") -> str:
    value, low, high = (f"{row[f'{name}{end}']:{sign}.3f}" for end in ("", "_low", "_high"))
    return value if low == high else f"{value} ({low} to {high})"
