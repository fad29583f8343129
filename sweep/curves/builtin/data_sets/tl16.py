"""The paper's 16 traffic lights: a surrogate, modeled from stated parameters."""

from __future__ import annotations

from ...lights import Lights
from ...spectrum import WavelengthGrid
from ..surrogate import surrogate_parameters
from ..tl16 import tl16


def lights(grid: WavelengthGrid) -> Lights:
    """See `tl16`, with the parameters that the package ships."""
    return tl16(grid, surrogate_parameters())
