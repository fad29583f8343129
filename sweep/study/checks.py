"""Checks of a study across its sections: vision, recognition, LEDs of a norm, published figures, memory."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

from ..base.errors import Fault, unknown
from ..camera import psf
from ..camera.memory import memory_fault
from ..camera.mosaic import Mosaic
from ..camera.scene import OBJECT_RESOLUTION
from ..metrics.quantity import Quantity, RequestedQuantities
from ..metrics.registry import listed, quantities_of
from ..spectra.lights import Lights
from ..spectra.single_leds import RegionMap
from .model import Study
from .schema import StudySection

_MOST_DESIGNS = 10**9


def check_scenes(section: StudySection) -> Iterator[Fault]:
    """Check LED norms and that every target forms an image that can be computed."""
    yield from _check_regions(section)
    for name, scene in section.scenarios.items():
        if scene.pixel is not None:
            for key in ("captures", "companding"):
                if getattr(scene.pixel, key) != getattr(section.pixel, key):
                    problem = "one scenario has no others than the study: a pixel of its own is one of `pixels`"
                    yield Fault(("scenarios", name, "pixel", key), problem, None, "`pixels: {NAME: {captures: ...}}`")
        if (fault := psf.image_fault(scene, scene.pixel_of(section.pixel))) is not None:
            yield fault.under("scenarios", name)


def _check_captures(section: StudySection, mosaics: Mapping[str, Mosaic]) -> Iterator[Fault]:
    """Check that all parts of a study read an HDR pixel, and that its photodiodes have channels of the study."""
    channels = dict.fromkeys(channel for mosaic in mosaics.values() for channel in mosaic.channels)
    for number, capture in enumerate(section.pixel.captures):
        for channel in capture.qe_factor.keys() - channels.keys():
            yield unknown(("pixel", "captures", number, "qe_factor"), "channel", channel, channels)
    if section.tasks is not None and section.pixel.captures:
        yield Fault(("tasks",), "of a pixel that is read once; `pixel.captures` are merged", None, "no captures")


def check_lights(
    section: StudySection, lights: Lights, mosaics: Mapping[str, Mosaic], requested: RequestedQuantities
) -> Iterator[Fault]:
    """Check keys that name signal types or columns, or that need lamps."""
    yield from _check_columns(requested)
    yield from _check_recognition(section, lights)
    if section.validation is not None and section.validation.leave_one_out and section.search is None:
        yield Fault(("validate", "leave_one_out"), "nothing is searched", None, "a study with `search`")
    if section.vision is not None:
        from ..vision.faults import vision_faults  # noqa: PLC0415  (few studies have images)

        of_images = section.pixel, section.scenarios, lights, mosaics, section.wavelengths
        yield from vision_faults(section.vision, *of_images)
    yield from _check_published(section, lights, mosaics)
    for cfa, channels in section.clouds.items():
        if cfa not in mosaics:
            yield unknown(("clouds", cfa), "CFA", cfa, mosaics)
        for at, channel in enumerate(channels if cfa in mosaics else ()):
            if channel not in mosaics[cfa].channels:
                yield unknown(("clouds", cfa, at), f"channel of {cfa}", channel, mosaics[cfa].channels)
    yield from _check_captures(section, mosaics)


def _check_columns(requested: RequestedQuantities) -> Iterator[Fault]:
    """Check that every pair of signal types has columns of its own."""
    by_name: dict[str, Quantity] = {}
    for quantity in listed(replace(requested, edge_shift=False)):
        other = by_name.setdefault(quantity.name, quantity)
        if other.pair != quantity.pair and other.pair is not None and quantity.pair is not None:
            pairs = f"{'/'.join(other.pair)} and {'/'.join(quantity.pair)}"
            problem = f"the pairs {pairs} share the column {quantity.name}"
            yield Fault(("lights",), problem, None, "other names of signal types")


def _check_recognition(section: StudySection, lights: Lights) -> Iterator[Fault]:
    """Check that its states are signal types, each once, and that every scene has noise."""
    recognition = section.recognition
    if recognition is None:
        return
    states = recognition.states or []
    for name in states:
        if name not in lights.classes:
            yield unknown(("recognition", "states"), "signal type", name, lights.classes)
    if len(set(states)) < len(states):
        yield Fault(("recognition", "states"), "a signal type is named twice", states)
    if len(lights.classes) < 2:
        yield Fault(("recognition",), "there is one signal type only", lights.classes[0], "two or more")
    for name, scene in section.scenarios.items():
        if scene.noise is None:
            problem = "`recognition` needs noise in every scenario"
            yield Fault(("scenarios", name, "noise"), problem, None, "noise: true")


def _check_published(section: StudySection, lights: Lights, mosaics: Mapping[str, Mosaic]) -> Iterator[Fault]:
    """Check the names of published figures."""
    nominal = quantities_of(RequestedQuantities(lights.classes)).values()
    columns = [q.name for q in nominal if q.ends and q.needs != "family"]
    known = dict.fromkeys([*mosaics, *section.designs, *section.geometry])
    for table, rows in section.published.items():
        for row, values in rows.items():
            path = ("published", table, row)
            if row not in known:
                yield unknown(path, "CFA, design or geometry", row, known)
                continue
            names = [OBJECT_RESOLUTION] if row in section.geometry else columns
            for quantity in values:
                if quantity not in names:
                    yield unknown((*path, quantity), "quantity", quantity, names)


def _check_regions(section: StudySection) -> Iterator[Fault]:
    """Check that LEDs lie on the study's wavelengths and at a named phase, and that each norm allows some."""
    regions = section.regions
    if regions is None:
        return
    misplaced = [*_misplaced_regions(section, regions)]
    yield from misplaced
    if misplaced:
        return
    from ..spectra.single_leds import all_leds  # noqa: PLC0415  (few studies ask for it)

    leds = all_leds(regions)
    for norm in regions.norms:
        for kind in ("yellow", "red"):
            if not leds.allowed(norm, kind).peak_nm.size:
                problem = f"none of the {leds.peak_nm.size:,} LEDs is {kind} as {norm} allows it"
                yield Fault(("regions",), problem, None, "other ends or smaller steps of `peak_nm` and `fwhm_nm`")


