"""Scores of a detector's answers to the street images of a benchmark: average precision, differences of CFAs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from ..base.errors import DataError, ValidationIssue, nearest
from ..study import Study
from ..vision.detections import precisions
from ..vision.images import HeadCamera
from ..vision.lamps import TEST, split_lamps
from ..vision.scores import interval_of_seeds
from ..vision.street import StreetCamera, draw_streets
from .score import issue_of, table_of
from .vision import vision_designs

COLUMNS = ("image_id", "x_px", "y_px", "state", "score")
_ALL = "all"


def is_of_streets(path: Path) -> bool:
    """Return whether a file of answers has positions.

    Parameters
    ----------
    path : Path
        CSV or Parquet.

    Returns
    -------
    bool
        True for detections.
    """
    return "x_px" in table_of(path)


def street_labels(study: Study, rows: pd.DataFrame) -> pd.DataFrame:
    """Return the labels of a run's test images of streets.

    Parameters
    ----------
    study : Study
        Study of the run.
    rows : pandas.DataFrame
        Rows of plain CFAs, named designs and the answer.

    Returns
    -------
    pandas.DataFrame
        A row per image, see `StreetCamera.labels`.
    """
    vision = study.section.vision
    assert vision is not None
    assert vision.street is not None
    tables = []
    for row, setup, curves in vision_designs(study, rows):
        streets = StreetCamera(HeadCamera(setup, curves, vision), vision.street)
        for number in range(vision.seeds):
            seed = study.section.seed, number
            scenes = draw_streets(vision, vision.street, split_lamps(setup.lights, vision, seed)[TEST], TEST, seed)
            key = {name: row[name] for name in ("design_id", "name", "cfa")} | {"seed": number}
            tables.append(streets.labels(scenes, key, TEST))
    return pd.concat(tables, ignore_index=True)


def read_detections(path: Path, labels: pd.DataFrame, lenses: Sequence[str]) -> pd.DataFrame:
    """Read a file of detections: a row each, with `image_id`, `x_px`, `y_px`, `state` and `score`.

    Parameters
    ----------
    path : Path
        CSV or Parquet; positions are from the center of the first pixel.
    labels : pandas.DataFrame
        Result of `street_labels`.
    lenses : sequence of str
        Signal types.

    Returns
    -------
    pandas.DataFrame
        Detections.

    Raises
    ------
    DataError
        For a file that cannot be read, other columns, images or states, and what is no number.
    """
    table = table_of(path)
    missing = [name for name in COLUMNS if name not in table]
    if missing:
        raise DataError(ValidationIssue("a column is missing", str(path), None, None, missing[0], ", ".join(COLUMNS)))
    issues = []
    ids, states = table["image_id"].astype(str), table["state"].astype(str)
    others, unknown = ids[~ids.isin(labels["image_id"])], states[~states.isin(lenses)]
    if len(others):
        issues.append(issue_of("not an image of a street of the test", path, others, "image_id"))
    if len(unknown):
        near = nearest(unknown.iloc[0], lenses)
        issues.append(issue_of("no signal type", path, unknown, "state", ", ".join(lenses), near))
    numbers = {name: pd.to_numeric(table[name], errors="coerce") for name in ("x_px", "y_px", "score")}
    for name, values in numbers.items():
        wrong = table[name][~np.isfinite(values)].astype(str)
        if len(wrong):
            issues.append(issue_of("no number", path, wrong, name, "a number"))
    if issues:
        raise DataError(issues)
    return pd.DataFrame({"image_id": ids, "state": states, **numbers})


def street_scores(reader: str, detections: pd.DataFrame, labels: pd.DataFrame, lenses: Sequence[str]) -> pd.DataFrame:
    """Score a detector: one row per design and light level, and all levels, with 95 % intervals over the seeds.

    Parameters
    ----------
    reader : str
        Name of the detector.
    detections : pandas.DataFrame
        Result of `read_detections`.
    labels : pandas.DataFrame
        Result of `street_labels`.
    lenses : sequence of str
        Signal types.

    Returns
    -------
    pandas.DataFrame
        Columns `reader`, `name`, `level`, `average_precision` (mean over signal types) and `apart`, its difference from
        the first design, paired; both with `_low` and `_high`.
    """
    parts = [
        precisions(images, detections, lenses).assign(name=name, seed=seed_number)
        for (name, seed_number), images in _by_design_and_seed(labels)
    ]
    table = pd.concat(parts, ignore_index=True)
    by_seed = table.pivot_table("average_precision", ["name", "level"], "seed", sort=False)
    whole = by_seed.groupby(level="name", sort=False).mean()
    by_level = {_ALL: whole} | {str(v): by_seed.xs(v, level="level") for v in table["level"].unique()}
    rows = []
    for level, values in by_level.items():
        for name in values.index:
            row: dict[str, Any] = {"reader": reader, "name": str(name), "level": level}
            for column, of_seeds in (
                ("average_precision", values.loc[name]),
                ("apart", values.loc[name] - values.iloc[0]),
            ):
                interval = interval_of_seeds(float(of_seeds.mean()), of_seeds.to_numpy(dtype=float))
                row |= {column: interval.value, f"{column}_low": interval.low, f"{column}_high": interval.high}
            rows.append(row)
    return pd.DataFrame(rows)


def _by_design_and_seed(labels: pd.DataFrame) -> Iterator[tuple[tuple[str, int], pd.DataFrame]]:
    for (name, seed), images in labels.groupby(["name", "seed"], sort=False):
        yield (str(name), int(str(seed))), images


def street_lines(scores: pd.DataFrame) -> Iterator[str]:
    """Yield a line per detector and design, over all light levels.

    Parameters
    ----------
    scores : pandas.DataFrame
        Result of `street_scores`, of one detector or more.

    Yields
    ------
    str
        Line.
    """
    whole = scores[scores["level"] == _ALL]
    first = whole["name"].iloc[0]
    for row in whole.to_dict("records"):
        text = f"{row['reader']}, {row['name']}: average precision {row['average_precision']:.3f}"
        text += f" ({row['average_precision_low']:.3f} to {row['average_precision_high']:.3f})"
        if row["name"] != first:
            note = "" if row["apart_low"] > 0 or row["apart_high"] < 0 else ", not told apart"
            text += f"; {row['apart']:+.3f} ({row['apart_low']:+.3f} to {row['apart_high']:+.3f}) against {first}{note}"
        yield f"{text}."
