"""By what filters work, as a study states it: checked against the curves that they are made of, and the lenses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..camera.angular import too_steep
from ..camera.sensor import SensorCurves
from ..designs.space import Space
from .schema import StudySection
from .sources import Sources
from .yaml_tree import Key

_ROUNDING = 1e-9


def _moves(sensor: SensorCurves, curve: str) -> bool:
    """Whether a curve of the sensor moves with the angle of the light."""
    technology = sensor.technologies.get(curve)
    return technology is not None and technology.interference is not None


def with_technologies(sensor: SensorCurves, section: StudySection, sources: Sources) -> SensorCurves:
    """The sensor with what is stated of its curves; what does not fit adds a fault."""
    clear = sensor.curve(sensor.clear)
    kind = "clear" if sensor.has_clear else "brightest"
    stated = replace(sensor, technologies=section.sensor.technology)
    for curve in section.sensor.technology:
        path: tuple[Key, ...] = ("sensor", "technology", curve)
        if curve not in sensor.qe:
            sources.unknown(path, "curve", curve, list(sensor.qe))
        elif _moves(stated, curve) and (sensor.qe[curve] > clear * (1 + _ROUNDING)).any():
            problem = f"an interference filter lets through a share of the {kind} curve, {sensor.clear}"
            sources.add(path, problem, f"{curve} is above it", "pigment")
    return stated


def check_filter(space: Space, path: tuple[Key, ...], sensor: SensorCurves, sources: Sources) -> None:
    """What is put on a base can be taken apart from it: the base is no interference filter, nor exceeded by one."""
    made = space.filter
    assert made is not None
    for base in dict.fromkeys(made.bases.values()):
        if _moves(sensor, base):
            problem = f"the base curve {base} is an interference filter itself"
            sources.add((*path, "base"), problem, base, "a base of pigment")
    if made.technology is None or made.technology.interference is None:
        return
    low, high = (np.array([end(axis) for axis in space.axes], dtype=float) for end in (min, max))
    bases = np.stack([sensor.curve(base) for base in made.bases.values()])
    if (made.family.upper(low, high) > bases * (1 + _ROUNDING)).any():
        problem = "an interference filter lets through a share of its base"
        exceeded = f"filters that exceed {' and '.join(dict.fromkeys(made.bases.values()))}"
        sources.add((*path, "technology"), problem, exceeded, "a filter below it, or pigment")


def check_lenses(section: StudySection, sensor: SensorCurves, spaces: Sequence[Space], sources: Sources) -> None:
    """Where filters move, no ray of any scene grazes them."""
    filters = [space.filter.technology for space in spaces if space.filter is not None]
    if all(t is None or t.interference is None for t in (*filters, *sensor.technologies.values())):
        return
    for name, scenario in section.scenarios.items():
        if (refused := too_steep(scenario)) is not None:
            key, problem, value, allowed = refused
            sources.add(("scenarios", name, *key), problem, value, allowed)