def _misplaced_regions(section: StudySection, regions: RegionMap) -> Iterator[Fault]:
    grid, (low, high) = section.wavelengths, regions.peak_nm
    if not grid.start_nm <= low <= high <= grid.stop_nm:
        allowed = f"{grid.start_nm:g} to {grid.stop_nm:g} nm"
        yield Fault(("regions", "peak_nm"), "peaks outside the study's wavelengths", [low, high], allowed)
    if grid.step_nm > regions.fwhm_nm[0]:
        problem = "an LED is narrower than a step of the study's wavelengths"
        yield Fault(("regions", "fwhm_nm"), problem, list(regions.fwhm_nm), f"{grid.step_nm:g} nm or more")
    for name, scene in section.scenarios.items():
        if scene.target is not None and scene.target.phase_px == "any":
            problem = "`regions` needs a named sampling phase"
            yield Fault(("scenarios", name, "target", "phase_px"), problem, "any", "[column, row]")


def check_size(study: Study) -> Iterator[Fault]:
    """Check that the kernels of every scene and CFA fit into memory."""
    for name in study.scenarios:
        for space in study.spaces:
            if (fault := memory_fault(study.setup(space, name))) is not None:
                problem = f"{fault.problem} (CFA {space.cfa})"
                yield Fault(("scenarios", name, "target"), problem, fault.value, fault.allowed)
                return


def check_count(study: Study) -> Iterator[Fault]:
    """Check that the study has designs, and not too many."""
    if not study.n_designs and study.search is None:
        yield Fault(("cfas",), "no designs", None, "a CFA with a curve for each channel, a design, a sweep or a search")
    if study.n_designs > _MOST_DESIGNS:
        yield Fault(("sweeps",), "too many designs", f"{study.n_designs:,}", f"at most {_MOST_DESIGNS:,}")
