"""A box of designs with a single pixel, for bounds of the readout."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from sweep.camera.effects import EFFECTS
from sweep.camera.pixel import Pixel
from sweep.camera.setup import READOUT


def readout_bound_dn(effect: str, pixel: Pixel, brightest_e: float) -> float:
    """On what leaving out an effect of a noisy readout changes in the difference of two pixels, DN."""
    scene: Any = SimpleNamespace(noise=True)
    setup = SimpleNamespace(camera=SimpleNamespace(pixel=pixel), scene=scene)
    box: Any = SimpleNamespace(setup=setup, brightest_pixel_dn=brightest_e * pixel.dn_per_e, _sqrt_channels=1.0)
    bound_dn = EFFECTS[effect].bound_dn
    return bound_dn(box, READOUT)
