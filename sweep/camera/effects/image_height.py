"""Which places of the sensor are looked at, from its middle to its corner.

Of `any` place, the worst of all real ones is asked for. `within X DN` starts from a few image heights and divides what
is between them until no place there can have a smaller distance by more (see `sensor_places`).
"""

from __future__ import annotations

from ..scene import Scene
from ..seen import moves
from ..shot import Shot
from .base import Chosen, Effect, Load, Stage
from .illumination import Options

HEIGHTS = "field"
"""Name of the effect."""
NAMED = "named places"
_WITHIN_DN = {"within 10 DN": 10.0, "within 1 DN": 1.0, "within 0.1 DN": 0.1, "within 0.01 DN": 0.01}
_PLACES = dict(zip(_WITHIN_DN, (10.0, 12.0, 16.0, 24.0), strict=True))
"""Places that a search looks at, about, for one design and up to three pairs of types."""
_SLOWEST = 100.0


def slowest_lens(shot: Shot) -> str | None:
    """The f-number up to which all places of a field are looked at, where filters move; None where a shot keeps it."""
    field, f_number = shot.scenario.field, shot.scenario.optics.f_number
    asked = field is not None and field.everywhere and moves(shot)
    return f"up to {_SLOWEST:g}, or named places" if asked and f_number > _SLOWEST else None


def all_heights_count(shot: Shot) -> bool:
    """Whether every real place of the sensor counts."""
    return _why_some(shot) is None


def _why_some(shot: Shot) -> str | None:
    """Why some places are enough; None where the scene asks for all, and they differ."""
    scene: Scene = shot.scenario
    if scene.field is None:
        return "one place of the sensor"
    if not scene.field.everywhere:
        return "the scene names the places of the sensor"
    same = not moves(shot) and Options.of(scene).off_axis_deg == 0
    return "all places of the sensor see the same" if same else None


class ImageHeight(Effect):
    """Every place of the sensor is the limit of more and more places."""

    name = HEIGHTS
    methods = (NAMED, *_WITHIN_DN)
    stage = Stage.OPTICS
    order = 3
    off = NAMED
    is_limit = True

    def exact(self, shot: Shot) -> str | None:
        """A scene may name its places, or have one."""
        return _why_some(shot)

    def all_count(self, shot: Shot, methods: Chosen) -> bool:
        """Where the scene asks for any place of the sensor."""
        return methods.field != NAMED and all_heights_count(shot)

    def limit_dn(self, method: str) -> float | None:
        """Named places know no limit."""
        return _WITHIN_DN.get(method)

    def work(self, shot: Shot, methods: Chosen, load: Load) -> Load:
        """All is done at every place."""
        return load._replace(cases=load.cases * _PLACES[methods.field]) if self.all_count(shot, methods) else load
