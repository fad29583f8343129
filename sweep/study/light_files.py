"""Lights that a study names by a file alone: which of its columns are of which signal type is told by their colors."""

from __future__ import annotations

from ..base.errors import DataError, StudyError
from ..curves.builtin.registry import BUILT_IN_LIGHTS
from ..curves.files import is_curve_file
from ..curves.light_files import LightsFile, lights_file
from .schema import StudySection
from .schema_curves import LightsSection
from .sources import Sources
from .yaml_tree import Key


def with_light_files(section: StudySection, sources: Sources) -> StudySection:
    """The study with what is in the files in the place of their names. Raises StudyError for files that do not do."""
    before = len(sources.faults)
    changed: dict[str, object] = {"lights": _read(section.lights, ("lights",), section, sources)}
    asked = section.validation
    if asked is not None and asked.lights is not None:
        read = _read(asked.lights, ("validate", "lights"), section, sources)
        changed["validation"] = asked.model_copy(update={"lights": read})
    if len(sources.faults) > before:
        raise StudyError(sources.faults)
    return section.model_copy(update=changed)


def _read(lights: LightsSection, path: tuple[Key, ...], section: StudySection, sources: Sources) -> LightsSection:
    name = lights.builtin
    if name is None or name in BUILT_IN_LIGHTS or not is_curve_file(name):
        return lights
    place = sources.file(path, name)
    if place is None:
        return lights
    try:
        taken = lights_file(place, "energy", section.wavelengths.start_nm, section.wavelengths.stop_nm)
    except DataError as error:
        sources.faults.extend(error.faults)
        return lights
    sources.warnings.append(f"{name}: read as energy; {_said(taken)}")
    stated = lights.model_dump(exclude_unset=True, exclude={"builtin", "files"})
    return LightsSection.model_validate(taken.keys(name) | stated)


def _said(taken: LightsFile) -> str:
    kinds = [f"{kind}: {', '.join(columns)}" for kind, columns in taken.types.items()]
    return "; ".join([*kinds, *(f"{name} is left out ({reason})" for name, reason in taken.left_out.items())])
