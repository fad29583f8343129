"""Maps of color regions beside every pair read out by hand, and what a study may ask for."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.integrate import trapezoid

from sweep.report import make_report
from sweep.results.tables import REGIONS_MAP

from ..build import issues, load, output_of, ran

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

    def read(peak: float, fwhm: float, channels: tuple[str, ...] = ("R", "G", "B")) -> np.ndarray:
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

    own = found[found["design_id"] == 0]
    assert {*own["yellow_nm"]} == {peak for peak, _ in YELLOW}
    widths = (12.0, 18.0, 24.0)
    for row in own.to_dict("records"):
        yellow = {fwhm for peak, fwhm in YELLOW if peak == row["yellow_nm"]}
        assert row["pairs"] % len(yellow) == 0
        if row["pairs"] == len(yellow) * len(widths):  # every width of the red LED is allowed
            apart = {
                (a, b): np.linalg.norm(read(row["yellow_nm"], a) - read(row["red_nm"], b))
                for a in yellow
                for b in widths
            }
            assert row["separated"] == sum(dn >= 150 for dn in apart.values())
            assert row["least_dn"] == pytest.approx(min(apart.values()))
            assert apart[row["yellow_fwhm_nm"], row["red_fwhm_nm"]] == pytest.approx(row["least_dn"])
    assert (own["pairs"] == 3 * 3).any()
    assert own["below_rggb"].sum() == own["chromatic_below_rggb"].sum() == 0
    for row in found[found["design_id"] == 1].to_dict("records"):
        yellow = {fwhm for peak, fwhm in YELLOW if peak == row["yellow_nm"]}
        if row["pairs"] == len(yellow) * len(widths):
            lamps = [((row["yellow_nm"], a), (row["red_nm"], b)) for a in yellow for b in widths]
            both = [(far_apart(*pair, ("R", "Y", "Cy")), far_apart(*pair, ("R", "G", "B"))) for pair in lamps]
            assert row["below_rggb"] == sum(mine[0] < its[0] for mine, its in both)
            assert row["chromatic_below_rggb"] == sum(mine[1] < its[1] for mine, its in both)


@pytest.mark.slow
def test_a_region_map_is_described_and_drawn(tmp_path: Path) -> None:
    output = output_of(tmp_path, TEXT)
    make_report(output)
    found = pd.read_parquet(output.folder / REGIONS_MAP)
    own = found[found["design_id"] == 0]
    share = own["separated"].sum() / own["pairs"].sum()
    assert 0 < share < 1
    page = (output.folder / "report.html").read_text()
    assert f"{share:.1%}" in page
    assert "Lamps that" in page


@pytest.mark.parametrize(
    ("requested", "said"),
    [
        ("regions: {}", "wanted_dn"),
        ("regions: {wanted_dn: 100, norms: [en_12369]}", "en_12368"),
        ("regions: {wanted_dn: 100, norms: [ite, ite]}", "named twice"),
        ("regions: {wanted_dn: 100, peak_nm: [660, 560]}", "660 must not be above 560"),
        ("regions: {wanted_dn: 100, peak_nm: 600}", "two numbers, from and to"),
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
