"""Maps of a norm's color regions: in which studies they can be made."""

from __future__ import annotations

from .schema import StudySection
from .sources import Sources


def check_regions(section: StudySection, sources: Sources) -> None:
    """LEDs lie on the study's wavelengths and at a named place of the mosaic, and some of each norm are allowed."""
    asked = section.regions
    if asked is None:
        return
    grid, (low, high) = section.wavelengths, asked.peak_nm
    if not grid.start_nm <= low <= high <= grid.stop_nm:
        allowed = f"{grid.start_nm:g} to {grid.stop_nm:g} nm"
        sources.add(("regions", "peak_nm"), "peaks outside the study's wavelengths", [low, high], allowed)
    if grid.step_nm > asked.fwhm_nm[0]:
        problem = "an LED is narrower than a step of the study's wavelengths"
        sources.add(("regions", "fwhm_nm"), problem, list(asked.fwhm_nm), f"{grid.step_nm:g} nm or more")
    for name, scenario in section.scenarios.items():
        if scenario.target is not None and scenario.target.phase_px == "any":
            problem = "`regions` needs a light at a named place of the mosaic"
            sources.add(("scenarios", name, "target", "phase_px"), problem, "any", "[column, row]")
    if not sources.faults:
        _some_allowed(section, sources)


def _some_allowed(section: StudySection, sources: Sources) -> None:
    from ..curves.single_leds import every_led  # noqa: PLC0415  (few studies ask for it)

    asked = section.regions
    assert asked is not None
    leds = every_led(asked)
    for norm in asked.norms:
        for kind in ("yellow", "red"):
            if not leds.allowed(norm, kind).peak_nm.size:
                problem = f"none of the {leds.peak_nm.size:,} LEDs is {kind} as {norm} allows it"
                sources.add(("regions",), problem, None, "other ends or smaller steps of `peak_nm` and `fwhm_nm`")
