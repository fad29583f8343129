"""Checks of what a study asks of its lights beside their spectra: a population, a norm's color regions, candelas."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..base.errors import StudyError
from ..camera.pixel import unquantized
from ..curves.color import VISIBLE_NM
from ..curves.lights import Lights
from ..curves.population import DRIFT_NM_PER_K, Population
from .model import Study
from .schema import StudySection
from .sources import Sources
from .yaml_tree import Key

_MOST_SPECTRA = 20_000
_AT: tuple[Key, ...] = ("population",)
_LEAST_VISIBLE = 1e-6
"""Share of a light's photons that the eye must see where its luminous intensity is given."""


def with_population(lights: Lights, section: StudySection, sources: Sources) -> Lights:
    """The lights with the population that the study asks for; what does not fit adds a fault."""
    population = section.population
    if population is None:
        return lights
    known = [*lights.classes, *lights.names]
    for key, names in population.names.items():
        for name in sorted(names - set(known)):
            sources.unknown((*_AT, key, name), "signal type or signal", name, known)
    for kind, name in zip(lights.types, lights.names, strict=True):
        if population.drift(kind, name) is None:
            problem = f"no drift is known for signals of type {kind}"
            allowed = f"nm/K of {kind}; known are {', '.join(DRIFT_NM_PER_K)}"
            sources.add((*_AT, "drift_nm_per_k"), problem, None, allowed)
            return lights
    for name, scenario in section.scenarios.items():
        if scenario.intensity_cd is not None:
            problem = "lights of a population have their photons, not their luminous intensity, in common"
            sources.add(("scenarios", name, "intensity_cd"), problem, scenario.intensity_cd, "photon_radiance")
        if scenario.target is not None and scenario.target.phase_px == "any":
            problem = "worst cases over a population need a light at a named place of the mosaic"
            sources.add(("scenarios", name, "target", "phase_px"), problem, "any", "[column, row]")
        if scenario.field is not None and scenario.field.everywhere:
            problem = "worst cases over a population need places of the sensor that are counted"
            sources.add(("scenarios", name, "field", "places"), problem, "any", "a number, 2 to 100")
    return _not_too_large(replace(lights, population=population), population, section, sources)


def _not_too_large(lights: Lights, population: Population, section: StudySection, sources: Sources) -> Lights:
    """The lights, with a fault where their members are too many."""
    from ..curves.members import spans_nm  # noqa: PLC0415  (only where lights have a population)

    ends = [end for span in spans_nm(lights, population) for end in span]
    steps = (max(ends) - min(ends)) / section.wavelengths.step_nm
    spectra = len(lights.names) * len(population.width) * (steps + 2)
    if spectra > _MOST_SPECTRA:
        told = f"{spectra:,.0f} spectra, {len(lights.names)} signals at every step of the grid"
        sources.add(_AT, "the population has too many members", told, f"at most {_MOST_SPECTRA:,}")
    return lights


def check_range(study: Study, sources: Sources) -> None:
    """No member of the population is cut off when it is read out. Raises StudyError.

    Worst cases over the population are those of a response that is not cut off.
    """
    if study.lights.population is None:
        return
    from ..curves.members import Members  # noqa: PLC0415  (only where lights have a population)

    lights = Members(study.lights, study.grid).lights
    for name in study.scenarios:
        for space in study.spaces:
            box = study.box(space, name)
            brightest_dn = replace(box, setup=replace(box.setup, lights=lights)).brightest_pixel_dn
            top_dn = float(unquantized(np.array(box.setup.camera.pixel.saturation_e), box.setup.camera.pixel))
            if brightest_dn > top_dn:
                problem = f"lights of the population exceed the full well or the range of the ADC (CFA {space.cfa})"
                sources.add(("scenarios", name), problem, f"{brightest_dn:,.0f} DN", f"up to {top_dn:,.0f} DN")
                raise StudyError(sources.faults)


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
    if sources.faults:
        return
    from ..curves.single_leds import every_led  # noqa: PLC0415  (few studies ask for it)

    leds = every_led(asked)
    for norm in asked.norms:
        for kind in ("yellow", "red"):
            if not leds.allowed(norm, kind).peak_nm.size:
                problem = f"none of the {leds.peak_nm.size:,} LEDs is {kind} as {norm} allows it"
                sources.add(("regions",), problem, None, "other ends or smaller steps of `peak_nm` and `fwhm_nm`")
