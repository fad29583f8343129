"""The places of the sensor that scenes ask for: lenses' files are read, and what does not fit is told."""

from __future__ import annotations

from collections.abc import Mapping

from ..camera.effects.image_height import slowest_lens
from ..camera.sensor_field import PLACES, SensorField
from ..curves.lens_files import ChiefRays
from .model import Study
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


def check_fields(study: Study, sources: Sources) -> None:
    """All places of the sensor are looked at where the lens's cone is wide enough for a proof."""
    for name in study.scenarios:
        for space in study.spaces:
            view = study.view(space, name)
            if (allowed := slowest_lens(view)) is not None:
                problem = (
                    "all places of the sensor are too many behind so slow a lens, where filters move with the angle"
                )
                f_number = view.scenario.optics.f_number
                sources.add(("scenarios", name, "optics", "f_number"), problem, f_number, allowed)
                break
