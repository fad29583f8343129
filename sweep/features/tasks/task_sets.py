"""The eight tasks of the package, and tasks of a study from its groups of spectra."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ...base.types import Array, Float, FloatArray, PerWavelength
from ...spectra.builtin import spectra, surrogate_spectra
from ...spectra.builtin.data_sets.tl16 import lights
from ...spectra.builtin.groups import spectra_of_group
from ...spectra.color import luminance_per_photon_radiance, tristimulus
from ...spectra.spectrum import WavelengthGrid, equal_photons, photons_from_energy
from .spectra import ILLUMINANTS, Chart, GriddedTask, TaskColumns

_WHITE_LED = [f"LED-{kind}" for kind in ("B1", "B2", "B3", "B4", "B5", "BH1", "V1", "V2")]
_HID = ["HP4", "HP5"]
_GRAY = 0.18
_STREET = ("d65", "a", "led", "hps")
THERMAL_K = {"d65": 6504.0, "d50": 5003.0, "a": 2855.54}
"""Correlated color temperatures of lights that reach 1,000 nm; there, daylight is without the absorption of water."""
_C2_NM_K = 1.438776877e7
"""Second radiation constant, exact in the SI of 2019."""
_MOST = 20
"""Spectra of a class of a shipped task: of larger groups an even share."""


def illuminant(grid: WavelengthGrid, name: str) -> PerWavelength:
    """Return the relative photons of an illuminant; daylight and filament go on as black bodies beyond its samples."""
    spectrum = spectra.spectrum_of(*ILLUMINANTS[name])
    photons, nodes, last_nm = spectra.gridded(grid, spectrum), grid.nodes_nm, float(spectrum.wavelength_nm[-1])
    if name in THERMAL_K and nodes[-1] > last_nm:
        at = np.append(nodes, last_nm)
        body = at**-4.0 / np.expm1(_C2_NM_K / (at * THERMAL_K[name]))
        end = float(photons_from_energy(np.array([last_nm]), spectrum.value[-1:])[0])
        photons = np.where(nodes > last_nm, body[:-1] * end / body[-1], photons)
    return photons


def chart(grid: WavelengthGrid, reflectances: Float[Array, "patches wavelengths"], lights: Sequence[str]) -> Chart:
    """Return patches under lights of 1 lx."""
    photons, gray, xyz, white = [], [], [], []
    for name in lights:
        light = equal_photons(grid, illuminant(grid, name)[None])[0]
        of_white = light / (np.pi * luminance_per_photon_radiance(grid, light[None])[0])  # 1 lx: a luminance of 1 / pi
        patch_photons = np.concatenate([reflectances, np.ones((1, grid.size))]) * of_white
        patch_xyz = tristimulus(grid, patch_photons)
        photons.append(patch_photons[:-1])
        gray.append(_GRAY * of_white)
        xyz.append(patch_xyz[:-1] / patch_xyz[-1, 1])
        white.append(patch_xyz[-1] / patch_xyz[-1, 1])
    return Chart(np.stack(photons), np.stack(gray), np.stack(xyz), np.stack(white))


def separation_task(
    grid: WavelengthGrid, name: str, classes: Mapping[str, Float[Array, "_ wavelengths"]], lights: Sequence[str] = ()
) -> GriddedTask:
    """Return a task of classes of spectra."""
    stacked = np.concatenate(list(classes.values()))
    lit = [stacked * illuminant(grid, light) for light in lights] or [stacked]
    types = tuple(kind for kind, spectra_of_class in classes.items() for _ in spectra_of_class)
    photons = np.stack([equal_photons(grid, spectra_of_class) for spectra_of_class in lit])
    return GriddedTask(TaskColumns(name, "separation", tuple(lights) or ("",)), types, photons)


def shipped(grid: WavelengthGrid, name: str) -> GriddedTask:
    """Return a task of the package."""

    def groups(*names: str) -> dict[str, Float[Array, "_ wavelengths"]]:
        return {name: spectra_of_group(grid, name, _MOST) for name in names}

    def white(*names: str) -> list[PerWavelength]:
        return [spectra.gridded(grid, spectra.spectrum_of("cie_illuminants", name)) for name in names]

    classes: dict[str, FloatArray] = {}
    cases: tuple[str, ...] = ()
    match name:
        case "color" | "low_light":
            cases = _STREET if name == "color" else ("a", "led", "hps")
            iso_patches = chart(grid, spectra_of_group(grid, "iso_17321")[:18], ["d50"]) if name == "color" else None
            patches = chart(grid, spectra_of_group(grid, "colorchecker"), cases)
            return GriddedTask(TaskColumns(name, name, cases), chart=patches, metamerism_chart=iso_patches)
        case "vehicle_lamps":
            reversing = np.stack([illuminant(grid, "a"), *white(*_WHITE_LED)])
            classes = {**groups("brake red", "turn amber"), "reversing white": reversing}
        case "emergency":
            classes = {**groups("emergency blue"), "white": np.stack(white(*_WHITE_LED, *_HID))}
        case "road_marking":
            classes, cases = groups("white marking", "yellow marking"), (*_STREET, "lps")
        case "traffic_signs":
            classes, cases = groups(*filter(surrogate_spectra.is_sheeting, surrogate_spectra.SURROGATES)), _STREET
        case "vegetation":
            signals = lights(grid)
            leaves = spectra_of_group(grid, "canopy", _MOST) * illuminant(grid, "d65")
            classes = {"vegetation": leaves, "green": signals.photons[signals.members["green"]]}
        case "unseen_lamps":
            classes = groups("unseen green", "unseen yellow", "unseen red")
    return separation_task(grid, name, classes, cases)
