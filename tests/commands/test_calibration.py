"""The shipped surrogate: what the calibration promises holds, and a fit recovers what it was given."""

from __future__ import annotations

import copy
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from sweep.commands.calibrate.fit import Task, fit_from, printed_order
from sweep.commands.calibrate.model import color_violations, crossed_edges, figures
from sweep.commands.calibrate.output import allowed_dn
from sweep.commands.calibrate.parameters import checked, free_parameters, with_values
from sweep.curves.builtin.surrogate import parameter_tree, surrogate_parameters
from sweep.run import run_study
from sweep.study import Study, load_study

from ..conftest import STUDIES

STUDY = load_study(STUDIES / "paper.yaml")
PRINTED = {row: values for table in ("Table 2", "Table 3") for row, values in STUDY.section.published[table].items()}


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
        patch.setattr("sweep.report.figures.rendered", lambda _, kind: kind.encode())
        make_report(read_output(paper))
    found = pd.read_parquet(paper / "paper_comparison.parquet")
    pd.testing.assert_frame_equal(found, pd.read_csv(paper / "paper_comparison.csv"), check_dtype=False)
    assert {path.name for path in (paper / "figures").glob("*.png")} == {
        *(
            "sensor.png",
            "signals.png",
            "chart.png",
            "tiles.png",
            "filters-1.png",
            "clouds-cfas.png",
            "clouds-designs.png",
        )
    }
    return found


def test_table_1_is_exact_to_the_printed_digit(comparison: pd.DataFrame) -> None:
    table = comparison[comparison["table"] == "Table 1"]
    assert list(table["ours"]) == [18, 7.3, 5.9]
    assert (table["error"] == 0).all()


def test_all_48_csds_are_within_3_percent_or_2_dn(comparison: pd.DataFrame) -> None:
    csds = comparison[comparison["quantity"].str.startswith("csd_")]
    assert len(csds) == 48
    assert list(csds["paper"].groupby(csds["table"]).count()) == [24, 24]
    for row in csds.itertuples():
        assert abs(row.ours_exact - row.paper) <= allowed_dn(row.paper), row


def test_sensitivity_of_n4(comparison: pd.DataFrame) -> None:
    row = comparison[comparison["quantity"] == "sensitivity"].iloc[0]
    assert (row["cfa"], row["paper"]) == ("RYN_4Cy", 0.902)
    assert abs(row["ours_exact"] - 0.902) <= 0.002


def test_the_six_pairs_of_every_cfa_rank_as_printed(comparison: pd.DataFrame) -> None:
    for name, rows in comparison[comparison["quantity"].str.startswith("csd_")].groupby("cfa"):
        ours = dict(zip(rows["quantity"], rows["ours_exact"], strict=True))
        for smaller, larger in printed_order(dict(zip(rows["quantity"], rows["paper"], strict=True))):
            assert ours[smaller] < ours[larger], (name, smaller, larger)


def test_the_four_filters_are_different_and_well_formed() -> None:
    parameters = surrogate_parameters()
    ends = [stopband.right_nm for stopband in parameters.stopbands.values()]
    assert min(abs(a - b) for i, a in enumerate(ends) for b in ends[i + 1 :]) > 3
    assert (crossed_edges(parameters) <= 0).all()
    assert (color_violations(parameters) <= 0).all()


def test_shipped_parameters_stay_inside_the_bounds_of_the_calibration() -> None:
    shipped = parameter_tree("surrogate")
    every = [f"{name}.{edge}" for name, values in shipped["stopbands"].items() for edge in values]
    for free in free_parameters(parameter_tree("prior"), every):
        value = shipped
        for key in free.path:
            value = value[key]
        assert free.low <= value <= free.high, free.name


def test_figures_are_what_the_evaluation_gives(paper: Path) -> None:
    frame = pd.read_parquet(paper / "results.parquet").set_index("name")
    for row, values in figures(surrogate_parameters(), list(PRINTED)).items():
        for quantity, value in values.items():
            limit = 1e-12 if quantity == "sensitivity" else np.sqrt(4)  # quantization: the square root of m_p
            assert abs(frame.loc[row, quantity] - value) <= limit


@pytest.mark.parametrize(
    ("photon_ratio", "centers_nm"),
    [
        pytest.param(None, {}, id="those of the prior"),
        pytest.param(0.090, {"R": 584.0, "Rx": 583.0}, id="others", marks=[pytest.mark.slow, pytest.mark.long]),
    ],
)
def test_a_fit_recovers_parameters_that_it_was_given(photon_ratio: float | None, centers_nm: dict[str, float]) -> None:
    prior = parameter_tree("prior")
    truth = copy.deepcopy(prior)
    truth["photon_ratio"] = photon_ratio or prior["photon_ratio"]
    for name, center_nm in centers_nm.items():
        truth["filters"][name]["edges"][0]["center_nm"] = center_nm
    targets = figures(checked(truth), ["RGGB", "RCCC", "RYYCy"])
    fit = fit_from(Task(prior, targets, ()), seed=1, start=0, most_evaluations=25)
    found = figures(fit.parameters, list(targets))
    for row, values in targets.items():
        for quantity, value in values.items():
            assert abs(found[row][quantity] - value) <= allowed_dn(value) / 2, (row, quantity)
    assert abs(fit.tree["photon_ratio"] - truth["photon_ratio"]) < 0.010
    assert fit.certainty["photon_ratio"] < 1


def test_free_parameters_round_trip() -> None:
    prior = parameter_tree("prior")
    free = free_parameters(prior, ["RYN_1Cy.left_nm"])
    names = [f.name for f in free]
    assert len(set(names)) == len(names)
    assert "stopbands.RYN_1Cy.left_nm" in names
    assert "stopbands.RYN_4Cy.left_nm" not in names
    assert all(f.low < f.mean < f.high or f.mean in (f.low, f.high) for f in free)
    same = with_values(prior, free, np.array([f.mean for f in free]), {})
    assert checked(same) == surrogate_parameters("prior")
    tied = {("stopbands", "RYN_2Cy", "left_nm"): ("stopbands", "RYN_1Cy", "left_nm")}
    shifted = with_values(prior, free, np.array([f.mean + 0.01 for f in free]), tied)
    assert shifted["stopbands"]["RYN_2Cy"]["left_nm"] == pytest.approx(600.01)
    assert shifted["stopbands"]["RYN_3Cy"]["left_nm"] == 600
    assert prior == parameter_tree("prior")


def test_ranking_leaves_ties_out() -> None:
    assert printed_order({"csd_green_red": 3.0, "csd_yellow_red": 1.0, "csd_orange_red": 1.0, "sensitivity": 0.9}) == [
        ("csd_orange_red", "csd_green_red")
    ]


def test_published_names_are_checked(tmp_path: Path) -> None:
    from sweep.base.errors import StudyError

    def loaded(old: str, new: str) -> Study:
        path = tmp_path / "paper.yaml"
        text = (STUDIES / "paper.yaml").read_text()
        assert old in text
        path.write_text(text.replace(old, new, 1))
        return load_study(path)

    for old, new, word in (
        ("    RGGB: {csd", "    RGBG: {csd", "did you mean 'RGGB'"),
        ("RGGB: {csd_green_yellow", "RGGB: {csd_green_yelow", "did you mean 'csd_green_yellow'"),
        ("urban: {object_resolution_px", "urban: {sensitivity", "allowed: object_resolution_px"),
        ("at: RYN_2Cy", "at: RYN_5Cy", "unknown built-in filter"),
    ):
        with pytest.raises(StudyError, match=word):
            loaded(old, new)
