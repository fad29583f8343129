"""The shipped surrogate gives the printed figures, and the script that fits it does what it says."""

from __future__ import annotations

import runpy
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from sweep.runs import run_study
from sweep.spectra.builtin.data_sets.tl16 import tl16
from sweep.spectra.builtin.surrogate import (
    FITS,
    SurrogateParameters,
    parameter_tree,
    surrogate_fit,
    surrogate_parameters,
)
from sweep.study import load_study

from ..conftest import STUDIES, without_pictures

STUDY = load_study(STUDIES / "paper.yaml")
SCRIPT = SimpleNamespace(**runpy.run_path(str(STUDIES / "notebooks" / "calibrate.py"), run_name="calibrate"))


@pytest.fixture(scope="module")
def paper(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("paper")
    run_study(STUDY, folder, 1, lambda *_: None)
    return folder


@pytest.fixture(scope="module")
def comparison(paper: Path) -> pd.DataFrame:
    """The comparison that the report of the paper's study holds, whose pictures are drawn and not encoded."""
    from sweep.report import make_report, read_output

    with pytest.MonkeyPatch.context() as patch:
        without_pictures(patch)
        make_report(read_output(paper))
    found = pd.read_parquet(paper / "paper_comparison.parquet")
    pd.testing.assert_frame_equal(found, pd.read_csv(paper / "paper_comparison.csv"), check_dtype=False)
    return found


def test_table_1_is_exact_to_the_printed_digit(comparison: pd.DataFrame) -> None:
    table = comparison[comparison["table"] == "Table 1"]
    assert list(table["ours"]) == [18, 7.3, 5.9]
    assert (table["error"] == 0).all()


def test_all_48_csds_are_within_3_percent_or_2_dn_and_the_sensitivity_near(comparison: pd.DataFrame) -> None:
    figures = comparison[comparison["quantity"].str.startswith(("csd_", "sensitivity"))]
    assert list(figures["quantity"].str.split("_").str[0].value_counts()) == [48, 1]
    for row in figures.itertuples():
        assert abs(row.ours_exact - row.paper) <= SCRIPT.allowed(row.quantity, row.paper), row


def test_the_six_pairs_of_every_cfa_rank_as_printed(comparison: pd.DataFrame) -> None:
    for name, rows in comparison[comparison["quantity"].str.startswith("csd_")].groupby("cfa"):
        ours = dict(zip(rows["quantity"], rows["ours_exact"], strict=True))
        for smaller, larger in SCRIPT.printed_order(dict(zip(rows["quantity"], rows["paper"], strict=True))):
            assert ours[smaller] < ours[larger], (name, smaller, larger)


@pytest.fixture(scope="module")
def objective() -> SimpleNamespace:
    return SCRIPT.Objective(SCRIPT.PRINTED)


@pytest.fixture(scope="module")
def shipped(objective: SimpleNamespace) -> np.ndarray:
    return np.array([SCRIPT.value_at(parameter_tree("surrogate"), free.path) for free in objective.free])


def test_shipped_parameters_are_inside_the_bounds_and_meet_all_figures(
    objective: SimpleNamespace, shipped: np.ndarray
) -> None:
    assert ((objective.low <= shipped) & (shipped <= objective.high)).all()
    assert objective.parameters(shipped).model_dump(exclude={"provenance"}) == surrogate_parameters().model_dump(
        exclude={"provenance"}
    )
    found = SCRIPT.summary(objective, shipped)
    provenance = parameter_tree("surrogate")["provenance"]
    assert found["figures met"] == provenance["figures"] == 49
    assert round(found["largest CSD error / allowed"], 3) == provenance["largest_csd_error_over_allowed"]
    assert len(objective.free) == provenance["free_parameters"]


@pytest.mark.parametrize(
    ("photon_ratio", "centers_nm"),
    [
        pytest.param(None, {}, id="those of the prior"),
        pytest.param(0.090, {"R": 584.0, "Rx": 583.0}, id="others", marks=[pytest.mark.slow, pytest.mark.long]),
    ],
)
def test_a_fit_recovers_parameters_that_it_was_given(photon_ratio: float | None, centers_nm: dict[str, float]) -> None:
    truth = parameter_tree("prior")
    truth["photon_ratio"] = photon_ratio or truth["photon_ratio"]
    for name, center_nm in centers_nm.items():
        truth["filters"][name]["edges"][0]["center_nm"] = center_nm
    targets = SCRIPT.figures(SurrogateParameters.model_validate(truth), ["RGGB", "RCCC", "RYYCy"])
    objective = SCRIPT.Objective(targets)
    x, _ = SCRIPT.fit(objective, most_evaluations=25)
    found = SCRIPT.figures(objective.parameters(x), targets)
    for row, values in targets.items():
        for quantity, value in values.items():
            assert abs(found[row][quantity] - value) <= SCRIPT.allowed(quantity, value) / 2, (row, quantity)
    assert abs(objective.parameters(x).photon_ratio - truth["photon_ratio"]) < 0.010


@pytest.mark.parametrize("number", range(1, FITS + 1))
def test_every_further_fit_meets_every_printed_figure(number: int) -> None:
    parameters = surrogate_fit(number)
    found = SCRIPT.figures(parameters, SCRIPT.PRINTED)
    figures = [(row, name, value) for row, values in SCRIPT.PRINTED.items() for name, value in values.items()]
    assert len(figures) == 49
    assert [f for f in figures if not abs(found[f[0]][f[1]] - f[2]) <= SCRIPT.allowed(*f[1:])] == []


def test_a_fit_has_its_own_sensor_lamps_and_filters() -> None:
    """Its figures hold for all of them together."""
    shipped, fit = (load_study(STUDIES / "paper.yaml", changes={"sensor": name}) for name in ("ar0820", "ar0820@3"))
    assert (fit.sensor.name, fit.lights.name) == ("ar0820@3", "tl16@3")
    assert np.abs(fit.lights.photons - shipped.lights.photons).max() > 0
    parameters = surrogate_fit(3)
    np.testing.assert_allclose(fit.lights.photons, tl16(fit.grid, parameters).photons)
    (space,) = (one for one in fit.spaces if one.name == "paper_N4")
    assert (
        dict(zip(space.parameters, space.points(0, 1)[0], strict=True))["left_nm"]
        == parameters.stopbands["paper_N4"].left_nm
    )


def test_ranking_leaves_ties_out() -> None:
    values = {"csd_green_red": 3.0, "csd_yellow_red": 1.0, "csd_orange_red": 1.0, "sensitivity": 0.9}
    assert SCRIPT.printed_order(values) == [("csd_orange_red", "csd_green_red")]
