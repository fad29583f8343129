"""The places of the sensor that a scene asks for: each has a chief ray angle and a field angle of its own.

A place is said by its image height h, 0 in the middle of the sensor and 1 in its corner. The lens has no distortion:
the tangent of the field angle grows like h. Each place is a scene of its own, with the same exposure for all of them.
"""

from __future__ import annotations

import math
from dataclasses import replace

from .effects.illumination import Options
from .scene import Scene
from .seen import SKIP, moves
from .view import View


def scene_at(scene: Scene, height: float) -> Scene:
    """What a scene's field sees at an image height, 0 to 1."""
    assert scene.field is not None
    corner = math.tan(math.radians(Options.of(scene).off_axis_deg))
    optics = scene.optics.model_copy(update={"cra_deg": scene.field.cra_at(height)})
    off_axis = {"off_axis_deg": math.degrees(math.atan(height * corner))}
    return scene.model_copy(update={"field": None, "optics": optics, **off_axis})


def over_field(view: View) -> tuple[View, ...]:
    """A view of each place of the field that is looked at; one where no field is asked for, or all see the same."""
    scene = view.scenario
    if scene.field is None:
        return (view,)
    still = view.methods.angle == SKIP or not moves(view)
    bright = view.methods.illumination == "skip" or Options.of(scene).off_axis_deg == 0
    heights = (0.0,) if still and bright else scene.field.seen_heights
    return tuple(replace(view, scenario=scene_at(scene, height)) for height in heights)
