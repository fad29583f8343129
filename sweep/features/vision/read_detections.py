"""Files of detections in streets: results of COCO, or a folder of them."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from ...base.disk import read_input
from ...base.errors import DataError, ValidationIssue, nearest
from .boxes import Category

_BOX = ("left", "top", "width", "height")
_MOST_BYTES = 500_000_000
_MOST = 1e9
"""Of numbers in boxes and scores."""
_BEYOND, _MANY_BEYOND = 1.05, 0.1
"""How far beyond an image a box ends, relative to it, and of which share of them it is refused."""
Shape = tuple[int, int]


def is_of_streets(path: Path) -> bool:
    """Return whether answers are detections: a folder, or COCO results."""
    return path.is_dir() or path.suffix.lower() == ".json"


def reader_name(path: Path) -> str:
    """Return the name of the detector of a file or folder."""
    return path.resolve().name if path.is_dir() else path.stem


def read_detections(
    path: Path, labels: pd.DataFrame, categories: Sequence[Category], shape: Callable[[str], Shape]
) -> pd.DataFrame:
    """Read detections: `name`, `seed` and `image` of the street, `kind`, `state`, box, `score`.

    `labels`: of the streets of the test; `shape`: rows and columns of the images of a CFA. Raises DataError for what
    cannot be read, for other images and categories, and what is no number.
    """
    found = (_of_folder if path.is_dir() else _of_coco)(path, labels, categories, shape)
    return found.merge(labels[["image_id", "name", "seed", "image"]], on="image_id")


def _of_folder(
    path: Path, labels: pd.DataFrame, categories: Sequence[Category], shape: Callable[[str], Shape]
) -> pd.DataFrame:
    """Read the results of one detector, in folders at any depth."""
    of_image, parts = dict[str, Path](), list[pd.DataFrame]()
    for file in sorted(path.rglob("*.json")):
        parts.append(_of_coco(file, labels, categories, shape))
        for name in parts[-1]["image_id"].unique():
            _once(of_image, name, file)
    if not parts:
        raise DataError(ValidationIssue("no detections", str(path), allowed="*.json, results of COCO"))
    return pd.concat(parts, ignore_index=True)


def _once(of_image: dict[str, Path], name: str, file: Path) -> None:
    """Refuse an image in two files, such as those of two runs of a detector."""
    if (other := of_image.setdefault(name, file)) != file:
        raise DataError(ValidationIssue(f"an image stands in {other}, too", str(file), value=name))


def _of_coco(
    path: Path, labels: pd.DataFrame, categories: Sequence[Category], shape: Callable[[str], Shape]
) -> pd.DataFrame:
    """Read results as pycocotools writes and reads them; images by number, or by the stem of their file."""
    try:
        held = json.loads(_text(path))
    except (ValueError, RecursionError) as error:
        raise DataError(ValidationIssue(f"no JSON: {str(error)[:100]}", str(path))) from None
    if not isinstance(held, list):
        problem, allowed = "no results of COCO", "a list of image_id, category_id, bbox and score"
        raise DataError(ValidationIssue(problem, str(path), None, None, type(held).__name__, allowed))
    known: dict[object, str] = dict(zip(labels["coco_id"], labels["image_id"], strict=True))
    known |= {name: name for name in labels["image_id"]}
    rows = []
    for at, entry in enumerate(held):
        key, fault = f"[{at}]", None
        one = entry if isinstance(entry, Mapping) else {}
        image, number, box, score = (one.get(name) for name in ("image_id", "category_id", "bbox", "score"))
        missing = [name for name in ("image_id", "category_id", "bbox", "score") if name not in one]
        is_number = isinstance(image, int) and not isinstance(image, bool)
        name = known.get(image if is_number else Path(str(image)).stem)
        if missing:
            fault = ValidationIssue(
                "a key is missing", str(path), None, key, missing[0], "image_id, category_id, bbox, score"
            )
        elif name is None:
            fault = _of_other_image(path, f"{key}.image_id", image, labels)
        elif isinstance(number, bool) or not (isinstance(number, int) and 1 <= number <= len(categories)):
            allowed = ", ".join(f"{i} ({category.name})" for i, category in enumerate(categories, 1))
            fault = ValidationIssue("no category", str(path), None, f"{key}.category_id", number, allowed)
        elif not _is_box(box):
            allowed = "left, top, width and height, pixels"
            fault = ValidationIssue("no box", str(path), None, f"{key}.bbox", box, allowed)
        elif not _is_number(score):
            fault = ValidationIssue("no number", str(path), None, f"{key}.score", score, "a number")
        if fault is not None:
            raise DataError(fault)
        rows.append((name, *categories[number - 1], *map(float, box), float(score)))  # type: ignore[operator, arg-type]
    found = _frame(rows)
    _refuse_beyond(path, found, dict(zip(labels["image_id"], labels["cfa"].map(shape), strict=True)))
    return found


def _refuse_beyond(path: Path, found: pd.DataFrame, shapes: Mapping[str, Shape]) -> None:
    """Refuse boxes of which many reach beyond their images, as corners do that are taken for sizes."""
    high, wide = (found["image_id"].map(lambda name, at=at: shapes[name][at]) for at in (0, 1))
    beyond = (found["left"] + found["width"] > _BEYOND * wide) | (found["top"] + found["height"] > _BEYOND * high)
    if beyond.mean() > _MANY_BEYOND:
        problem, value = "boxes reach beyond their images", f"{beyond.sum()} of {len(beyond)}"
        allowed = "left, top, width and height in pixels of the exported images; no corners"
        raise DataError(ValidationIssue(problem, str(path), None, None, value, allowed))


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) < _MOST


def _is_box(value: object) -> bool:
    return isinstance(value, list) and len(value) == len(_BOX) and all(map(_is_number, value)) and min(value[2:]) >= 0


def _of_other_image(path: Path, key: str | None, image: object, labels: pd.DataFrame) -> ValidationIssue:
    numbers = labels["coco_id"]
    allowed = f"{numbers.min()} to {numbers.max()}, or names such as {labels['image_id'].iloc[0]}"
    near = nearest(image, labels["image_id"]) if isinstance(image, str) else None
    return ValidationIssue("not an image of a street of the test", str(path), None, key, image, allowed, near)


def _text(path: Path) -> str:
    try:
        return read_input(path, _MOST_BYTES, DataError).decode("utf-8-sig")
    except ValueError:
        raise DataError(ValidationIssue("no text in UTF-8", str(path))) from None


def _frame(rows: Sequence[tuple[Any, ...]]) -> pd.DataFrame:
    return pd.DataFrame(rows, columns=["image_id", "kind", "state", *_BOX, "score"])
