"""Field positions, each with its own chief ray angle and field angle.

A field position is given by its image height h, 0 in the center of the sensor and 1 in its corner. The lens has no
distortion: the tangent of the field angle is proportional to h. Each position is a scene of its own; all share one
exposure.
"""

from __future__ import annotations

import math
from dataclasses import replace

from .scene import Scene
from .setup import Setup


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
