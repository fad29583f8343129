"""Filters of one's own through the API, beside what a run and an independent sum say of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import sweep

from ..build import one_line, study_file


@pytest.fixture(scope="module")
def tiny(tmp_path_factory: pytest.TempPathFactory) -> sweep.LoadedStudy:
    return sweep.load_study(study_file(tmp_path_factory.mktemp("api")))


def test_forms_of_a_curve_are_one(tiny: sweep.LoadedStudy, tmp_path: Path) -> None:
    curve = 0.8 * tiny.curve("Y")
    path = tmp_path / "one.csv"
    curve.rename("x (QE)").to_csv(path)
    pair = (curve.index.to_numpy(), curve.to_numpy())
    tables = [tiny.evaluate(N=form) for form in (curve, pair, curve.to_numpy(), path, str(path))]
    tables.append(tiny.evaluate(N=np.full(301, 0.8), relative_to="Y"))
    for table in tables[1:]:
        pd.testing.assert_frame_equal(table, tables[0], rtol=1e-12)
    assert tables[0].attrs["units"]["csd_yellow_red"] == "DN"


@pytest.mark.parametrize(
    ("requested", "said"),
    [
        ({"Q": np.zeros(301)}, "no CFA of the study has a channel Q"),
        ({"N": np.full(301, 1.5)}, "a QE above 1"),
        ({"N": np.full(301, -0.5)}, "N: negative value at 400 nm"),
        ({"N": pd.Series([0.5, 0.5], index=[450.0, 700])}, "the curve is truncated"),
        ({"N": 0.5}, "no curve over wavelength"),
        ({"N": "nowhere.csv"}, "cannot be read"),
        ({"N": np.full(301, 0.5), "scenario": "dimm"}, "did you mean 'dim'?"),
        ({"N": np.full(301, 0.5), "cfa": "RGGB"}, "no CFA of the study with a channel N"),
        ({"cfa": "RGGBB"}, "did you mean 'RGGB'?"),
    ],
)
def test_invalid_evaluation_is_one_line(tiny: sweep.LoadedStudy, requested: dict[str, object], said: str) -> None:
    with one_line(said):
        tiny.evaluate(**requested)  # type: ignore[arg-type]


def test_a_constraint_on_a_family_quantity_is_not_feasible_for_other_filters() -> None:
    box = {"cfa": "RYNCy", "channel": "N", "base": "Y", "to": "G"}
    study = sweep.make_study(cfas=["RYYCy", "RYNCy"], boxes={"any": box}, constraints={"edge_width_nm": {"min": 5}})
    table = study.evaluate(N=study.curve("Y"))
    assert table.edge_width_nm.isna().all()
    assert not table.feasible.any()


@pytest.mark.usefixtures("plain_pictures")
def test_a_study_made_in_python_runs_and_is_read_again(tmp_path: Path) -> None:
    nm = np.arange(400.0, 701)
    sensor = sweep.sensor("ar0820", N=(nm, np.where(nm > 620, 0.6, 1.0)), relative_to="Y")
    study = sweep.make_study("mine", sensor=sensor, cfas=["RYYCy", "RYNCy"])
    run = study.run(tmp_path, jobs=1)
    requested = ["name", "csd_yellow_red", "cfa_sensitivity"]
    pd.testing.assert_frame_equal(
        run.table[requested].astype({"name": object}), study.evaluate()[requested], check_dtype=False
    )
    again = sweep.read_run(run.folder)
    pd.testing.assert_frame_equal(again.study.evaluate(), study.evaluate())
