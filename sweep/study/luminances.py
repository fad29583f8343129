"""Where a study gives candelas, there is light that the eye sees."""

from __future__ import annotations

from ..curves.color import VISIBLE_NM
from ..curves.lights import Lights
from .schema import StudySection
from .sources import Sources

_LEAST_VISIBLE = 1e-6
"""Share of a light's photons that the eye must see where its luminous intensity is given."""


def check_luminances(section: StudySection, lights: Lights, sources: Sources) -> None:
    """Candelas are given of lights, and of a background, that the eye sees; else adds a fault."""
    nodes = section.wavelengths.nodes_nm
    visible = (nodes >= VISIBLE_NM[0]) & (nodes <= VISIBLE_NM[1])
    share = section.wavelengths.integrate(lights.photons * visible)
    dark = [name for name, part in zip(lights.names, share, strict=True) if not part >= _LEAST_VISIBLE]
    allowed = f"photons between {VISIBLE_NM[0]:g} and {VISIBLE_NM[1]:g} nm"
    for name, scenario in section.scenarios.items():
        if scenario.intensity_cd is not None and dark:
            problem = f"a light that the eye does not see has no luminous intensity: {dark[0]}"
            sources.add(("scenarios", name, "intensity_cd"), problem, scenario.intensity_cd, allowed)
        if scenario.background_cd_m2 and not visible.any():
            problem = "a background on wavelengths that the eye does not see has no luminance"
            sources.add(("scenarios", name, "background_cd_m2"), problem, scenario.background_cd_m2, allowed)
