"""A small benchmark of vision for tests."""

from __future__ import annotations

from typing import Any

import numpy as np

from sweep.camera.camera import Camera
from sweep.camera.mosaic import Mosaic
from sweep.camera.pixel import Pixel
from sweep.camera.scene import Scene
from sweep.camera.sensor import ar0820_sensor
from sweep.camera.setup import Setup
from sweep.features.vision.keys import Vision
from sweep.spectra.builtin.data_sets.tl16 import lights
from sweep.spectra.builtin.surrogate import surrogate_parameters
from sweep.spectra.spectrum import WavelengthGrid

GRID = WavelengthGrid(step_nm=20)
LEVELS = {
    "day": {"illuminance_lx": 4e4, "exposure_s": 5e-5, "phantom_cd": 50.0},
    "night": {"illuminance_lx": 10.0, "light": "sodium street light", "exposure_s": 1e-3},
}


def vision(**changes: Any) -> Vision:
    given: dict[str, Any] = {"fov_deg": 120.0, "distances_m": [150.0, 400.0], "levels": LEVELS}
    return Vision(**given | {"test_images": 60, "train_images": 200, "seeds": 2} | changes)


def head_setup(cfa: str = "RGGB", grid: WavelengthGrid = GRID, **pixel: Any) -> Setup:
    sensor, mosaic = ar0820_sensor(grid, surrogate_parameters()), Mosaic.from_name(cfa)
    noise = {"read_noise_e": 2.0, "offset_dn": 168.0, "prnu": 0.01, "crosstalk": 0.01} | pixel
    qe = sensor.mosaic_qe(mosaic)
    return Setup(Camera(grid, mosaic, qe, (), sensor.curve("C"), Pixel(**noise)), lights(grid), Scene())


NO_FILTERS = np.empty((0, GRID.size))
