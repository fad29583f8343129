"""Scores of a reader's answers to the test images of a benchmark: errors, differences of CFAs, the ideal observer."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice, product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
import pyarrow as pa
from pyarrow import parquet as pq

from ...base.disk import read_input
from ...base.errors import DataError, SweepError, ValidationIssue, nearest
from ...base.types import Array, Float
from ...results.output import Output
from . import VISION
from .batches import image_id
from .keys import Vision
from .lamps import TEST
from .scenes import ALL, PROTOTYPES, SHUFFLED, UNSEEN, states_of
from .scores import Interval, interval_of_seeds

if TYPE_CHECKING:
    from ...api.objects import FinishedRun

UNKNOWN = "unknown"
_ID, _STATE = "image_id", "state"
_SUM = 1e-3
"""By how much the sum of probabilities may differ from 1."""
_BINS = 10
_MOST_BYTES, _MOST_CELLS = 100_000_000, 10_000_000
_BEGINNING_BYTES = 4096
_CONTROLS = re.compile(rb"[\x00-\x08\x0e-\x1f]")
"""Control bytes: archives and pictures have them within the first few bytes."""


@dataclass(frozen=True)
class Reader:
    """Answers of a reader to the test images.

    `answers`: `image_id`, `answer` (a state or `unknown`), and `confidence`, the probability of the answered state, or
    NaN.
    """

    name: str
    answers: pd.DataFrame


def vision_of(output: Output) -> Vision:
    """Return the benchmark of vision of a run; raises SweepError if it has none."""
    vision: Vision | None = output.study.key("vision")
    if vision is None:
        raise SweepError(ValidationIssue("the study has no `vision`", str(output.folder)))
    return vision


def unseen_images(output: Output) -> pd.DataFrame:
    """Return the images of a run that predictions are of, with their names."""
    vision_of(output)
    return images_of_test(output.tables[VISION])


def images_of_test(images: pd.DataFrame) -> pd.DataFrame:
    """Return the images of lamps that no reader has seen, with `image_id`."""
    unseen = images[images["lamps"] == UNSEEN]
    keys = zip(unseen["design_id"], unseen["seed"], unseen["order"], unseen["image"], strict=True)
    return unseen.assign(**{_ID: [image_id(d, seed, order, TEST, at) for d, seed, order, at in keys]})


def scores_of_table(output: Output, predictions: pd.DataFrame) -> pd.DataFrame:
    """Return the scores of a table of predictions."""
    images, vision = unseen_images(output), vision_of(output)
    reader = reader_of(predictions.reset_index(drop=True), Path("predictions"), images, states_of(vision))
    return scores_of(reader, images, vision.unknown_cost)


LEARNED = (PROTOTYPES,)
"""Readers of a run that learn."""


def network_of(images: pd.DataFrame, name: str) -> Reader:
    """Return a reader of the run as one of predictions."""
    columns = {_ID: _ID, name: "answer", f"{name}_p": "confidence"}
    return Reader(name, images[list(columns)].rename(columns=columns))


def table_of(path: Path) -> pd.DataFrame:
    """Return a CSV or Parquet file as a table, its rows counted from 0. Raises DataError if it cannot be read."""
    table = _table(path)
    if table.columns.has_duplicates:
        twice = table.columns[table.columns.duplicated()][0]
        raise DataError(ValidationIssue("two columns of one name", str(path), value=twice))
    return table


def _table(path: Path) -> pd.DataFrame:
    content = read_input(path, _MOST_BYTES, DataError)
    try:
        if path.suffix == ".parquet":
            return _parquet(path, content)
        if _CONTROLS.search(content[:_BEGINNING_BYTES]):
            raise DataError(ValidationIssue("not a text table", str(path), allowed="CSV, or Parquet named .parquet"))
        text = io.StringIO(content.decode("utf-8-sig"))
        first = [len(row) for row in islice(csv.reader(text), 2)]
        if len(set(first)) > 1:  # pandas would take the first of too many fields for an index
            problem = f"a row of {first[1]} fields under {first[0]} heads"
            raise DataError(ValidationIssue(problem, str(path), 2))
        text.seek(0)
        return pd.read_csv(text, low_memory=False)
    except (OSError, ValueError, csv.Error, MemoryError) as error:
        raise DataError(ValidationIssue(f"cannot be read: {' '.join(str(error).split())[:200]}", str(path))) from None


def _parquet(path: Path, content: bytes) -> pd.DataFrame:
    """Return a Parquet file as a table; one that would not fit is refused before it is unpacked."""
    texts = [field.name for field in pq.read_schema(pa.BufferReader(content)) if pa.types.is_string(field.type)]
    file = pq.ParquetFile(pa.BufferReader(content), read_dictionary=texts)  # equal texts are held once
    groups = [file.metadata.row_group(at) for at in range(file.metadata.num_row_groups)]
    cells = file.metadata.num_rows * file.metadata.num_columns
    if cells > _MOST_CELLS or sum(group.total_byte_size for group in groups) > _MOST_BYTES:
        allowed = f"up to {_MOST_CELLS:,} cells and {_MOST_BYTES:,} bytes"
        raise DataError(ValidationIssue("the table is too large", str(path), value=f"{cells:,} cells", allowed=allowed))
    table: pd.DataFrame = file.read().to_pandas(ignore_metadata=True)
    return table


def read_predictions(path: Path, images: pd.DataFrame, states: Sequence[str]) -> Reader:
    """Read a file of predictions: `image_id`, and a `state` (or `unknown`) or a probability of each state.

    Raises SweepError for a file that cannot be read, and as `reader_of`.
    """
    table = table_of(path)
    return reader_of(table, path, images, states)


def reader_of(table: pd.DataFrame, path: Path, images: pd.DataFrame, states: Sequence[str]) -> Reader:
    """Return the reader of a table of predictions.

    `path`: where the table comes from; its stem is the reader's name. Raises DataError for other columns, other, double
    or missing images, other states, and numbers that are no probabilities.
    """
    columns = [_ID, *([_STATE] if _STATE in table else states)]
    missing = [name for name in columns if name not in table]
    if missing:
        allowed = f"{_ID}, and {_STATE} or a column for each of {', '.join(states)}"
        raise DataError(ValidationIssue("a column is missing", str(path), None, None, missing[0], allowed))
    ids = table[_ID].astype(str)
    issues = [*_id_issues(path, ids, images[_ID])]
    if _STATE in table:
        answer, confidence = table[_STATE].astype(str), np.full(len(table), np.nan)
        other = answer[~answer.isin([*states, UNKNOWN])]
        if len(other):
            allowed, near = ", ".join([*states, UNKNOWN]), nearest(other.iloc[0], [*states, UNKNOWN])
            issues.append(issue_of("no state", path, other, _STATE, allowed, near))
    else:
        probabilities = table[list(states)].apply(numbers_of).to_numpy(dtype=float)
        known = (np.abs(probabilities.sum(axis=1) - 1) <= _SUM) & (probabilities >= 0).all(axis=1)
        shown = pd.Series([", ".join(f"{p:g}" for p in row) for row in probabilities[~known]], table.index[~known])
        if len(shown):
            issues.append(issue_of("no probabilities", path, shown, None, "numbers of 0 or more whose sum is 1"))
        answer = pd.Series(np.array(states)[np.nan_to_num(probabilities).argmax(axis=1)], index=table.index)
        confidence = probabilities.max(axis=1)
    if issues:
        raise DataError(issues)
    return Reader(path.stem, pd.DataFrame({_ID: ids, "answer": answer, "confidence": confidence}))


def _id_issues(path: Path, ids: pd.Series[str], known: pd.Series[str]) -> Iterator[ValidationIssue]:
    """Yield images that are not of the test, that stand twice, and that are missing."""
    others, double = ids[~ids.isin(known)], ids[ids.duplicated()]
    for problem, wrong in (("not an image of the test", others), ("an image stands twice", double)):
        if len(wrong):
            yield issue_of(problem, path, wrong, _ID)
    absent = known[~known.isin(ids)]
    if len(absent):
        problem, allowed = f"{len(absent):,} images of the test have no answer", f"all {len(known):,}, or `{UNKNOWN}`"
        yield ValidationIssue(problem, str(path), None, _ID, absent.iloc[0], allowed)


def numbers_of(values: pd.Series[Any]) -> pd.Series[float]:
    """Return values as numbers; NaN for what is none."""
    try:
        return pd.to_numeric(values, errors="coerce").astype(float)
    except (OverflowError, TypeError, ValueError):  # an integer of hundreds of digits; a date
        return pd.Series(np.nan, index=values.index)


def issue_of(
    problem: str,
    path: Path,
    wrong: pd.Series[str],
    key: str | None,
    allowed: str | None = None,
    near: str | None = None,
) -> ValidationIssue:
    """Return an issue with the first of the wrong values, its line and how many more there are."""
    more = f" (and {len(wrong) - 1:,} more)" if len(wrong) > 1 else ""
    return ValidationIssue(f"{problem}{more}", str(path), int(wrong.index[0]) + 2, key, wrong.iloc[0], allowed, near)


def scores_of(reader: Reader, images: pd.DataFrame, unknown_cost: float) -> pd.DataFrame:
    """Score a reader: one row per order of the lenses, distance and light level, each of them and all, and design.

    `error`: share of wrong answers (`unknown` is none), `cost`: with `unknown_cost` for each `unknown`. Intervals are
    Student's t over the seeds, of 95 %; differences are paired, since all designs show the same scenes: `apart` from
    the first design, `above_observer` from the ideal observer. `calibration_error`: mean over ten bins of confidence of
    the distance from the share of right answers, weighted by their answers.
    """
    table = images.merge(reader.answers, on=_ID, validate="one_to_one")
    table["unknown"] = table["answer"] == UNKNOWN
    table["wrong"] = (table["answer"] != table["state"]) & ~table["unknown"]
    table["cost"] = np.where(table["unknown"], unknown_cost, table["wrong"].astype(float))
    table["observer_wrong"] = table["observer"] != table["state"]
    rows = []
    conditions: list[tuple[Any, Any]] = [(ALL, ALL), *((d, ALL) for d in table["distance_m"].unique())]
    conditions += [*((ALL, level) for level in table["level"].unique())]
    conditions += [*product(table["distance_m"].unique(), table["level"].unique())]
    for order, (distance, level) in product(table["order"].unique(), conditions):
        answers = table[table["order"] == order]
        answers = answers if distance == ALL else answers[answers["distance_m"] == distance]
        answers = answers if level == ALL else answers[answers["level"] == level]
        first = answers[answers["design_id"] == answers["design_id"].iloc[0]]
        for (design_id, name), part in answers.groupby(["design_id", "name"], sort=False):
            rows.append(
                {"reader": reader.name, "order": order, "distance_m": str(distance), "level": level}
                | {"design_id": design_id, "name": name, "images": len(part), "unknown": part["unknown"].mean()}
                | _mean(part, "wrong").columns("error")
                | _mean(part, "cost").columns("cost")
                | _difference(part, first, "wrong", "wrong").columns("apart")
                | _mean(part, "observer_wrong").columns("observer_error")
                | _difference(part, part, "wrong", "observer_wrong").columns("above_observer")
                | {"calibration_error": _calibration(part)}
            )
    return pd.DataFrame(rows)


def _by_seed(answers: pd.DataFrame, column: str) -> Float[Array, " seeds"]:
    return answers.groupby("seed")[column].mean().to_numpy(dtype=float)


def _mean(answers: pd.DataFrame, column: str) -> Interval:
    return interval_of_seeds(float(answers[column].mean()), _by_seed(answers, column)).within(0.0, 1.0)


def _difference(answers: pd.DataFrame, other: pd.DataFrame, column: str, beside: str) -> Interval:
    value = float(answers[column].mean() - other[beside].mean())
    return interval_of_seeds(value, _by_seed(answers, column) - _by_seed(other, beside))


def _calibration(answers: pd.DataFrame) -> float:
    """Return the expected calibration error; NaN without probabilities."""
    known = answers.dropna(subset=["confidence"])
    if known.empty:
        return float("nan")
    bins = (known["confidence"] * _BINS).astype(int).clip(upper=_BINS - 1)
    by_bin = pd.DataFrame({"confidence": known["confidence"], "right": (~known["wrong"]).astype(float)}).groupby(bins)
    gaps = (by_bin["confidence"].mean() - by_bin["right"].mean()).abs() * by_bin.size()
    return float(gaps.sum() / len(known))


def whole_scores(scores: pd.DataFrame) -> pd.DataFrame:
    """Return the scores of all distances and light levels, lenses in any order where there are such images.

    Returns a row per reader and design.
    """
    shown = in_any_order(scores)
    return shown[(shown["distance_m"] == ALL) & (shown["level"] == ALL)]


def in_any_order(scores: pd.DataFrame) -> pd.DataFrame:
    """Return the scores of lenses in any order, or where there are none of those there are."""
    order = SHUFFLED if (scores["order"] == SHUFFLED).any() else scores["order"].iloc[0]
    return scores[scores["order"] == order]


def score_lines(scores: pd.DataFrame) -> Iterator[str]:
    """Yield a line per reader and design, of all test images with lenses in any order."""
    totals = whole_scores(scores)
    first = str(totals["name"].iloc[0])
    for row in totals.to_dict("records"):
        text = f"{row['reader']}, {row['name']}: errs on {_percent(row, 'error')} of {row['images']:,} images"
        text += f", unknown {row['unknown']:.1%}" if row["unknown"] else ""
        if row["name"] != first:
            note = "" if row["apart_low"] > 0 or row["apart_high"] < 0 else ", not told apart"
            text += f"; {_points(row, 'apart')} against {first}{note}"
        yield f"{text}; {_points(row, 'above_observer')} against the ideal observer's {row['observer_error']:.1%}."


def _points(row: Mapping[Any, Any], name: str) -> str:
    value, low, high = (f"{100 * row[key]:+.1f}" for key in (name, f"{name}_low", f"{name}_high"))
    return f"{value} points ({low} to {high})"


def _percent(row: Mapping[Any, Any], name: str) -> str:
    value, low, high = (f"{100 * row[key]:.1f}" for key in (name, f"{name}_low", f"{name}_high"))
    return f"{value} % ({low} to {high})"


def check_unique(names: Sequence[str]) -> None:
    """Raise an error if two readers have one name.

    Raises SweepError if they have.
    """
    if len(set(names)) < len(names):
        raise SweepError(ValidationIssue("two files of predictions have one name", value=", ".join(names)))


def scores(run: FinishedRun, predictions: pd.DataFrame) -> pd.DataFrame:
    """Score a reader's answers to the test images of the run's benchmark of vision.

    Parameters
    ----------
    run : FinishedRun
        Run of a study with `vision`.
    predictions : pandas.DataFrame
        Columns `image_id`, and `state` (or "unknown") or a probability of each state.

    Returns
    -------
    pandas.DataFrame
        Errors of each design, by order of the lenses, distance and light level, with intervals; differences from
        the first design and from the ideal observer, paired; calibration.

    Raises
    ------
    SweepError
        If the run has no images, and for other, double or missing images or answers.
    """
    return scores_of_table(run.output, predictions)
