"""Maps of color regions beside every pair read out by hand, and what a study may ask for."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.integrate import trapezoid

from sweep.features.regions import REGIONS_MAP

from ...build import issues, load, ran

ASKED = "regions: {wanted_dn: 150, peak_nm: [585, 645], peak_step_nm: 5, fwhm_nm: [12, 24], fwhm_step_nm: 6}"
TEXT = f"""\
study: allowed
sensor: ar0820
lights: tl16
cfas: [RGGB, RYYCy]
designs:
  mine: {{cfa: RYYCy, channel: Cy, base: Cy, to: 0.0, at: {{left_nm: 613, left_width_nm: 6, right_nm: 651, right_width_nm: 6}}}}
{ASKED}
"""
YELLOW = {(590.0, 12.0), (590.0, 18.0), (590.0, 24.0), (595.0, 12.0), (595.0, 18.0), (595.0, 24.0), (600.0, 24.0)}
"""Not by the code under test: of these peaks and widths those with a color that EN 12368 calls yellow."""


def test_a_map_is_that_of_every_pair_read_out(tmp_path: Path) -> None:
    study = load(tmp_path, TEXT)
    ran(study, tmp_path / "out", 1)
    found = pd.read_parquet(tmp_path / "out" / REGIONS_MAP)
    wave = study.grid.nodes_nm

    def read(peak: float, fwhm: float, channels: tuple[str, ...]) -> np.ndarray:
        qe = np.stack([study.sensor.qe[name] for name in channels])
        scale = 0.95 * 4095 * study.lights.photon_ratio * study.grid.span_nm / trapezoid(qe).max()
        photons = 1 / np.cosh((wave - peak) * 2 * np.arccosh(2) / fwhm)
        return np.asarray(np.rint(trapezoid(photons * qe) / trapezoid(photons) * scale))

    def far_apart(
        yellow: tuple[float, float], red: tuple[float, float], channels: tuple[str, ...]
    ) -> tuple[float, float]:
        a, b = read(*yellow, channels), read(*red, channels)
        sine = np.sqrt(max(0.0, 1 - (a @ b) ** 2 / ((a @ a) * (b @ b))))
        return float(np.linalg.norm(a - b)), float(min(np.linalg.norm(a), np.linalg.norm(b)) * sine)

    assert {*found["yellow_nm"]} == {peak for peak, _ in YELLOW}
    widths, whole = (12.0, 18.0, 24.0), set[int]()
    for row in found[found["design_id"] < 2].to_dict("records"):
        yellow = [(peak, fwhm) for peak, fwhm in YELLOW if peak == row["yellow_nm"]]
        assert row["pairs"] % len(yellow) == 0
        if row["pairs"] < len(yellow) * len(widths):  # not every width of the red LED is allowed
            continue
        lamps = [(a, (row["red_nm"], b)) for a in yellow for b in widths]
        mine = [far_apart(*pair, ("R", "G", "B") if row["design_id"] == 0 else ("R", "Y", "Cy")) for pair in lamps]
        rggb = [far_apart(*pair, ("R", "G", "B")) for pair in lamps]
        assert row["separated"] == sum(dn >= 150 for dn, _ in mine)
        assert row["least_dn"] == pytest.approx(min(dn for dn, _ in mine))
        nearest = lamps.index(((row["yellow_nm"], row["yellow_fwhm_nm"]), (row["red_nm"], row["red_fwhm_nm"])))
        assert mine[nearest][0] == pytest.approx(row["least_dn"])
        assert row["below_rggb"] == sum(a[0] < b[0] for a, b in zip(mine, rggb, strict=True))
        assert row["chromatic_below_rggb"] == sum(a[1] < b[1] for a, b in zip(mine, rggb, strict=True))
        whole.add(len(lamps))
    assert 9 in whole


@pytest.mark.parametrize(
    ("requested", "said"),
    [
        ("regions: {wanted_dn: 100, norms: [ite, ite]}", "named twice"),
        ("regions: {wanted_dn: 100, peak_nm: [660, 560]}", "660 must not be above 560"),
        ("regions: {wanted_dn: 100, peak_step_nm: 0.1, fwhm_step_nm: 0.1}", "too many"),
        ("regions: {wanted_dn: 100, peak_nm: [560, 750]}", "peaks outside the study's wavelengths"),
        ("regions: {wanted_dn: 100, peak_nm: [610, 660]}", "is yellow as en_12368 allows it"),
        ("wavelengths: {step_nm: 20}\nregions: {wanted_dn: 100}", "narrower than a step"),
        (
            "scenarios: {far: {target: {distance_m: 50, fov_deg: 60, phase_px: any}}}\nregions: {wanted_dn: 100}",
            "needs a named sampling phase",
        ),
    ],
)
def test_a_wrong_map_is_one_line(tmp_path: Path, requested: str, said: str) -> None:
    found = issues(tmp_path, TEXT.replace(ASKED, requested))
    assert any(said in issue for issue in found), found
