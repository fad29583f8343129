"""Surrogate of signals with a filament lamp: a black body behind dyed lenses, which let the near infrared through.

Not measured. Edges of the lenses are chosen so that each color lies in its region of EN 12368; that lenses are clear
from 750 nm on is assumed. Tungsten emits less near infrared than a black body of its color.
"""

from __future__ import annotations

import numpy as np

from ....base.types import PerWavelength
from ...lights import Lights, make_lights
from ...spectrum import WavelengthGrid

_TEMPERATURES_K = (2400.0, 2856.0, 3200.0)
"""Of dimmed, usual (CIE A) and halogen lamps."""
_C2_NM_K = 1.438776877e7
_EDGE_NM, _CLEAR_NM = 8.0, 750.0
"""Decay length of the lenses' edges, and from where they are clear."""
_LENSES_NM = {"green": (480.0, 530.0), "yellow": (558.0, np.inf), "red": (621.0, np.inf)}
"""From where to where a lens is clear in the visible."""


def _passes(wavelength_nm: PerWavelength, edge_nm: float) -> PerWavelength:
    return np.asarray(1 / (1 + np.exp(-(wavelength_nm - edge_nm) / _EDGE_NM)))


def lights(grid: WavelengthGrid) -> Lights:
    """Return a lamp of each temperature behind each lens, at any wavelengths."""
    nodes, signals = grid.nodes_nm, []
    for color, (low, high) in _LENSES_NM.items():
        visible = _passes(nodes, low) * (1 - _passes(nodes, high) if np.isfinite(high) else 1)
        lens = np.maximum(visible, _passes(nodes, _CLEAR_NM))
        for kelvin in _TEMPERATURES_K:
            body = nodes**-4.0 / np.expm1(_C2_NM_K / (nodes * kelvin))
            signals.append((f"{color}_{kelvin:.0f}K", color, body * lens))
    return make_lights(grid, "filament", signals, "built-in surrogate filament", surrogate=True)
