"""A box of designs with a single pixel, for bounds of the readout."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from sweep.camera.effects import EFFECTS, Box
from sweep.camera.pixel import Pixel
from sweep.camera.setup import READOUT


class OnePixel(Box):
    """A box of a scene with noise, of which bounds of the readout ask no more than this."""

    brightest_pixel_dn: Any = 0.0
    _sqrt_channels: Any = 1.0

    def __init__(self, pixel: Pixel, brightest_e: float) -> None:
        setup = SimpleNamespace(camera=SimpleNamespace(pixel=pixel), scene=SimpleNamespace(noise=True))
        vars(self).update(setup=setup, brightest_pixel_dn=brightest_e * pixel.dn_per_e)


def readout_bound_dn(effect: str, pixel: Pixel, brightest_e: float) -> float:
    """On what leaving out an effect of a noisy readout changes in the difference of two pixels, DN."""
    bound_dn = EFFECTS[effect].bound_dn
    assert bound_dn is not None
    return bound_dn(OnePixel(pixel, brightest_e), READOUT)
