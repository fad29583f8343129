"""Bounds on the optics behind a readout that clips: pixels whose mean stays the same may still change what is read."""

from __future__ import annotations

import numpy as np
import pytest

from sweep.camera.accuracy import Accuracy
from sweep.camera.effects import EFFECTS, Box
from sweep.camera.mosaic import Mosaic

from ..hard.scenes import SENSOR, DesignScene, columns, scene, target

_ARITHMETIC_DN = 1e-9
MOSAIC = Mosaic.from_rows("few red", [["C", "C", "C", "C"]] * 3 + [["C", "C", "C", "R"]])
"""A light that is blurred stays among the clear pixels: their mean hardly changes."""
ROUNDING, EVERY_PIXEL = frozenset({"quantization"}), Accuracy(phases_per_px=1, finest_phase_px=0.0)


def saturated(place: list[float] | str, readout: str, level: float) -> DesignScene:
    """A light of 1.2 px that is `level` times as bright as the ADC's end."""

    def made(exposure_s: float) -> DesignScene:
        light = target(600, 60, phase_px=place, readout=readout)
        given = {"target": light, "optics": {"f_number": 2.8}, "intensity_cd": 200}
        given["exposure"] = {"kind": "fixed", "exposure_s": exposure_s}
        found = scene("saturated", "RCCC", given, {"crosstalk": 0.1})
        setup = found.setup.with_camera(mosaic=MOSAIC, qe=SENSOR.mosaic_qe(MOSAIC, None))
        return DesignScene("saturated", setup, found.curves, Box(setup, setup.camera.qe, setup.camera.qe))

    brightest = made(1e-3).box.brightest_pixel_dn
    return made(1e-3 * 4095 * level / brightest)


@pytest.mark.parametrize(
    ("place", "readout", "level"), [([1.0, 1.0], "mean", 3.0), ("any", "mean", 10.0), ([1.5, 1.5], "center", 10.0)]
)
def test_differences_that_cancel_between_pixels_count_where_pixels_clip(
    place: list[float] | str, readout: str, level: float
) -> None:
    made = saturated(place, readout, level)
    with_all = columns(made, ROUNDING, EVERY_PIXEL)
    bound_dn = EFFECTS["crosstalk"].bound_dn
    without_crosstalk = float(np.abs(columns(made, ROUNDING | {"crosstalk"}, EVERY_PIXEL) - with_all).max())
    assert without_crosstalk <= bound_dn(made.box, frozenset({"saturation"})) * (1 + 1e-9) + _ARITHMETIC_DN
    assert EFFECTS["blur"].bound_dn is None
    assert float(np.abs(columns(made, ROUNDING | {"blur"}, EVERY_PIXEL) - with_all).max()) > 0
