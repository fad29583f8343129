"""Checks of what a benchmark of vision needs of the rest of the study."""

from __future__ import annotations

import math
from collections.abc import Mapping

from ..camera import psf
from ..camera.memory import MOST_BYTES
from ..camera.mosaic import Mosaic
from ..camera.scene import FixedExposure, Scene
from ..curves.color import luminance_per_photon_radiance
from ..curves.lights import Lights
from ..vision.section import FEWEST_LAMPS, MOST_BITS, MOST_READ_NOISE_DN, MOST_WELL_E, Vision
from .schema import StudySection
from .sources import Sources

_HELD_TIMES = 3
"""Times that a network's training images are held in double precision: as they are, and while they are scaled."""
_LEAST_LUMINANCE = 1e-20
"""cd/m^2 for each photon/s/sr/m^2 of a lamp that the eye sees; at 555 nm it is 2.4e-16."""


def check_vision(section: StudySection, lights: Lights, mosaics: Mapping[str, Mosaic], sources: Sources) -> None:
    """Lenses are signal types with lamps enough, tiles divide the images, and the pixel's table can be held."""
    vision = section.vision
    if vision is None:
        return
    for lens in vision.lenses:
        if lens not in lights.classes:
            sources.unknown(("vision", "lenses"), "signal type", lens, list(lights.classes))
            continue
        different = len({lights.photons[i].tobytes() for i in lights.members[lens]})
        if different < FEWEST_LAMPS:
            allowed = f"at least {FEWEST_LAMPS} different lamps: one to train, one to check, one to test"
            sources.add(("vision", "lenses"), f"too few lamps of type {lens}", different, allowed)
        seen = luminance_per_photon_radiance(section.wavelengths, lights.photons[lights.members[lens]])
        if not seen.min() > _LEAST_LUMINANCE:
            problem = f"a lamp of type {lens} is not visible, and has no luminous intensity"
            sources.add(("vision", "lenses"), problem, lens, "lamps that the eye sees")
    for name, mosaic in mosaics.items():
        if any(vision.crop_px % size for size in mosaic.indices.shape):
            rows, columns = mosaic.indices.shape
            problem = f"the tile of {name} ({rows} x {columns}) does not divide the images"
            sources.add(("vision", "crop_px"), problem, vision.crop_px, "a multiple of every tile")
    _check_pixel(section, sources)
    _check_memory(vision, lights, mosaics, sources)
    _check_images(section, vision, sources)


def _check_images(section: StudySection, vision: Vision, sources: Sources) -> None:
    """Every distance makes an image that can be computed."""
    for distance_m in vision.distances_m:
        exposure = FixedExposure(exposure_s=1.0)
        scenario = Scene(target=vision.target(distance_m), optics=vision.optics, exposure=exposure)
        refused = psf.too_much(scenario, section.pixel)
        if refused is not None:
            _, problem, value, allowed = refused
            sources.add(("vision", "distances_m"), f"{problem} at {distance_m:g} m", value, allowed)


def _check_pixel(section: StudySection, sources: Sources) -> None:
    """The table of a pixel's digital numbers can be held, and there is one pixel."""
    pixel = section.pixel
    read_dn = pixel.read_noise_e * pixel.dn_per_e
    for key, value, most in (("bits", pixel.bits, MOST_BITS), ("well_e", pixel.well_e, MOST_WELL_E)):
        if value > most:
            sources.add(("pixel", key), "too large for `vision`", value, f"at most {most:g}")
    if read_dn > MOST_READ_NOISE_DN:
        problem = f"too large for `vision`: {read_dn:.4g} DN"
        sources.add(("pixel", "read_noise_e"), problem, pixel.read_noise_e, f"at most {MOST_READ_NOISE_DN:g} DN")
    for name, scenario in section.scenarios.items():
        if scenario.noise is not None and scenario.noise.of(pixel) != pixel:
            allowed = "noise: true, and the figures in `pixel`"
            sources.add(("scenarios", name, "noise"), "`vision` has one pixel for all scenarios", None, allowed)


def _check_memory(vision: Vision, lights: Lights, mosaics: Mapping[str, Mosaic], sources: Sources) -> None:
    """Lamps at all places, all cases of the observer at one distance and level, and training images fit into memory."""
    pixels = vision.crop_px**2
    n_lenses = len(vision.lenses)
    test_lamps = sum(max(1, len(lights.members.get(lens, ())) // 4) for lens in vision.lenses)
    for name, mosaic in mosaics.items():
        places = mosaic.indices.size * vision.places_per_pixel**2
        lamps = 8 * places * n_lenses * len(lights.names) * pixels * len(vision.distances_m)
        cases = 8 * places * 2 * math.factorial(n_lenses) * (1 + test_lamps * len(vision.intensities_cd)) * pixels
        if (every := max(lamps, cases)) > MOST_BYTES:
            problem = f"{places} places of the head take too much memory (CFA {name})"
            allowed = f"at most {MOST_BYTES / 2**30:g} GiB: smaller images, fewer places, lamps or distances"
            sources.add(("vision",), problem, f"{every / 2**30:.1f} GiB", allowed)
            return
        planes = len(mosaic.channels) if vision.input == "demosaicked" else 1
        trained = 8 * _HELD_TIMES * planes * pixels * max(vision.train_images, vision.check_images, vision.test_images)
        if vision.network and trained > MOST_BYTES:
            allowed = f"at most {MOST_BYTES / 2**30:g} GiB: smaller images, or fewer of them"
            sources.add(("vision",), f"images take too much memory (CFA {name})", f"{trained / 2**30:.1f} GiB", allowed)
            return
