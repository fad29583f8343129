"""What asks for flicker: a pulsed lamp before an HDR pixel."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...camera.setup import Feature

if TYPE_CHECKING:
    from ...study import StudySection
    from ...study.sources import Sources


def made(section: StudySection, sources: Sources) -> Feature | None:  # noqa: ARG001  (no curve of its own)
    """Return the feature where a lamp is pulsed and the pixel has captures."""
    pulsed = any(scene.drive is not None for scene in section.scenarios.values())
    return Feature() if pulsed and section.pixel.captures else None
