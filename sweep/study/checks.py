"""Checks of a study across its sections: vision, recognition, LEDs of a norm, published figures, memory."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace

from ..base.errors import Fault, unknown
from ..camera import psf
from ..camera.memory import MOST_BYTES, memory_fault
from ..camera.mosaic import Mosaic
from ..camera.noise.merge import light_of
from ..camera.noise.merged_readings import NOISE_BINS, countable, n_roots
from ..camera.pixel import Pixel
from ..camera.scene import OBJECT_RESOLUTION, FixedExposure, Scene
from ..metrics.quantity import Quantity, RequestedQuantities
from ..metrics.registry import listed, quantities_of
from ..spectra.color import luminance_per_photon_radiance
from ..spectra.lights import Lights
from ..spectra.single_leds import RegionMap
from ..vision.section import (
    FEWEST_LAMPS,
    MOST_BITS,
    MOST_READ_NOISE_DN,
    MOST_READINGS,
    MOST_ROOTS,
    MOST_WELL_E,
    Vision,
)
from .model import Study
from .schema import StudySection

_HELD_TIMES = 8
"""Times that a network's training images are held in single precision: mirrored, in blocks, joined, scaled."""
_LEAST_LUMINANCE = 1e-20
"""cd/m^2 for each photon/s/sr/m^2 of a lamp that the eye sees; at 555 nm it is 2.4e-16."""
_MOST_DESIGNS = 10**9


def check_scenes(section: StudySection) -> Iterator[Fault]:
    """Check LED norms and that every target forms an image that can be computed."""
    yield from _check_regions(section)
    for name, scene in section.scenarios.items():
        if (fault := psf.image_fault(scene, section.pixel)) is not None:
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
    yield from _check_vision(section, lights, mosaics)
    yield from _check_published(section, lights, mosaics)
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


def _check_vision(section: StudySection, lights: Lights, mosaics: Mapping[str, Mosaic]) -> Iterator[Fault]:
    """Check that lenses are signal types with lamps enough, tiles divide the images, and tables and images fit."""
    vision = section.vision
    if vision is None:
        return
    for lens in vision.lenses:
        if lens not in lights.classes:
            yield unknown(("vision", "lenses"), "signal type", lens, lights.classes)
            continue
        different = len({lights.photons[i].tobytes() for i in lights.members[lens]})
        if different < FEWEST_LAMPS:
            allowed = f"at least {FEWEST_LAMPS} different lamps: one to train, one to check, one to test"
            yield Fault(("vision", "lenses"), f"too few lamps of type {lens}", different, allowed)
        luminance = luminance_per_photon_radiance(section.wavelengths, lights.photons[lights.members[lens]])
        if not luminance.min() > _LEAST_LUMINANCE:
            problem = f"a lamp of type {lens} is not visible, and has no luminous intensity"
            yield Fault(("vision", "lenses"), problem, lens, "lamps that the eye sees")
    for name, mosaic in mosaics.items():
        if any(vision.crop_px % size for size in mosaic.indices.shape):
            rows, columns = mosaic.indices.shape
            problem = f"the tile of {name} ({rows} x {columns}) does not divide the images"
            yield Fault(("vision", "crop_px"), problem, vision.crop_px, "a multiple of every tile")
    for distance_m in vision.distances_m:
        scene = Scene(target=vision.target(distance_m), optics=vision.optics, exposure=FixedExposure(exposure_s=1.0))
        if (fault := psf.image_fault(scene, section.pixel)) is not None:
            problem = f"{fault.problem} at {distance_m:g} m"
            yield Fault(("vision", "distances_m"), problem, fault.value, fault.allowed)
    yield from _check_pixel(section)
    yield from _check_memory(vision, lights, mosaics)


