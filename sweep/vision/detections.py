"""Scores of detections of lit lenses: average precision of each signal type."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from ..base.types import Array, Bool, BoolArray, Float
from .scores import interval_of_seeds

ALL = "all"
"""In place of a light level or distance: all of them."""
_LEAST_RADIUS_PX = 2.0


def match_radius_px(diameter_px: Float[Array, " detections"]) -> Float[Array, " detections"]:
    """Return how far a detection may be from the center of a lit lens: its diameter, and at least 2 pixels."""
    return np.asarray(np.maximum(diameter_px, _LEAST_RADIUS_PX), dtype=float)


def average_precision(
    right: Bool[BoolArray, " detections"], score: Float[Array, " detections"], n_targets: int
) -> float:
    """Return the area under the curve of precision over recall, of the largest precision at that recall or more.

    As of PASCAL VOC since 2010 (Everingham et al., IJCV 2015), over all recalls.

    `right`: True for detections of a target that no detection of a higher score has found. Returns 0 to 1. NaN without
    targets.
    """
    if not n_targets:
        return float("nan")
    order = np.argsort(-score, kind="stable")
    hits = np.cumsum(right[order])
    precision = hits / np.arange(1, hits.size + 1)
    best = np.maximum.accumulate(precision[::-1])[::-1]
    return float(best[right[order]].sum() / n_targets)


def precisions(labels: pd.DataFrame, detections: pd.DataFrame, lenses: Sequence[str]) -> pd.DataFrame:
    """Return the average precision of each signal type in the images of each light level.

    A detection is right within `match_radius_px` of a lit lens of its state that no detection of a higher score has
    found; everything else, brake lamps and heads that are off among it, is wrong. Columns `level`, `state`, `lit`
    (number of lit lenses), `average_precision`; of detections `image_id`, `x_px`, `y_px`, `state`, `score`.
    """
    names = ["state", "head_x_px", "lit_y_px", "lens_diameter_px"]
    targets = labels[["image_id", "level", *names]].explode(names, ignore_index=True)
    located = detections.merge(labels[["image_id", "level"]], on="image_id").reset_index(drop=True)
    rows = []
    for level in labels["level"].unique():
        for state in lenses:
            here, said = (part[(part["level"] == level) & (part["state"] == state)] for part in (targets, located))
            said = said.sort_values("score", ascending=False, kind="stable")
            ap = average_precision(_right(here, said), said["score"].to_numpy(dtype=float), len(here))
            rows.append({"level": level, "state": state, "lit": len(here), "average_precision": ap})
    return pd.DataFrame(rows)


def precision_scores(table: pd.DataFrame, reference: str) -> pd.DataFrame:
    """Return average precisions, mean over signal types, with 95 % intervals over the seeds.

    Returns a row per light level (first all of them) and design: `name`, `level`, `average_precision`, and `apart`, the
    paired difference from the reference.
    """
    by_level = {
        str(level): part.pivot_table("average_precision", "name", "seed", sort=False)
        for level, part in ((ALL, table), *table.groupby("level", sort=False))
    }
    rows = []
    for level, values in by_level.items():
        for name in values.index:
            row: dict[str, Any] = {"name": str(name), "level": level}
            differences = values.loc[name] - values.loc[reference]
            for column, of_seeds in (("average_precision", values.loc[name]), ("apart", differences)):
                row |= interval_of_seeds(float(of_seeds.mean()), np.array(of_seeds, dtype=float)).columns(column)
            rows.append(row)
    return pd.DataFrame(rows)


def _right(targets: pd.DataFrame, detections: pd.DataFrame) -> Bool[BoolArray, " detections"]:
    """Return which detections, by falling score, have found a target."""
    rows = {name: np.asarray(at, dtype=np.intp) for name, at in targets.groupby("image_id").indices.items()}
    x_px, y_px, radius_px = (
        targets[name].to_numpy(dtype=float) for name in ("head_x_px", "lit_y_px", "lens_diameter_px")
    )
    radius_px, is_taken = match_radius_px(radius_px), np.zeros(len(targets), dtype=bool)
    right = np.zeros(len(detections), dtype=bool)
    for i, (name, x, y) in enumerate(zip(detections["image_id"], detections["x_px"], detections["y_px"], strict=True)):
        here = rows.get(name, np.empty(0, dtype=np.intp))
        away = np.hypot(x_px[here] - x, y_px[here] - y)
        free = (away <= radius_px[here]) & ~is_taken[here]
        if free.any():
            right[i] = True
            is_taken[here[np.where(free, away, np.inf).argmin()]] = True
    return right
