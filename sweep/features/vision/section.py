"""Key `vision` of a study."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from ...base.errors import Fault
from ...base.types import Section
from ...camera.setup import Feature
from .keys import SeededVision, Vision

if TYPE_CHECKING:
    from ...study import StudySection
    from ...study.checks import Checked
    from ...study.sources import Sources


class Keys(Section):
    """Keys of a study."""

    vision: Vision | None = None
    """Images of signal heads, read by the ideal observer and by a reader that learns; lamps need luminous intensity."""


KEYS = {"StudySection": Keys}


def made(section: StudySection, sources: Sources) -> Feature | None:  # noqa: ARG001  (no curve of its own)
    """Return the benchmark that a study asks for."""
    vision = section.key("vision")
    return None if vision is None else SeededVision(vision, section.seed)


def faults(checked: Checked) -> Iterator[Fault]:
    """Check the benchmark against pixel, lights, tiles and memory."""
    section, vision = checked.section, checked.section.key("vision")
    if vision is not None:
        from .faults import vision_faults  # noqa: PLC0415  (few studies have images)

        of_images = section.pixel, section.scenarios, checked.lights, checked.mosaics, section.wavelengths
        yield from vision_faults(vision, *of_images)
