"""The green, orange and yellow lights of `tl16` beside red LEDs of its two shapes from 627 to 660 nm; not measured."""

from __future__ import annotations

import numpy as np

from ...lights import Lights, make_lights
from ...spectrum import WavelengthGrid
from ..surrogate import BUILT_IN_RANGE_NM, surrogate_parameters
from . import tl16

_SHORTEST_NM, _LONGEST_NM, _STEP_NM = 627.0, 660.0, 3.0
"""Peaks from the shortest of tl16's reds to measured deep reds."""


def lights(grid: WavelengthGrid) -> Lights:
    """Return the signals."""
    known = tl16.lights(grid)
    others = [light for light in zip(known.names, known.types, known.photons, strict=True) if light[1] != "red"]
    peaks_nm = np.arange(_SHORTEST_NM, _LONGEST_NM + _STEP_NM / 2, _STEP_NM)
    reds = [
        (f"{region}_shape_{peak_nm:.0f}_red", "red", tl16.red_led(region, grid.nodes_nm, float(peak_nm)))
        for region in tl16.LAMPS
        for peak_nm in peaks_nm
    ]
    return make_lights(
        grid,
        "tl16_deep_red",
        [*others, *reds],
        "built-in surrogate tl16 with deeper reds",
        photon_ratio=surrogate_parameters().photon_ratio,
        surrogate=True,
    )


def range_nm() -> tuple[float, float]:
    """Return the wavelengths that all have, nm."""
    return BUILT_IN_RANGE_NM
