"""Boxes around heads and lit lenses in streets, as COCO and YOLO have them."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pandas as pd
import pyarrow.parquet as pq

from ...results.atomic import atomic
from .boxes import HEAD, LAMP, categories_of, targets_of
from .keys import Vision

_SPLITS = {"train": "train", "check": "val", "test": "test"}
"""Names of the splits in `data.yaml`."""


def data_yaml(splits: Sequence[str], vision: Vision) -> str:
    """Return what YOLO is told of the images and labels beside it."""
    lines = [f"{_SPLITS[split]}: images/{split}" for split in splits]
    lines += [
        "names:",
        *(f"  {number}: {json.dumps(category.name)}" for number, category in enumerate(categories_of(vision))),
    ]
    return "\n".join([*lines, ""])


def boxes_of(labels: pd.DataFrame, vision: Vision, shape: tuple[int, int]) -> pd.DataFrame:
    """Return the boxes of streets in the order of the images, with their `category` from 0."""
    numbers = {category: number for number, category in enumerate(categories_of(vision))}
    parts = []
    for kind in (HEAD, LAMP):
        part = targets_of(labels, kind, shape)
        parts.append(part.assign(category=[numbers[kind, state] for state in part["state"]]))  # type: ignore[index]
    return pd.concat(parts).sort_values("image", kind="stable", ignore_index=True)


def yolo_lines(labels: pd.DataFrame, vision: Vision, shape: tuple[int, int]) -> Iterator[tuple[str, str]]:
    """Yield the name of each image and a line for each of its boxes: class, center and size as shares of the image."""
    high, wide = shape
    boxes = dict(list(boxes_of(labels, vision, shape).groupby("image_id")))
    for name in labels["image_id"]:
        lines = []
        for box in boxes[name].to_dict("records"):
            x, y = (box[at] + box[size] / 2 for at, size in (("left", "width"), ("top", "height")))
            shares = (x / wide, y / high, box["width"] / wide, box["height"] / high)
            lines.append(f"{box['category']} {' '.join(f'{share:.6f}' for share in shares)}\n")
        yield name, "".join(lines)


def write_coco(parts: Sequence[Path], vision: Vision, shape: tuple[int, int], to: Path) -> None:
    """Write images, boxes and categories in COCO's format (Lin et al., ECCV 2014), part by part of a manifest."""
    categories = [{"id": number, "name": category.name} for number, category in enumerate(categories_of(vision), 1)]
    with atomic(to) as hidden, hidden.open("w", encoding="utf-8") as file:
        for key, entries in (("images", _images(parts, shape)), ("annotations", _annotations(parts, vision, shape))):
            file.write(f'{"{" if key == "images" else ", "}"{key}": [')
            for number, entry in enumerate(entries):
                file.write((", " if number else "") + json.dumps(entry))
            file.write("]")
        file.write(f', "categories": {json.dumps(categories)}}}')


def _images(parts: Sequence[Path], shape: tuple[int, int]) -> Iterator[dict[str, Any]]:
    for part in parts:
        labels = pq.read_table(part, columns=["coco_id", "file"]).to_pandas()
        for number, name in zip(labels["coco_id"], labels["file"], strict=True):
            yield {"id": int(number), "file_name": Path(name).name, "width": shape[1], "height": shape[0]}


def _annotations(parts: Sequence[Path], vision: Vision, shape: tuple[int, int]) -> Iterator[dict[str, Any]]:
    number = 0
    for part in parts:
        labels = pq.read_table(part).to_pandas()
        ids = dict(zip(labels["image_id"], labels["coco_id"], strict=True))
        for box in boxes_of(labels, vision, shape).to_dict("records"):
            number += 1
            bbox = [float(box[name]) for name in ("left", "top", "width", "height")]
            known = {
                "id": number,
                "image_id": int(ids[box["image_id"]]),
                "category_id": box["category"] + 1,
                "iscrowd": 0,
            }
            yield known | {"bbox": bbox, "area": bbox[2] * bbox[3]}
