"""Light that falls in at an angle: interference filters move to shorter wavelengths, pigments stay."""

from __future__ import annotations

import math

from ..rays import Stretches
from ..scene import Scene
from ..seen import CHIEF, CONE, METHODS, RAYS, SKIP, SeenFilters, cone_of, moves
from ..shot import Shot
from .base import MULTIPLICATION_S, Change, Chosen, Designs, FilterChange, FilterEffect, Load, Stage

_STEEPEST_RAD = math.radians(85.0)


def too_steep(scene: Scene) -> tuple[tuple[str, ...], str, str, str] | None:
    """Where a scene's rays graze a filter that moves with them: key, problem, value, what is allowed."""
    chief_deg = scene.optics.cra_deg if scene.field is None else scene.field.steepest_deg
    steepest = cone_of(scene).half_rad + math.radians(chief_deg)
    if steepest <= _STEEPEST_RAD:
        return None
    problem = "the steepest ray grazes a filter whose technology is interference"
    allowed = f"at most {math.degrees(_STEEPEST_RAD):g} degrees from f_number and cra_deg together"
    return ("optics",), problem, f"{math.degrees(steepest):.3g} degrees", allowed


class Angle(FilterEffect):
    """Every ray of the lens's cone sees a moved filter, and the pixel their mean; see `seen`."""

    name = "angle"
    methods = METHODS
    stage = Stage.OPTICS
    order = 1

    def exact(self, shot: Shot) -> str | None:
        """Only filters that are said to be of interference move."""
        if moves(shot):
            return None
        stated = any(technology is not None for technology in shot.technologies)
        return "pigments do not move with the angle" if stated else "no technology is stated: filters as on axis"

    def change(self, shot: Shot, before: str, after: str, designs: Designs, *, straight: bool) -> Change:
        """Filters as other rays see them."""
        return FilterChange(SeenFilters(shot, before), SeenFilters(shot, after))

    def work(self, shot: Shot, methods: Chosen, load: Load) -> Load:
        """A product with what each ray sees, at every wavelength, once for all designs."""
        method, indices = methods.angle, [shot.effective_index(c) for c in range(len(shot.mosaic.channels))]
        moved = [index for index in indices if math.isfinite(index)]
        if method == SKIP or not moved:
            return load
        looked = {CHIEF: 1, **RAYS}.get(method)
        if looked is None:
            assert method == CONE
            stretches = Stretches(cone_of(shot.scenario), min(moved))
            looked = math.ceil((stretches.most - stretches.least) * shot.grid.stop_nm / shot.grid.step_nm) + 1
        values = load.cases * load.units * len(shot.lights.photons) * shot.grid.size
        return load._replace(own_s=load.own_s + values * len(moved) * 2 * looked * MULTIPLICATION_S)
