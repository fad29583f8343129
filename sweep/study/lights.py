"""The lights of a study: from files or built in, with their population; and checks of the scenes' needs."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from ..base.disk import is_folder
from ..base.errors import DataError, Fault, ValidationIssue, unknown
from ..base.types import FloatArray
from ..camera.pixel import unquantized
from ..spectra.builtin.registry import BUILT_IN_LIGHTS, ENDS
from ..spectra.color import VISIBLE_NM
from ..spectra.formats import is_curve_file
from ..spectra.light_files import lights_file
from ..spectra.lights import Lights, make_lights
from ..spectra.population import DRIFT_NM_PER_K
from ..spectra.spectrum import WavelengthGrid
from .model import Study
from .schema import MOST_TYPES, StudySection
from .schema_curves import LightsSection
from .sources import Sources
from .tree import KeyPath
from .user_code import offered_curves

_MOST_SPECTRA = 20_000
_LEAST_VISIBLE = 1e-6
"""Share of a light's photons that the eye must see where its luminous intensity is given."""


def with_light_files(section: StudySection, sources: Sources) -> StudySection:
    """Read the files of lights; the colors of their columns define signal types.

    Returns the study with spectra instead of file names. Raises StudyError if a file cannot be used.
    """

    def read(lights: LightsSection, path: KeyPath) -> LightsSection:
        name = lights.builtin
        named = name is not None and name.strip("./ ") != ""
        folder = named and any(is_folder(where / str(name)) for where in sources.folders)
        if name is None or name in BUILT_IN_LIGHTS or not (folder or is_curve_file(name)):
            return lights
        place = sources.file(path, name)
        if place is None:
            return lights
        try:
            taken = lights_file(place, None, section.wavelengths.start_nm, section.wavelengths.stop_nm)
        except DataError as error:
            sources.issues.extend(error.issues)
            return lights
        kinds = [f"{kind}: {', '.join(columns)}" for kind, columns in taken.types.items()]
        left_out = [f"{column} is left out ({reason})" for column, reason in taken.left_out.items()]
        sources.warnings.append(f"{name}: {'; '.join([*taken.notes[-1:], *kinds, *left_out])}")
        stated = lights.model_dump(exclude_unset=True, exclude={"builtin", "files"})
        return LightsSection.model_validate(taken.keys(lambda _: name) | stated)

    before = len(sources.issues)
    lights = read(section.lights, ("lights",))
    if len(sources.issues) > before:
        raise sources.error
    return section.model_copy(update={"lights": lights})


def _padded(
    make: Callable[[WavelengthGrid], Lights], ends: Callable[[], tuple[float, float]], grid: WavelengthGrid
) -> Lights:
    """Return built-in lights on a grid that goes beyond their wavelengths, and 0 there."""
    nodes, (low, high) = grid.nodes_nm, ends()
    inside = np.flatnonzero((nodes >= low) & (nodes <= high))
    if inside.size < 2:
        raise DataError(ValidationIssue("no wavelengths of built-in lights", value=f"{low:g} to {high:g} nm"))
    first, last = int(inside[0]), int(inside[-1])
    inside_lights = make(grid.model_copy(update={"start_nm": float(nodes[first]), "stop_nm": float(nodes[last])}))
    return replace(inside_lights, photons=np.pad(inside_lights.photons, ((0, 0), (first, grid.size - 1 - last))))


def _built_in(section: LightsSection, sources: Sources, at: KeyPath) -> Lights | None:
    """Return a built-in data set; None after adding issues."""
    assert section.builtin is not None
    excess = sorted(section.model_fields_set - {"builtin", "files", "outside"})
    for key in excess:
        sources.refuse(
            Fault((*at, key), "a built-in data set has its own", getattr(section, key), "this key beside `files`")
        )
    known, anywhere = BUILT_IN_LIGHTS, section.outside == "zero"
    if anywhere:
        known = known | {name: partial(_padded, known[name], ends) for name, ends in ENDS.items()}
    return None if excess else sources.built_in(at, section.builtin, known, anywhere=anywhere)


def lights_of(section: LightsSection, sources: Sources, at: KeyPath = ("lights",)) -> Lights | None:
    """Construct the lights of a section.

    Raises StudyError: with every issue so far, if the study cannot be used.
    """
    section = offered_curves(sources, at, section, "sweep.lights", BUILT_IN_LIGHTS)
    if section.builtin is not None:
        return _built_in(section, sources, at)
    before = len(sources.issues)
    files = (*at, "files")
    count = sum(len(columns) for entry in section.files for columns in entry.signals.values())
    if not sources.fits(files, "lights", count):
        return None
    by_type: dict[str, list[tuple[str, str, FloatArray]]] = {}
    for index, stated in enumerate(section.files):
        entry = (
            stated if "outside" in stated.model_fields_set else stated.model_copy(update={"outside": section.outside})
        )
        columns = [column for names in entry.signals.values() for column in names]
        curves = sources.used((*files, index), entry, "light", columns, entry.quantity, scaled=True)
        for signal_type, columns in entry.signals.items():
            for position, column in enumerate(columns):
                found_path = (*files, index, "signals", signal_type, position)
                label = f"{Path(entry.file).stem}:{column}"
                photons = sources.photons(found_path, curves, column, entry)
                if photons is not None:
                    by_type.setdefault(signal_type, []).append((label, signal_type, photons))
    if len(sources.issues) > before:
        return None
    if len(by_type) < 2:
        sources.refuse(Fault(files, "only one signal type", list(by_type), "two or more"))
        return None
    if len(by_type) > MOST_TYPES:
        sources.refuse(Fault(files, "too many signal types", len(by_type), f"at most {MOST_TYPES}"))
        return None
    signals = [signal for group in by_type.values() for signal in group]
    source = ", ".join(entry.file for entry in section.files)
    return make_lights(sources.grid, section.name or "lights", signals, source, photon_ratio=section.photon_ratio)


