"""Field positions, each with its own chief ray angle and field angle.

A field position is given by its image height h, 0 in the center of the sensor and 1 in its corner. The lens has no
distortion: the tangent of the field angle is proportional to h. Each position is a scene of its own; all share one
exposure.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ..base.types import Array, Float, PerValue
from .scene import Scene
from .setup import Setup

_STARTS = 2
"""Image heights from which the smallest value is refined."""
_HALVINGS = 4


def scene_at(scene: Scene, height: float) -> Scene:
    """Return the scene at one image height."""
    assert scene.field is not None
    corner = math.tan(math.radians(scene.off_axis_deg))
    optics = scene.optics.model_copy(update={"cra_deg": scene.field.cra_at(height)})
    off_axis = {"off_axis_deg": math.degrees(math.atan(height * corner))}
    return scene.model_copy(update={"field": None, "optics": optics, **off_axis})


def setup_at(setup: Setup, height: float) -> Setup:
    """Return the setup at one image height."""
    return replace(setup, scene=scene_at(setup.scene, height))


def field_heights(setup: Setup) -> tuple[float, ...]:
    """Return the image heights at which a scene is computed, 0 to 1.

    (0,) if all of them are equal.
    """
    scene = setup.scene
    if scene.field is None or not setup.positions_differ:
        return (0.0,)
    if not scene.field.everywhere:
        return scene.field.counted_heights
    count = setup.accuracy.field_positions
    return tuple(sorted({*(at / (count - 1) for at in range(count)), *scene.field.knots[0]}))


def over_field(setup: Setup) -> tuple[Setup, ...]:
    """Return a setup for each field position that is computed.

    Returns the setup itself if the scene has no field.
    """
    if setup.scene.field is None:
        return (setup,)
    return tuple(setup_at(setup, height) for height in field_heights(setup))


def refined_heights(
    heights: tuple[float, ...],
    values: Float[Array, "values heights"],
    evaluate: Callable[[float], Float[Array, " _values"]],
) -> tuple[PerValue, PerValue]:
    """Refine the smallest values over all image heights.

    The steps around the two smallest known values are halved four times; it is not proven that no lower value lies
    elsewhere.

    `heights`: known image heights, ascending.
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
