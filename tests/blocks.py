"""A space of stopbands, and scenes whose blocks are computed in different ways."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from sweep.camera.accuracy import Accuracy
from sweep.camera.setup import READOUT, Setup
from sweep.designs.space import Filter, Space

from .hard.scenes import DARK, F2, FAMILY, FAR, FIXED, scene

AXES = ((590.0, 600.0, 610.0), (5.0, 20.0), (640.0, 655.0), (0.0, 6.0, 30.0), (0.5, 1.0))


SPACE = Space("sweep", "edges", "RYNCy", Filter(FAMILY, {"N": "Y"}, "G"), AXES)


def setup_of(
    scenario: dict[str, Any], pixel: dict[str, Any] | None = None, left_out: frozenset[str] = frozenset()
) -> Setup:
    return replace(scene("scene", "RYNCy", scenario, pixel).setup, left_out=left_out)


EVERY_PIXEL = Accuracy(phases_per_px=1, finest_phase_px=0.0)
"""A light at one phase in each pixel of the tile."""

VIEWS = {
    "chart": setup_of({}, left_out=READOUT),
    "saturated": setup_of(
        {"intensity_cd": 200, "exposure": {"kind": "fixed", "exposure_s": 4e-2}}, left_out=frozenset({"quantization"})
    ),
    "rounded": setup_of({}),
    "noise": setup_of({"noise": True}, DARK | {"prnu": 0.01}),
    "background": setup_of({"background_cd_m2": 300, "intensity_cd": 200, "exposure": FIXED}, left_out=READOUT),
    "far": setup_of({"target": FAR, "optics": F2}, left_out=READOUT),
    "far, pixel by pixel": setup_of({"target": FAR, "optics": F2}),
    "any place": replace(
        setup_of({"target": FAR | {"phase_px": "any"}, "optics": F2}, left_out=READOUT), accuracy=EVERY_PIXEL
    ),
    "crosstalk": setup_of({}, {"crosstalk": 0.1}),
    "pulsed": setup_of(
        {"drive": {"duty": 0.5, "frequency_hz": 90}, "exposure": {"kind": "fixed", "exposure_s": 0.003}}
    ),
}
