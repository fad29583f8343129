"""What a detector of streets is asked for: boxes around heads and around lit lenses."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pandas as pd

from .keys import Vision
from .scenes import states_of

HEAD, LAMP = "head", "lamp"
"""Kinds of targets: the housing, and a lit lens."""


class Category(NamedTuple):
    """Category of an export: a kind of box, and the state it tells."""

    kind: str
    state: str

    @property
    def name(self) -> str:
        """Name in files."""
        return f"{self.state} {self.kind}"


def categories_of(vision: Vision) -> list[Category]:
    """Return the categories of an export: number 1 of COCO and 0 of YOLO is the first one."""
    return [Category(HEAD, state) for state in states_of(vision)] + [Category(LAMP, lens) for lens in vision.lenses]


def targets_of(labels: pd.DataFrame, kind: str, shape: tuple[int, int]) -> pd.DataFrame:
    """Return the targets of a kind in streets, each a row.

    `labels`: of `street_labels`; `shape`: rows and columns of the images, at whose edge boxes are cut. A box is `left`,
    `top`, `width` and `height` from the edge of the first pixel.
    """
    lists = ["state", "distance_m", "intensity_cd", "lens_diameter_px", "head_x_px", "head_y_px", "lit_y_px"]
    lists += ["head_width_px", "head_height_px"]
    rows = labels[["image_id", "image", "level", *lists]].explode(lists, ignore_index=True)
    numbers = [name for name in lists if name != "state"]
    rows[numbers] = rows[numbers].astype(float)
    if kind != HEAD:
        rows = rows[np.isfinite(rows["lit_y_px"])]
    diameter = rows["lens_diameter_px"]
    x, y = rows["head_x_px"], rows["head_y_px"] if kind == HEAD else rows["lit_y_px"]
    sizes = (rows["head_width_px"], rows["head_height_px"]) if kind == HEAD else (diameter, diameter)
    ends = [
        [np.clip(middle + 0.5 + side * size / 2, 0, most) for side in (-1, 1)]
        for middle, size, most in zip((x, y), sizes, shape[::-1], strict=True)
    ]
    (left, right), (top, bottom) = ends
    place = {"left": left, "top": top, "width": right - left, "height": bottom - top}
    kept = rows[["image_id", "image", "level", "state", "distance_m", "intensity_cd"]]
    return pd.concat([kept, pd.DataFrame(place, index=rows.index)], axis=1)