def _check_pixel(section: StudySection) -> Iterator[Fault]:
    """Check that the table of a pixel's digital numbers can be held, and that there is one pixel."""
    pixel = section.pixel
    for number, read in enumerate(pixel.read_as or (pixel,)):
        path = ("pixel", "captures", number) if pixel.captures else ("pixel",)
        read_dn = read.read_noise_e * read.dn_per_e
        for key, value, most in (("bits", read.bits, MOST_BITS), ("well_e", read.well_e, MOST_WELL_E)):
            if value > most and not (key == "bits" and pixel.captures):
                yield Fault((*path, key), "too large for `vision`", value, f"at most {most:g}")
        if read_dn > MOST_READ_NOISE_DN:
            problem = f"too large for `vision`: {read_dn:.4g} DN"
            yield Fault((*path, "read_noise_e"), problem, read.read_noise_e, f"at most {MOST_READ_NOISE_DN:g} DN")
    if pixel.captures:
        yield from _check_merged(pixel)
    for name, scene in section.scenarios.items():
        if scene.noise is not None and scene.noise.of(pixel) != pixel:
            allowed = "noise: true, and the figures in `pixel`"
            yield Fault(("scenarios", name, "noise"), "`vision` has one pixel for all scenarios", None, allowed)


def _check_merged(pixel: Pixel) -> Iterator[Fault]:
    """Check that the images of an HDR pixel follow from one number of electrons, and have few enough readings."""
    stated = [
        (number, key)
        for number, capture in enumerate(pixel.captures)
        for key, is_stated in (("qe_factor", capture.qe_factor), ("crosstalk", capture.crosstalk is not None))
        if is_stated
    ]
    for number, key in stated:
        path = ("pixel", "captures", number, key)
        yield Fault(path, "`vision` has captures of one QE and one crosstalk", None, "those of the pixel")
    if stated:
        return
    if not countable(pixel):
        problem = "`vision` counts electrons of the first usable capture"
        yield Fault(("pixel", "merge"), problem, pixel.merge, "saturated, with smaller wells, PRNU or read noise")
    readings = pixel.knees[1, -1] or NOISE_BINS * sum(2 * math.sqrt(readout.well_e) for readout in pixel.read_as)
    if readings > MOST_READINGS or n_roots(pixel, light_of(pixel)) > MOST_ROOTS:
        light = min(capture.light for capture in pixel.captures)
        problem = f"too many readings for `vision`: {readings:,.0f}, and light from 1 to {light:.3g}"
        allowed = f"at most {MOST_READINGS:,} readings, and captures nearer in light"
        yield Fault(("pixel", "captures"), problem, None, allowed)


def _check_memory(vision: Vision, lights: Lights, mosaics: Mapping[str, Mosaic]) -> Iterator[Fault]:
    """Check that lamps at all phases, the observer's cases at one distance and level, and training images fit."""
    pixels = vision.crop_px**2
    n_lenses = len(vision.lenses)
    test_lamps = sum(max(1, len(lights.members.get(lens, ())) // 4) for lens in vision.lenses)
    for name, mosaic in mosaics.items():
        places = mosaic.indices.size * vision.places_per_pixel**2
        lamps = 8 * places * n_lenses * len(lights.names) * pixels * len(vision.distances_m)
        cases = 8 * places * 2 * math.factorial(n_lenses) * (1 + test_lamps * len(vision.intensities_cd)) * pixels
        if (every := max(lamps, cases)) > MOST_BYTES:
            problem = f"{places} positions of the head take too much memory (CFA {name})"
            allowed = f"at most {MOST_BYTES / 2**30:g} GiB: smaller images, fewer positions, lamps or distances"
            yield Fault(("vision",), problem, f"{every / 2**30:.1f} GiB", allowed)
            return
        planes = len(mosaic.channels) if vision.input == "demosaicked" else 1
        trained = 4 * _HELD_TIMES * planes * pixels * max(vision.train_images, vision.check_images)
        if vision.network and trained > MOST_BYTES:
            allowed = f"at most {MOST_BYTES / 2**30:g} GiB: smaller images, or fewer of them"
            yield Fault(("vision",), f"images take too much memory (CFA {name})", f"{trained / 2**30:.1f} GiB", allowed)
            return
