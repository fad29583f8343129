"""Checks of a benchmark of vision against the pixel, the lights, the tiles and the memory of a study."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

from ...base.errors import Fault, unknown
from ...camera import psf
from ...camera.memory import MOST_BYTES
from ...camera.mosaic import Mosaic
from ...camera.noise.merge import light_of
from ...camera.noise.merged_readings import NOISE_BINS, countable, n_roots
from ...camera.pixel import Pixel
from ...camera.scene import FixedExposure, Scene
from ...spectra.color import luminance_per_photon_radiance
from ...spectra.lights import Lights
from ...spectra.spectrum import WavelengthGrid
from .crops import reach_px
from .head import head_places_px, housing_diameters
from .keys import (
    FEWEST_LAMPS,
    MOST_BITS,
    MOST_READ_NOISE_DN,
    MOST_READINGS,
    MOST_ROOTS,
    MOST_WELL_E,
    Vision,
)
from .street import MOST_COLUMNS, MOST_ROWS, street_shape

_LEAST_LUMINANCE = 1e-20
"""cd/m^2 for each photon/s/sr/m^2 of a lamp that the eye sees; at 555 nm it is 2.4e-16."""


def vision_faults(
    vision: Vision,
    pixel: Pixel,
    scenarios: Mapping[str, Scene],
    lights: Lights,
    mosaics: Mapping[str, Mosaic],
    grid: WavelengthGrid,
) -> Iterator[Fault]:
    """Check that lenses are signal types with lamps enough, tiles divide the images, and tables and images fit."""
    for lens in vision.lenses:
        if lens not in lights.classes:
            yield unknown(("vision", "lenses"), "signal type", lens, lights.classes)
            continue
        different = len({lights.photons[i].tobytes() for i in lights.members[lens]})
        if different < FEWEST_LAMPS:
            allowed = f"at least {FEWEST_LAMPS} different lamps: one to train, one to check, one to test"
            yield Fault(("vision", "lenses"), f"too few lamps of type {lens}", different, allowed)
        luminance = luminance_per_photon_radiance(grid, lights.photons[lights.members[lens]])
        if not luminance.min() > _LEAST_LUMINANCE:
            problem = f"a lamp of type {lens} is not visible, and has no luminous intensity"
            yield Fault(("vision", "lenses"), problem, lens, "lamps that the eye sees")
    for name, mosaic in mosaics.items():
        rows, columns = mosaic.indices.shape
        if any(vision.crop_px % size or vision.crop_px < 2 * size for size in (rows, columns)):
            problem = f"the tile of {name} ({rows} x {columns}) does not divide the images, twice at least"
            yield Fault(("vision", "crop_px"), problem, vision.crop_px, "a multiple of every tile")
            return
        if vision.street is not None:
            nearest_m = min(vision.distances_m)
            high_px = vision.target(nearest_m).object_resolution_px * housing_diameters(vision)[1]
            y_px = head_places_px(vision, mosaic)[:, 1]
            if y_px.min() - high_px / 2 < -0.5 or y_px.max() + high_px / 2 > vision.crop_px - 0.5:
                problem = f"a head of {high_px:.1f} px at {nearest_m:g} m does not fit, of which a street has boxes"
                yield Fault(("vision", "crop_px"), problem, vision.crop_px, "larger images, or heads farther away")
                return
    if vision.street is not None:
        shapes = {name: street_shape(vision, mosaic.indices.shape) for name, mosaic in mosaics.items()}
        name, (rows, columns) = max(shapes.items(), key=lambda item: item[1][0] * item[1][1])
        if rows > MOST_ROWS or columns > MOST_COLUMNS:
            problem = f"streets of {columns} x {rows} pixels (CFA {name})"
            yield Fault(("vision", "street"), problem, None, f"at most {MOST_COLUMNS} x {MOST_ROWS}")
    for distance_m in vision.distances_m:
        scene = Scene(target=vision.target(distance_m), optics=vision.optics, exposure=FixedExposure(exposure_s=1.0))
        if (fault := psf.image_fault(scene, pixel)) is not None:
            problem = f"{fault.problem} at {distance_m:g} m"
            yield Fault(("vision", "distances_m"), problem, fault.value, fault.allowed)
    yield from _pixel_faults(pixel, scenarios)
    yield from _memory_faults(vision, lights, mosaics)


def _pixel_faults(pixel: Pixel, scenarios: Mapping[str, Scene]) -> Iterator[Fault]:
    """Check that the table of a pixel's digital numbers can be held, and that there is one pixel."""
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
        yield from _merged_faults(pixel)
    for name, scene in scenarios.items():
        if scene.noise is not None and scene.noise.of(pixel) != pixel:
            allowed = "noise: true, and the figures in `pixel`"
            yield Fault(("scenarios", name, "noise"), "`vision` has one pixel for all scenarios", None, allowed)


def _merged_faults(pixel: Pixel) -> Iterator[Fault]:
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


def _memory_faults(vision: Vision, lights: Lights, mosaics: Mapping[str, Mosaic]) -> Iterator[Fault]:
    """Check that lamps at all phases, the observer's cases at one distance and level, and prototypes fit."""
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
        crop = reach_px(vision, mosaic.indices.shape[0]).size * reach_px(vision, mosaic.indices.shape[1]).size
        hidden = math.factorial(n_lenses) * (1 + n_lenses * len(vision.intensities_cd)) * 2 * places
        each = 4 * (1 + len(mosaic.channels))  # bytes of a pixel's mean, and of a direction for each channel
        conditions = len(vision.distances_m) * len(vision.levels) * len(vision.backgrounds)
        if vision.prototypes and (held := each * crop * hidden * conditions) > MOST_BYTES:
            problem = f"prototypes of {hidden:,} classes of a head take too much memory (CFA {name})"
            allowed = f"prototypes: false, or at most {MOST_BYTES / 2**30:g} GiB"
            yield Fault(("vision", "prototypes"), problem, f"{held / 2**30:.1f} GiB", allowed)
            return
