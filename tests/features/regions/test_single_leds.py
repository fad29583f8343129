"""Color regions of norms beside their published corners, and LEDs beside colour-science's chromaticities."""

from __future__ import annotations

import numpy as np
import pytest

from sweep.features.regions.section import Norm, RegionMap, all_leds
from sweep.spectra.color import SIGNAL_REGIONS

from ...late import Late

colour = Late("colour")

SAE_J578 = {
    "red": ((0.665, 0.335), (0.645, 0.335), (0.721, 0.259), (0.735, 0.265)),
    "yellow": ((0.560, 0.440), (0.545, 0.425), (0.597, 0.390), (0.609, 0.390)),
}
"""Printed corners, those on the spectral locus included."""


@pytest.mark.parametrize("kind", ["yellow", "red"])
def test_the_region_of_vehicles_has_the_corners_that_sae_j578_prints(kind: str) -> None:
    region = SIGNAL_REGIONS["un_r48"][kind]
    purple = np.array([[0.1741, 0.0050], [0.7347, 0.2653]])
    for corner in SAE_J578[kind]:
        slack = [a * corner[0] + b * corner[1] - c for a, b, c in region.bounds]
        assert max(slack) < 1.5e-3, corner
        (ax, ay), (bx, by) = purple[1] - purple[0], corner - purple[0]
        on_line = abs(ax * by - ay * bx) < 1.5e-3 * np.hypot(ax, ay)
        edges = sum(abs(s) < 1.5e-3 for s in slack) + (sum(corner) > 0.998) + on_line
        assert edges >= 2, corner  # two bounds, or one and the end of all colors


CONDITIONS = {
    ("en_12368", "yellow"): lambda x, y: y >= 0.387 and y >= 0.980 - x and y <= 0.727 * x + 0.054,
    ("en_12368", "red"): lambda x, y: 0.290 <= y <= 0.320 and y >= 0.980 - x,
    ("ite", "yellow"): lambda x, y: 0.411 <= y <= 0.452 and y >= 0.995 - x,
    ("ite", "red"): lambda x, y: y <= 0.308 and y >= 0.998 - x,
}


@pytest.mark.parametrize("norm", ["en_12368", "ite"])
@pytest.mark.parametrize("kind", ["yellow", "red"])
def test_norm_allows_colors_within_its_boundaries(norm: Norm, kind: str) -> None:
    requested = RegionMap(wanted_dn=1, peak_nm=(578.0, 664.0), peak_step_nm=2, fwhm_nm=(12.0, 36.0), fwhm_step_nm=12)
    found = all_leds(requested).allowed(norm, kind)
    allowed = {*zip(found.peak_nm, found.fwhm_nm, strict=True)}
    assert 5 < len(allowed) < 100
    functions = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"]
    wave = functions.wavelengths
    for peak in np.arange(578.0, 665.0, 2.0):
        for fwhm in (12.0, 24.0, 36.0):
            photons = 1 / np.cosh((wave - peak) * 2 * np.arccosh(2) / fwhm)
            seen = (photons / wave) @ functions.values
            x, y = seen[:2] / seen.sum()
            assert ((peak, fwhm) in allowed) == CONDITIONS[norm, kind](x, y), (peak, fwhm, x, y)
