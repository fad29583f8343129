"""Scores of a detector's answers to the street images of a benchmark: average precision, what is found, differences."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from typing import Any

import numpy as np
import pandas as pd

from ..base.errors import DataError, SweepError, ValidationIssue
from ..results.output import Output
from ..results.tables import VISION
from ..vision.boxes import HEAD, targets_of
from ..vision.detections import ALL, Judge, Subset, draws_of, judge_of, scores_of_draws
from ..vision.lamps import TEST
from ..vision.scenes import states_of
from ..vision.section import Vision
from ..vision.street import draw_streets, street_labels, street_shape

_KEY_OF_DRAWS = 40


def labels_of_test(output: Output) -> pd.DataFrame:
    """Return the labels of a run's test images of streets.

    Returns a row per image, see `street_labels`.
    """
    vision = vision_with_streets(output)
    designs = output.vision[VISION][["design_id", "name", "cfa"]].drop_duplicates().to_dict("records")
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
    vision = output.study.vision
    if vision is None or vision.street is None:
        raise SweepError(ValidationIssue("the study has no `vision.street`", str(output.folder)))
    return vision


def shape_of(output: Output, cfa: str) -> tuple[int, int]:
    """Return the size of the streets of a CFA, pixels."""
    return street_shape(vision_with_streets(output), output.mosaic(cfa).indices.shape)


def street_scores(output: Output, reader: str, detections: pd.DataFrame, labels: pd.DataFrame) -> pd.DataFrame:
    """Score a detector: rows for each kind of box, and in it for states, distances, levels and intensities.

    Designs without a detection are left out; the others are compared with the first of them.
    """
    vision = vision_with_streets(output)
    judges: dict[str, dict[str, list[Judge]]] = {}
    names = {str(kind): _answered(reader, own, labels) for kind, own in detections.groupby("kind", sort=False)}
    # All designs show the same scenes: of one seed they are drawn alike.
    for number, of_seed in labels.groupby("seed"):
        levels = of_seed.drop_duplicates("image").sort_values("image")["level"].to_numpy()
        draws = draws_of(levels, (output.study.seed, _KEY_OF_DRAWS, *of_seed["seed"].head(1)))
        for kind, name in ((kind, name) for kind, own in names.items() for name in own):
            images = of_seed[of_seed["name"] == name]
            targets = targets_of(images, kind, shape_of(output, images["cfa"].iloc[0]))
            own = detections["seed"].eq(number) & detections["name"].eq(name) & detections["kind"].eq(kind)
            judge = judge_of(_states(vision, kind), targets, detections[own], levels, draws)
            judges.setdefault(kind, {}).setdefault(name, []).append(judge)
    tables = []
    for kind, by_name in judges.items():
        for of in _subsets(vision, kind):
            rows = pd.DataFrame(scores_of_draws(by_name, of, names[kind][0]))
            where = {key: f"{value:g}" if isinstance(value, float) else value for key, value in of._asdict().items()}
            tables.append(rows.assign(reader=reader, kind=kind, **where))
    first = ["reader", "kind", *Subset._fields]
    scores = pd.concat(tables, ignore_index=True)
    return scores[[*first, *(name for name in scores.columns if name not in first)]]


def _answered(reader: str, detections: pd.DataFrame, labels: pd.DataFrame) -> list[str]:
    """Return the designs that a detector has answered, in all seeds; raises DataError where it has not."""
    seeds = labels["seed"].nunique()
    counts = detections.groupby("name")["seed"].nunique()
    for name, count in counts.items():
        if count < seeds:
            problem = f"no detections of {name} in {seeds - count} of {seeds} seeds"
            raise DataError(ValidationIssue(problem, reader, allowed="answers to all streets of the test"))
    return [str(name) for name in labels["name"].unique() if name in counts]


def _states(vision: Vision, kind: str) -> Sequence[str]:
    return states_of(vision) if kind == HEAD else vision.lenses


def _subsets(vision: Vision, kind: str) -> Iterator[Subset]:
    """Yield what is told: all, and each state, distance, level and intensity, and each state at each distance."""
    states = _states(vision, kind)
    yield Subset()
    yield from (Subset(state=state) for state in states)
    yield from (Subset(distance_m=distance) for distance in vision.distances_m)
    yield from (Subset(level=level) for level in vision.levels)
    yield from (Subset(intensity_cd=candelas) for candelas in vision.intensities_cd)
    yield from (Subset(state=state, distance_m=distance) for state, distance in product(states, vision.distances_m))


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
            text += f", over overlaps of 0.5 to 0.95 {_told(row, 'ap')}" if np.isfinite(row["ap"]) else ""
            if row["name"] != first:
                note = "" if row["ap50_apart_low"] > 0 or row["ap50_apart_high"] < 0 else ", not told apart"
                text += f"; {_told(row, 'ap50_apart', '+')} against {first}{note}"
            if row["ap50"] == 0:
                text += ": no box covers its target by half; corners for sizes, or numbers of categories from 0?"
            yield f"{text}."


def _told(row: Mapping[Any, Any], name: str, sign: str = "") -> str:
    value, low, high = (f"{row[f'{name}{end}']:{sign}.3f}" for end in ("", "_low", "_high"))
    return value if low == high else f"{value} ({low} to {high})"
