"""The exposure that a filter sets, and field positions, of whole evaluations."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sweep.camera.camera import Camera
from sweep.camera.linear import linear_model
from sweep.camera.model import scene_model
from sweep.camera.mosaic import Mosaic
from sweep.camera.pixel import Pixel
from sweep.camera.scene import Scene
from sweep.camera.sensor import BUILT_IN_SENSORS
from sweep.camera.sensor_field import SensorField
from sweep.camera.setup import Setup
from sweep.designs.families.stopband import Stopband
from sweep.metrics.columns.sensitivity import sensitivities_gradient
from sweep.metrics.evaluate import designed_quantities, evaluate
from sweep.metrics.smooth import smooth_response
from sweep.spectra.builtin.registry import BUILT_IN_LIGHTS
from sweep.spectra.spectrum import WavelengthGrid

GRID = WavelengthGrid()
SENSOR = BUILT_IN_SENSORS["ar0820"](GRID)
LIGHTS = BUILT_IN_LIGHTS["tl16"](GRID)
FAMILY = Stopband(GRID.nodes_nm, SENSOR.qe["Y"], SENSOR.qe["G"])
X = np.array([[606.6, 36.5, 645.8, 6.8, 1.0], [600.0, 20.0, 660.0, 30.0, 0.7]])


def setup(scenario: Scene | None = None, base: str = "Y") -> Setup:
    mosaic = Mosaic.from_name("RYNCy")
    modified, qe = (mosaic.channels.index("N"),), SENSOR.mosaic_qe(mosaic, {"N": base})
    return Setup(Camera(GRID, mosaic, qe, modified, SENSOR.qe["C"], Pixel()), LIGHTS, scenario or Scene())


def test_gradients_agree_with_central_differences_where_the_filter_sets_the_exposure() -> None:
    """N over the clear pixel is the brightest channel."""
    made, family = setup(base="C"), Stopband(GRID.nodes_nm, SENSOR.qe["C"], SENSOR.qe["G"])
    x, step = X[1], 1e-4
    exact = linear_model(made).smooth_with_gradient(family.curves(x[None])[0], family.gradient(x))[1]
    amounts = sensitivities_gradient(made, family.gradient(x))
    for index in range(5):
        shift = np.eye(5)[index] * step
        ends = family.curves(np.stack([x + shift, x - shift]))
        response = smooth_response(made, ends)
        np.testing.assert_allclose(exact[index], (response[0] - response[1]) / (2 * step), atol=2e-5)
        values = designed_quantities(made, ends)
        for name, gradient in amounts.items():
            assert gradient[index] == pytest.approx((values[name][0] - values[name][1]) / (2 * step), abs=1e-8)


def test_field_positions_that_differ_by_nothing_that_is_computed_are_one() -> None:
    """The light's fall-off, left out of a slightly tilted scene with pigments, is all that differs between positions."""
    scenario = Scene(off_axis_deg=0.4, field=SensorField(cra_max_deg=20.0, places="any"))
    tilted = replace(setup(scenario=scenario), left_out=frozenset({"illumination"}))
    found, on_axis = (evaluate(scene_model(v), FAMILY.curves(X)) for v in (tilted, setup()))
    for name, values in on_axis.items():
        np.testing.assert_allclose(found[name], values, rtol=1e-12, err_msg=name)
