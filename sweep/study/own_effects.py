"""Effects of a user's own that a study names: read, and tried before any work."""

from __future__ import annotations

from ..base.errors import StudyError, SweepError
from ..base.own_code import Offered, offers
from ..camera.irradiance import scene_irradiance
from ..camera.own_effects import OwnEffect
from .model import Study
from .own_codes import allowed, code_of, is_from_outside
from .schema import StudySection
from .sources import Sources
from .yaml_tree import Key

_GROUP: Offered = "sweep.effects"


def own_effects(section: StudySection, sources: Sources) -> tuple[OwnEffect, ...]:
    """Read the study's own effects. Raises StudyError where one cannot be had."""
    effects = []
    for index, name in enumerate(section.effects):
        path: tuple[Key, ...] = ("effects", index)
        if not is_from_outside(name, _GROUP, ()):
            sources.unknown(path, "effect", name, offers(_GROUP) or ["FILE.py:NAME"])
        elif allowed(sources, path, name):
            try:
                effects.append(OwnEffect(code_of(sources, name, _GROUP)))
            except SweepError as error:
                sources.told(path, error)
    if len(effects) < len(section.effects):
        raise StudyError(sources.faults)
    return tuple(effects)


def try_effects(study: Study, sources: Sources) -> None:
    """Apply the study's own effects in each scenario. Raises StudyError where one fails."""
    if not study.own_effects:
        return
    for name in study.scenarios:
        try:
            scene_irradiance(study.setup(study.spaces[0], name))
        except SweepError as error:
            sources.told(("effects",), error)
            raise StudyError(sources.faults) from None
