"""The green, orange and yellow lights of `tl16` beside red LEDs of its two shapes from 627 to 660 nm; not measured."""

from __future__ import annotations

import numpy as np

from ...lights import Lights, make_lights
from ...spectrum import WavelengthGrid
from ..led import led_photons
from ..surrogate import surrogate_parameters
from . import tl16

FIRST_NM, LAST_NM, STEP_NM = 627.0, 660.0, 3.0
"""From tl16's reds to the deepest that norms without a limit toward red allow."""


def lights(grid: WavelengthGrid) -> Lights:
    """Return the signals."""
    known = tl16.lights(grid)
    parameters = surrogate_parameters()
    others = [
        (name, kind, photons)
        for name, kind, photons in zip(known.names, known.types, known.photons, strict=True)
        if kind != "red"
    ]
    reds = []
    for region in tl16.LAMPS:
        led = parameters.lights[region]["red"]
        for peak_nm in np.arange(FIRST_NM, LAST_NM + STEP_NM / 2, STEP_NM):
            spectrum = led_photons(grid.nodes_nm, float(peak_nm), led.blue_nm, led.red_nm)
            reds.append((f"{region}_shape_{peak_nm:.0f}_red", "red", spectrum))
    return make_lights(
        grid,
        "tl16_deep_red",
        [*others, *reds],
        "built-in surrogate tl16 with deeper reds",
        photon_ratio=parameters.photon_ratio,
        surrogate=True,
    )
