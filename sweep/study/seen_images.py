"""What a benchmark of vision needs of the rest of the study."""

from __future__ import annotations

from collections.abc import Mapping

from ..camera.effects import blur
from ..camera.mosaic import Mosaic
from ..camera.scenario import Scenario
from ..camera.scene import FixedExposure
from ..curves.color import luminance_per_photon_radiance
from ..curves.lights import Lights
from ..vision.section import FEWEST_LAMPS, MOST_BITS, MOST_WELL_E, Vision
from .schema import StudySection
from .sources import Sources

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
    if section.pixel.bits > MOST_BITS:
        sources.add(("pixel", "bits"), "too many for `vision`", section.pixel.bits, f"at most {MOST_BITS}")
    if section.pixel.well_e > MOST_WELL_E:
        sources.add(("pixel", "well_e"), "too large for `vision`", section.pixel.well_e, f"at most {MOST_WELL_E:g}")
    _check_images(section, vision, sources)


def _check_images(section: StudySection, vision: Vision, sources: Sources) -> None:
    """Every distance makes an image that can be computed."""
    for distance_m in vision.distances_m:
        exposure = FixedExposure(exposure_s=1.0)
        scenario = Scenario(target=vision.target(distance_m), optics=vision.optics, exposure=exposure)
        refused = blur.too_much(scenario, section.pixel)
        if refused is not None:
            _, problem, value, allowed = refused
            sources.add(("vision", "distances_m"), f"{problem} at {distance_m:g} m", value, allowed)
