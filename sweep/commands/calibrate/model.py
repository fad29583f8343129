"""The figures that a set of surrogate parameters gives."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ...base.types import FloatArray
from ...camera.mosaic import Mosaic
from ...camera.pixel import Pixel
from ...camera.scene import Scene
from ...camera.sensor import SensorCurves, ar0820_sensor
from ...camera.view import View
from ...curves.builtin.surrogate import StopbandParameters, SurrogateParameters
from ...curves.builtin.tl16 import SIGNAL_TYPES, tl16
from ...curves.color import REGIONS, chromaticity
from ...curves.lights import Lights, class_pairs
from ...curves.spectrum import WavelengthGrid
from ...designs.families.stopband import Stopband
from ...metrics.columns.sensitivity import SENSITIVITY
from ...metrics.evaluate import designed_quantities
from ...metrics.separation import csd_name, separations
from ...metrics.smooth import smooth_response

GRID = WavelengthGrid()
MODIFIED_CFA = "RYNCy"
DISTANCES = {csd_name(pair): "/".join(pair) for pair in class_pairs(SIGNAL_TYPES)}
"""Columns of CSDs, with their pairs in words."""
Figures = dict[str, dict[str, float]]
"""Row (a CFA or a stopband filter) -> quantity -> value."""


def figures(parameters: SurrogateParameters, rows: Sequence[str]) -> Figures:
    """CSDs (smooth response, DN) of `rows`, and the sensitivity of those that are stopband filters.

    The chart of the paper: white-patch exposure, every signal with the same photon count.
    """
    sensor, lights = ar0820_sensor(GRID, parameters), tl16(GRID, parameters)
    found = {row: _plain(row, sensor, lights) for row in rows if row not in parameters.stopbands}
    found |= _filtered([row for row in rows if row in parameters.stopbands], parameters, sensor, lights)
    return {row: found[row] for row in rows}


def _view(mosaic: Mosaic, sensor: SensorCurves, lights: Lights, base: Mapping[str, str]) -> View:
    modified = tuple(mosaic.channels.index(channel) for channel in base)
    qe = sensor.mosaic_qe(mosaic, base)
    return View(GRID, mosaic, qe, modified, sensor.qe["C"], lights, Pixel(), Scene())


def _plain(cfa: str, sensor: SensorCurves, lights: Lights) -> dict[str, float]:
    view = _view(Mosaic.from_name(cfa), sensor, lights, {})
    response = smooth_response(view, np.empty((1, 0, GRID.size)))[:, 0]
    return {csd_name(pair): float(v[0]) for pair, v in separations(response, lights.members).items()}


def _filtered(rows: Sequence[str], parameters: SurrogateParameters, sensor: SensorCurves, lights: Lights) -> Figures:
    if not rows:
        return {}
    view = _view(Mosaic.from_name(MODIFIED_CFA), sensor, lights, {"N": "Y"})
    x = np.array([[*stopband_values(parameters.stopbands[row]), 1.0] for row in rows])
    curves = Stopband(GRID.nodes_nm, sensor.qe["Y"], sensor.qe["G"]).curves(x)
    distances = separations(smooth_response(view, curves)[:, 0], lights.members)
    sensitivity = designed_quantities(view, curves)[SENSITIVITY]
    return {
        row: {csd_name(pair): float(v[i]) for pair, v in distances.items()} | {SENSITIVITY: float(sensitivity[i])}
        for i, row in enumerate(rows)
    }


def stopband_values(stopband: StopbandParameters) -> tuple[float, float, float, float]:
    """Edges as `families.Stopband` takes them."""
    return (stopband.left_nm, stopband.left_width_nm, stopband.right_nm, stopband.right_width_nm)


def crossed_edges(parameters: SurrogateParameters) -> FloatArray:
    """How far the edges of each stopband filter are crossed, nm, ndarray[n_filters]; in order where <= 0."""
    x = np.array([[*stopband_values(stopband), 1.0] for stopband in parameters.stopbands.values()])
    flat = np.zeros(GRID.size)
    return np.asarray(Stopband(GRID.nodes_nm, flat, flat).violation(x).max(axis=1), dtype=float)


def color_violations(parameters: SurrogateParameters) -> FloatArray:
    """How far each of the 51 signals is outside its color region, ndarray[n_signals]; inside where <= 0."""
    lights = tl16(GRID, parameters)
    xy = chromaticity(GRID, lights.photons)
    found = np.empty(len(lights.names))
    for name, index in lights.members.items():
        found[index] = REGIONS[name].violation(xy[index])
    return found