def with_population(lights: Lights, section: StudySection, sources: Sources) -> Lights:
    """Add the lamp population that the study defines."""
    population, at = section.population, ("population",)
    if population is None:
        return lights
    from ..spectra.members import spans_nm  # noqa: PLC0415  (only where lights have a population)

    known = [*lights.classes, *lights.names]
    for key, names in population.names.items():
        for name in sorted(names - set(known)):
            sources.refuse(unknown((*at, key, name), "signal type or signal", name, known))
    for kind, name in zip(lights.types, lights.names, strict=True):
        if population.drift(kind, name) is None:
            allowed = f"nm/K of {kind}; known are {', '.join(DRIFT_NM_PER_K)}"
            sources.refuse(
                Fault((*at, "drift_nm_per_k"), f"no drift is known for signals of type {kind}", None, allowed)
            )
            return lights
    for name, scene in section.scenarios.items():
        if scene.intensity_cd is not None:
            problem = "lights of a population have their photons, not their luminous intensity, in common"
            sources.refuse(Fault(("scenarios", name, "intensity_cd"), problem, scene.intensity_cd, "photon_radiance"))
        if scene.target is not None and scene.target.phase_px == "any":
            problem = "worst cases over a population need a named sampling phase"
            sources.refuse(Fault(("scenarios", name, "target", "phase_px"), problem, "any", "[column, row]"))
        if scene.field is not None and scene.field.everywhere:
            problem = "worst cases over a population need a number of field positions"
            sources.refuse(Fault(("scenarios", name, "field", "places"), problem, "any", "a number, 2 to 100"))
    ends = [end for span in spans_nm(lights, population) for end in span]
    steps = (max(ends) - min(ends)) / section.wavelengths.step_nm
    spectra = len(lights.names) * len(population.width) * (steps + 2)
    if spectra > _MOST_SPECTRA:
        value = f"{spectra:,.0f} spectra, {len(lights.names)} signals at every step of the grid"
        sources.refuse(Fault(at, "the population has too many members", value, f"at most {_MOST_SPECTRA:,}"))
    return replace(lights, population=population)


def check_range(study: Study) -> Iterator[Fault]:
    """Check that no lamp of the population saturates at readout.

    Worst cases over a population are computed for a response without saturation.
    """
    if study.lights.population is None:
        return
    from ..spectra.members import Members  # noqa: PLC0415  (only where lights have a population)

    lights = Members(study.lights, study.grid).lights
    for name in study.scenarios:
        for space in study.spaces:
            box = study.box(space, name)
            brightest_dn = replace(box, setup=replace(box.setup, lights=lights)).brightest_pixel_dn
            top_dn = float(unquantized(np.array(box.setup.camera.pixel.saturation_e), box.setup.camera.pixel))
            if brightest_dn > top_dn:
                problem = f"lights of the population exceed the full well or the range of the ADC (CFA {space.cfa})"
                yield Fault(("scenarios", name), problem, f"{brightest_dn:,.0f} DN", f"up to {top_dn:,.0f} DN")
                return


def check_luminances(section: StudySection, lights: Lights) -> Iterator[Fault]:
    """Check that luminances are given only for visible lights and backgrounds."""
    nodes = section.wavelengths.nodes_nm
    visible = (nodes >= VISIBLE_NM[0]) & (nodes <= VISIBLE_NM[1])
    share = section.wavelengths.integrate(lights.photons * visible)
    dark = [name for name, part in zip(lights.names, share, strict=True) if not part >= _LEAST_VISIBLE]
    allowed = f"photons between {VISIBLE_NM[0]:g} and {VISIBLE_NM[1]:g} nm"
    for name, scene in section.scenarios.items():
        if scene.intensity_cd is not None and dark:
            problem = f"a light that the eye does not see has no luminous intensity: {dark[0]}"
            yield Fault(("scenarios", name, "intensity_cd"), problem, scene.intensity_cd, allowed)
        if scene.background_cd_m2 and not visible.any():
            problem = "a background on wavelengths that the eye does not see has no luminance"
            yield Fault(("scenarios", name, "background_cd_m2"), problem, scene.background_cd_m2, allowed)
