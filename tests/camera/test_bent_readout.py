"""Promises of the optics behind a readout that clips: pixels whose mean stays the same may still change what is read."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from sweep.camera.methods import REFERENCE
from sweep.camera.plan.bounds import Box
from sweep.camera.plan.planner import Planner
from sweep.camera.plan.work import DesignCount

from sweep.camera.mosaic import Mosaic

from ..hard.scenes import SENSOR, Scene, columns, scene, target

_ARITHMETIC_DN = 1e-9
MOSAIC = Mosaic.from_rows("few red", [["C", "C", "C", "C"]] * 3 + [["C", "C", "C", "R"]])
"""A light that is blurred stays among the clear pixels: their mean hardly changes."""
CLIPS = replace(REFERENCE, noise="skip", quantization="skip", phase="pixel")


def saturated(place: list[float] | str, readout: str, level: float) -> Scene:
    """A light of 1.2 px that is `level` times as bright as the ADC's end."""

    def made(exposure_s: float) -> Scene:
        light = target(600, 60, phase_px=place, readout=readout)
        given = {"target": light, "optics": {"f_number": 2.8}, "intensity_cd": 200}
        given["exposure"] = {"kind": "fixed", "exposure_s": exposure_s}
        found = scene("saturated", "RCCC", given, {"crosstalk": 0.1})
        view = replace(found.view, mosaic=MOSAIC, qe=SENSOR.mosaic_qe(MOSAIC, None))
        return Scene("saturated", view, found.curves, Box(view, view.qe, view.qe, DesignCount(1)))

    brightest = float(Planner([made(1e-3).box])._scenes[0].reach.brightest_dn.max())
    return made(1e-3 * 4095 * level / brightest)


@pytest.mark.parametrize("place", [[1.0, 1.0], [1.5, 1.5], "any"], ids=["pixel", "corner", "any"])
@pytest.mark.parametrize(("readout", "level"), [("mean", 3.0), ("mean", 10.0), ("center", 10.0)])
def test_what_cancels_between_pixels_counts_where_they_clip(
    place: list[float] | str, readout: str, level: float
) -> None:
    made = saturated(place, readout, level)
    planner, reference = Planner([made.box]), columns(made, CLIPS)
    for effect, method in {"blur": "skip", "crosstalk": "skip", "demosaic": "skip"}.items():
        if effect == "demosaic" and readout == "mean":
            continue
        after = replace(CLIPS, **{effect: method})
        realized = float(np.abs(columns(made, after) - reference).max())
        assert realized <= planner.promise(effect, CLIPS, after) * (1 + 1e-9) + _ARITHMETIC_DN
