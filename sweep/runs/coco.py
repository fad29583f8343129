"""Boxes around signal heads in COCO's format of object detection (Lin et al., ECCV 2014)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import pandas as pd

from ..vision.head import housing_diameters
from ..vision.scenes import states_of
from ..vision.section import Vision
from ..vision.street import street_shape


def coco(labels: pd.DataFrame, vision: Vision, tile: tuple[int, ...]) -> dict[str, Any]:
    """Return images, boxes around housings, cut at the image, and categories, which are states."""
    states = states_of(vision)
    is_street = "head_x_px" in labels
    rows, columns = street_shape(vision, tile) if is_street else (vision.crop_px, vision.crop_px)
    images: list[dict[str, Any]] = []
    boxes: list[dict[str, Any]] = []
    for number, row in enumerate(labels.to_dict("records"), 1):
        images.append({"id": number, "file_name": row["file"], "width": columns, "height": rows})
        for x, y, width, height, state in _heads(row, vision):
            # Positions are from the center of the first pixel, boxes from its edge.
            left, right = (float(np.clip(x + 0.5 + side * width / 2, 0, columns)) for side in (-1, 1))
            top, bottom = (float(np.clip(y + 0.5 + side * height / 2, 0, rows)) for side in (-1, 1))
            box = {"bbox": [left, top, right - left, bottom - top], "area": (right - left) * (bottom - top)}
            key = {"id": len(boxes) + 1, "image_id": number, "category_id": states.index(state) + 1, "iscrowd": 0}
            boxes.append(key | box)
    categories = [{"id": at, "name": state} for at, state in enumerate(states, 1)]
    return {"images": images, "annotations": boxes, "categories": categories}


def _heads(row: Mapping[Any, Any], vision: Vision) -> Iterator[tuple[float, float, float, float, str]]:
    """Yield center, width and height in pixels, and state of each head."""
    if "head_x_px" in row:
        names = ("head_x_px", "head_y_px", "head_width_px", "head_height_px", "state")
        yield from zip(*(row[name] for name in names), strict=True)
    else:
        width, height = (size * row["lens_diameter_px"] for size in housing_diameters(vision))
        yield float(np.mean(row["lens_x_px"])), float(np.mean(row["lens_y_px"])), width, height, row["state"]
