"""Scenes in which single effects are strong, weak or at an edge case."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np

from sweep.camera.accuracy import REFERENCE, Accuracy
from sweep.camera.camera import Camera
from sweep.camera.effects import Box
from sweep.camera.model import SceneModel
from sweep.camera.mosaic import Mosaic
from sweep.camera.pixel import Pixel
from sweep.camera.scene import Scene
from sweep.camera.sensor import BUILT_IN_SENSORS
from sweep.camera.setup import Setup
from sweep.designs.families.stopband import Stopband
from sweep.designs.technology import Interference, Technology
from sweep.metrics.evaluate import evaluate
from sweep.metrics.quantity import RequestedQuantities
from sweep.metrics.registry import quantities_of
from sweep.spectra.builtin.registry import BUILT_IN_LIGHTS
from sweep.spectra.lights import Lights
from sweep.spectra.spectrum import WavelengthGrid

GRID, FINE = WavelengthGrid(step_nm=5), WavelengthGrid(step_nm=1)
SENSOR = BUILT_IN_SENSORS["ar0820"](GRID)
FAMILY = Stopband(GRID.nodes_nm, SENSOR.qe["Y"], SENSOR.qe["G"])
LOW = np.array([595.0, 20.0, 640.0, 6.0, 0.9])
HIGH = np.array([605.0, 30.0, 650.0, 20.0, 1.0])
TILES = {
    "RGGB": Mosaic.from_name("RGGB"),
    "RCCC": Mosaic.from_name("RCCC"),
    "RYNCy": Mosaic.from_name("RYNCy"),
    "3x3": Mosaic.from_rows("3x3", [["R", "C", "C"], ["C", "N", "C"], ["C", "C", "Cy"]]),
    "1x3": Mosaic.from_rows("1x3", [["R", "N", "B"]]),
    "quad": Mosaic.from_rows(
        "quad", [["R", "R", "G", "G"], ["R", "R", "G", "G"], ["G", "G", "B", "B"], ["G", "G", "B", "B"]]
    ),
}


@cache
def lights(grid: WavelengthGrid = GRID) -> Lights:
    """Three signals of each type: enough for pairs of every kind, few enough for thousands of scenes."""
    whole = BUILT_IN_LIGHTS["tl16"](grid)
    kept = [int(i) for members in whole.members.values() for i in members[:: max(1, len(members) // 3)][:3]]
    names, types = tuple(whole.names[i] for i in kept), tuple(whole.types[i] for i in kept)
    return Lights("few", names, types, whole.photons[kept], whole.photon_ratio, "", True)


def moving(mosaic: Mosaic, index: float) -> tuple[Technology, ...]:
    """N and M of interference, all others of pigment."""
    made = Technology(interference=Interference(effective_index=index))
    return tuple(made if channel in ("N", "M") else Technology() for channel in mosaic.channels)


@dataclass(frozen=True)
class DesignScene:
    """A scene with one design, and the box of designs that the plan is for."""

    name: str
    setup: Setup
    curves: np.ndarray
    box: Box


def scene(
    name: str,
    cfa: str,
    scenario: dict[str, Any],
    pixel: dict[str, Any] | None = None,
    wide: bool = False,
    seed: int = 1,
    grid: WavelengthGrid = GRID,
    index: float | None = None,
) -> DesignScene:
    """`wide`: plan for a box of filters; else for the one design. `index`: N moves with the angle of the light."""
    mosaic = TILES[cfa]
    sensor = SENSOR if grid is GRID else BUILT_IN_SENSORS["ar0820"](grid)
    family = FAMILY if grid is GRID else Stopband(grid.nodes_nm, sensor.qe["Y"], sensor.qe["G"])
    modified = (mosaic.channels.index("N"),) if "N" in mosaic.channels else ()
    camera = Camera(
        grid,
        mosaic,
        sensor.mosaic_qe(mosaic, {"N": "Y"} if modified else None),
        modified,
        sensor.qe["C"],
        Pixel(**(pixel or {})),
        technologies=() if index is None else moving(mosaic, index),
    )
    setup = Setup(camera, lights(grid), Scene.model_validate(scenario))
    x = LOW + (HIGH - LOW) * np.random.default_rng(seed).uniform(size=5)
    curves = family.curves(x[None]) if modified else np.empty((1, 0, grid.size))
    low, high = setup.camera.qe.copy(), setup.camera.qe.copy()
    if modified:
        hull = family.hull(LOW, HIGH) if wide else (curves[0], curves[0])
        low[list(modified)], high[list(modified)] = hull
    return DesignScene(name, setup, curves, Box(setup, low, high))


def target(distance_m: float, fov_deg: float, **more: Any) -> dict[str, Any]:
    return {"distance_m": distance_m, "fov_deg": fov_deg, **more}


NEAR, MIDDLE, FAR = target(20, 120), target(100, 60), target(250, 30)
TINY = target(600, 60, phase_px="any")
F2, F4 = {"f_number": 2.0}, {"f_number": 4.0}
FIXED = {"kind": "fixed", "exposure_s": 2e-3}
LIT = {"exposure": FIXED, "intensity_cd": 200}
DARK = {"read_noise_e": 2.0, "offset_dn": 64.0}

HARD: tuple[DesignScene, ...] = (
    scene("paper", "RYNCy", {}),
    scene("paper, box", "RYNCy", {}, wide=True),
    scene("far, box", "RYNCy", {"target": FAR, "optics": F2}, wide=True),
    scene("far, any place", "RYNCy", {"target": FAR | {"phase_px": "any"}, "optics": F2}),
    scene("far, on a corner", "RGGB", {"target": FAR | {"phase_px": [1.5, 0.5]}, "optics": F2}),
    scene("one pixel", "RYNCy", {"target": target(1000, 20, phase_px="any"), "optics": F2}),
    scene("3x3 tile, center", "3x3", {"target": FAR | {"readout": "center"}, "optics": F2}),
    scene("1x3 tile", "1x3", {"target": FAR | {"phase_px": "any"}, "optics": F2}),
    scene("quad Bayer, center", "quad", {"target": FAR | {"readout": "center", "phase_px": [1.3, 0.2]}, "optics": F2}),
    scene("focus at 1 m", "RYNCy", {"target": FAR, "optics": {"f_number": 2.0, "focus_m": 1.0}}),
    scene("small aperture", "RYNCy", {"target": FAR, "optics": F2}, {"fill_factor": 0.3}),
    scene("crosstalk", "RYNCy", {}, {"crosstalk": 0.1}),
    scene("off axis", "RYNCy", {"off_axis_deg": 40}),
    scene("fog", "RYNCy", {"target": MIDDLE, "visibility_m": 100}),
    scene("glare", "RYNCy", {"veiling_glare": {"share": 0.03}, "background_cd_m2": 1000, "target": FAR} | LIT),
    scene("glare, box", "RYNCy", {"veiling_glare": {"share": 0.01, "field_cd_m2": 3000}, "target": MIDDLE}, wide=True),
    scene(
        "glare, saturated",
        "RGGB",
        {"veiling_glare": {"share": 0.05, "field_cd_m2": 20000}, "target": MIDDLE, "intensity_cd": 200}
        | {"exposure": {"kind": "fixed", "exposure_s": 4e-2}, "optics": F2},
    ),
    scene("at an angle, alone", "RYNCy", {"optics": {"f_number": 8.0, "cra_deg": 5.0}}, index=1.8),
    scene("at an angle, alone, box", "RYNCy", {"optics": {"f_number": 90.0}}, index=1.8, wide=True),
    scene("background", "RYNCy", {"target": MIDDLE, "background_cd_m2": 3000, "exposure": FIXED, "intensity_cd": 200}),
    scene(
        "flicker",
        "RYNCy",
        {"drive": {"duty": 0.3, "frequency_hz": 90}, "exposure": {"kind": "fixed", "exposure_s": 0.03}},
    ),
    scene("flicker, box", "RYNCy", {"drive": {"duty": 0.5, "frequency_hz": 2000}}, wide=True),
    scene(
        "red saturates", "RYNCy", {"intensity_cd": 200, "exposure": {"kind": "fixed", "exposure_s": 4e-2}, "optics": F2}
    ),
    scene(
        "saturated disc",
        "RGGB",
        {"intensity_cd": 200, "target": FAR, "exposure": {"kind": "fixed", "exposure_s": 2e-2}, "optics": F2},
    ),
    scene(
        "well below the ADC",
        "RYNCy",
        {"intensity_cd": 200, "exposure": {"kind": "fixed", "exposure_s": 2e-2}},
        {"well_e": 8000, "gain_dn_per_e": 0.3},
    ),
    scene("a fraction of a pedestal, far", "RCCC", {"target": FAR, "optics": F2}, {"offset_dn": 30.25}),
    scene("noise, far", "RYNCy", {"noise": True, "target": FAR, "optics": F2}, DARK | {"prnu": 0.01}),
    scene("noise, no pedestal", "RYNCy", {"noise": True}, {"read_noise_e": 3.0}),
    scene(
        "noise, saturated",
        "RYNCy",
        {"noise": True, "intensity_cd": 200, "exposure": {"kind": "fixed", "exposure_s": 2e-2}},
        DARK,
    ),
    scene(
        "everything",
        "RYNCy",
        {
            "noise": True,
            "target": FAR | {"phase_px": "any"},
            "visibility_m": 2000,
            "off_axis_deg": 10,
            "background_cd_m2": 50,
            "intensity_cd": 200,
            "exposure": {"kind": "fixed", "exposure_s": 5e-3},
            "drive": {"duty": 0.5, "frequency_hz": 1000},
            "optics": F2,
        },
        DARK | {"crosstalk": 0.02},
    ),
)


def columns(made: DesignScene, left_out: frozenset[str] = frozenset(), accuracy: Accuracy = REFERENCE) -> np.ndarray:
    """Every CSD of the scene's design; of the best phase only where any is asked for."""
    found = evaluate(SceneModel(replace(made.setup, left_out=left_out, accuracy=accuracy)), made.curves)
    return np.array([found[name][0] for name in csd_columns(made.setup)])


def csd_columns(setup: Setup) -> list[str]:
    """Columns of CSDs, of which a plan and an accuracy bound the error."""
    requested = RequestedQuantities(setup.lights.classes, any_place=setup.all_phases)
    return [name for name, quantity in quantities_of(requested).items() if quantity.has_error_bound]
