"""The map of the best objective over two parameters, and its report."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.optimize import brentq

from sweep.base.errors import StudyError
from sweep.features.map.bands import _widest, _width_at, widest_bands
from sweep.metrics.evaluate import designed_quantities
from sweep.metrics.smooth import smooth_csd
from sweep.report import read_output
from sweep.search.held import fix_parameters, search_held
from sweep.study import load_study

from ...build import ran
from ...commanded import commanded
from ...search.problems import YELLOW_RED

STUDY = """\
study: tiny band
sensor: ar0820
lights: tl16
cfas: [RGGB, RYNCy]
colorants: {catalog: modeled, assumed: {molar_extinction: 80000, molar_mass_g_per_mol: 400, film_density_g_per_cm3: 1.25}}
boxes:
  band: {cfa: RYNCy, channel: N, base: Y, family: absorption_bands, box: {peak_nm: [580, 700], fwhm_nm: [20, 80], absorbance: [0, 3]}}
constraints: {sensitivity: {min: 0.9}}
search: {starts: 2, max_evaluations: 200, map: MAP}
"""
MAP = "{peak_nm: [628, 636, 644], fwhm_nm: [30, 44, 60]}"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("map")
    (made / "band.yaml").write_text(STUDY.replace("MAP", MAP))
    ran(load_study(made / "band.yaml"), made / "out", 1)
    return made


def test_each_cell_is_the_best_of_a_fine_grid_of_amounts(folder: Path) -> None:
    """By the forward model itself, at 601 absorbances."""
    table = pd.read_parquet(folder / "out" / "map.parquet")
    assert list(zip(table["peak_nm"], table["fwhm_nm"], strict=True)) == [
        (peak, fwhm) for peak in (628, 636, 644) for fwhm in (30, 44, 60)
    ]
    study = load_study(folder / "band.yaml")
    assert study.search is not None
    problem = study.problem(study.search)
    for cell in table.iloc[[0, 4, 8]].to_dict("records"):
        x = np.array([[cell["peak_nm"], cell["fwhm_nm"], amount, 0.0] for amount in np.linspace(0, 1.5, 601)])
        curves = problem.family.curves(x)
        feasible = designed_quantities(problem.setup, curves)["sensitivity"] >= 0.9
        best = smooth_csd(problem.setup, curves, YELLOW_RED)[feasible].max()
        assert best - 1e-9 <= cell["objective"] <= best * 1.01
        assert cell["feasible"]


def test_the_report_says_how_wide_a_band_may_be(folder: Path) -> None:
    output = read_output(folder / "out")
    rggb = float(output.table[output.table["name"] == "RGGB"]["csd_yellow_red"].iloc[0])
    band = widest_bands(output, {"RGGB": rggb})["RGGB"]
    fwhm_nm, peak_nm = math.floor(band["fwhm_nm"]), round(band["peak_nm"])
    assert (fwhm_nm, peak_nm) == (44, 636)
    study = load_study(folder / "band.yaml")
    assert study.search is not None
    problem, names = study.problem(study.search), study.search.space.parameters
    held = fix_parameters(problem, {names.index("peak_nm"): peak_nm, names.index("fwhm_nm"): fwhm_nm})
    assert search_held(held, "SLSQP", 60, 1).objective >= rggb


@pytest.mark.parametrize("curve", [lambda nm: 300 * np.exp(-nm / 50), lambda nm: 200 - (nm / 4) ** 2])
@pytest.mark.parametrize("level", [81.0, 123.0])
def test_a_width_between_cells_reaches_the_level(curve: Callable[[np.ndarray], np.ndarray], level: float) -> None:
    """Of a convex and a concave objective, on coarse and on fine maps; the fine one is within 0.1 nm of the end."""
    exact = brentq(lambda nm: curve(nm) - level, 10, 80)
    for step_nm in (2.0, 7.0, 20.0):
        nm = np.arange(2.0, 120.0, step_nm)
        width_nm = _width_at(nm, curve(nm), level)
        assert exact - (0.1 if step_nm == 2 else step_nm) <= width_nm <= exact + 1e-9


@pytest.mark.parametrize("top_nm", [634.0, 637.0, 639.7])
def test_the_widest_band_is_no_wider_than_that_of_any_peak(top_nm: float) -> None:
    """Of two lines that meet at the top, and of a cubic."""
    peaks_nm = np.arange(620.0, 661.0, 4.0)
    off_nm = peaks_nm - top_nm
    tent = 45 - np.where(off_nm < 0, 1.5, 0.2) * np.abs(off_nm)
    assert tent.max() <= _widest(peaks_nm, tent, 80.0)[1] <= 45 + 1e-9
    peak_nm, fwhm_nm = _widest(peaks_nm, 45 - 0.15 * off_nm**2 * (1 - off_nm / 500), 80.0)
    assert 44.9 <= fwhm_nm <= 45 + 1e-9
    assert peak_nm == pytest.approx(top_nm, abs=0.5)


@pytest.mark.feature("export")
def test_the_specification_has_amounts_for_every_width(folder: Path, tmp_path: Path) -> None:
    """A = e c l: 0.8 um of a dye of 80,000 l/(mol cm) have an absorbance of 6.4 per mol/l; 400 g/mol in 1,250 g/l."""
    code, _, _ = commanded(*("export", folder / "out", "--design", "best", "--specification", "--output", tmp_path))
    assert code == 0
    table = pd.read_csv(tmp_path / "best_specification.csv")
    assert table["fwhm_nm"].tolist() == [30, 44, 60]
    np.testing.assert_allclose(table["mol_per_l"], table["absorbance"] / 6.4, rtol=1e-9)
    np.testing.assert_allclose(table["percent_by_weight"], 100 * table["mol_per_l"] * 400 / 1250, rtol=1e-9)
    cells = pd.read_parquet(folder / "out" / "map.parquet")
    np.testing.assert_allclose(
        table["csd_yellow_red"], cells.groupby("fwhm_nm")["objective"].max().to_numpy(), rtol=1e-9
    )


BOX = STUDY[STUDY.index("family:") :]


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("MAP", "{peak: [1], fwhm_nm: [30]}", "did you mean 'peak_nm'"),
        ("MAP", "{peak_nm: [500, 600], fwhm_nm: [30]}", "allowed: 580 to 700"),
        ("MAP", "{peak_nm: {min: 600, max: 610, count: 300}, fwhm_nm: [30]}", "too many values"),
        ("MAP", "{peak_nm: [600]}", "map"),
        ("absorbance: [0, 3]", "absorbance: 1", "every parameter is fixed"),
        (BOX, "family: mixture, box: {absorbance_1: 1}}\nsearch: {starts: 2}\n", "every parameter is fixed"),
    ],
)
def test_a_map_or_a_box_with_nothing_to_search_is_refused(tmp_path: Path, old: str, new: str, said: str) -> None:
    (tmp_path / "band.yaml").write_text(STUDY.replace(old, new).replace("MAP", MAP))
    with pytest.raises(StudyError, match=said):
        load_study(tmp_path / "band.yaml")
