"""Field positions: each has a chief ray angle and a field angle of its own.

A field position is said by its image height h, 0 in the middle of the sensor and 1 in its corner. The lens has no
distortion: the tangent of the field angle grows like h. Each is a scene of its own, with the same exposure for all.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ..base.types import FloatArray
from .scene import Scene
from .setup import Setup

_STARTS = 2
"""Image heights from which the smallest value is refined."""
_HALVINGS = 4


def scene_at(scene: Scene, height: float) -> Scene:
    """The scene as seen at an image height, 0 to 1."""
    assert scene.field is not None
    corner = math.tan(math.radians(scene.off_axis_deg))
    optics = scene.optics.model_copy(update={"cra_deg": scene.field.cra_at(height)})
    off_axis = {"off_axis_deg": math.degrees(math.atan(height * corner))}
    return scene.model_copy(update={"field": None, "optics": optics, **off_axis})


def setup_at(setup: Setup, height: float) -> Setup:
    """The setup at an image height, 0 to 1."""
    return replace(setup, scene=scene_at(setup.scene, height))


def field_heights(setup: Setup) -> tuple[float, ...]:
    """Image heights at which a scene is computed; 0 where all of them see the same."""
    scene = setup.scene
    if scene.field is None or not setup.positions_differ:
        return (0.0,)
    if not scene.field.everywhere:
        return scene.field.seen_heights
    count = setup.accuracy.field_positions
    return tuple(sorted({*(at / (count - 1) for at in range(count)), *scene.field.knots[0]}))


def over_field(setup: Setup) -> tuple[Setup, ...]:
    """A setup of each field position that is computed; the setup itself where the scene has no field."""
    if setup.scene.field is None:
        return (setup,)
    return tuple(setup_at(setup, height) for height in field_heights(setup))


def refined_heights(
    heights: tuple[float, ...], values: FloatArray, evaluate: Callable[[float], FloatArray]
) -> tuple[FloatArray, FloatArray]:
    """Smallest values over all image heights and where, ndarray[n_values] each, by refinement of the smallest known.

    `values`: ndarray[n_values, n_heights], known at ascending `heights`; `evaluate`: from a height to
    ndarray[n_values].
    The steps around a start are halved; that no lower value lies elsewhere is not proven.
    """
    known = dict(zip(heights, values.T, strict=True))
    at, lowest = np.zeros(len(values)), values.min(axis=1)
    for value, starts in enumerate(np.argsort(values, axis=1, kind="stable")[:, :_STARTS]):
        for start in starts:
            best = heights[start]
            step = max(np.diff(heights)[max(start - 1, 0) : start + 1]) / 2
            for _ in range(_HALVINGS):
                for height in (best - step, best + step):
                    if 0 <= height <= 1 and height not in known:
                        known[height] = evaluate(height)
                near = [height for height in (best - step, best, best + step) if 0 <= height <= 1]
                best = min(near, key=lambda height: known[height][value])
                step /= 2
            if start == starts[0] or known[best][value] < lowest[value]:
                lowest[value], at[value] = known[best][value], best
    return lowest, at
