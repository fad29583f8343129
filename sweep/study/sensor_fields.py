"""The places of the sensor that scenes ask for: lenses' files are read, and what does not fit is told."""

from __future__ import annotations

from collections.abc import Mapping

from ..camera.sensor_field import PLACES, SensorField
from ..curves.lens_files import ChiefRays
from .schema import StudySection
from .sources import Sources

_nothing = SensorField(cra_max_deg=0.0)
"""In the place of a file that cannot be read, so that what else is wrong can be told."""


def _of_rows(rays: ChiefRays) -> SensorField:
    return SensorField(heights=tuple(rays.heights.tolist()), cra_deg=tuple(rays.cra_deg.tolist()))


def with_chief_rays(section: StudySection, sources: Sources) -> StudySection:
    """The study with the rows of lenses' files in the place of their names; what does not fit adds a fault."""
    found: dict[str, SensorField] = {}
    read: dict[tuple[str, float | None], SensorField] = {}
    for name, scenario in section.scenarios.items():
        field = scenario.field
        if field is None or field.file is None:
            continue
        asked = (field.file, field.corner_mm)
        if asked not in read:
            rays = sources.chief_rays(("scenarios", name, "field", "profile"), *asked)
            read[asked] = _nothing if rays is None else _of_rows(rays)
        found[name] = read[asked].model_copy(update={"places": field.places or PLACES})
    return section.model_copy(update={"scenarios": _with_fields(section, found)}) if found else section


def _with_fields(section: StudySection, fields: Mapping[str, SensorField]) -> dict[str, object]:
    return {
        name: scenario.model_copy(update={"field": fields[name]}) if name in fields else scenario
        for name, scenario in section.scenarios.items()
    }
