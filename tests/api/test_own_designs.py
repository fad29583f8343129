"""Filters by the parameters of a family, and runs in the forms of other libraries."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sweep

STOPBAND = {"left_nm": 613.0, "right_nm": 651.0, "left_width_nm": 6.0, "right_width_nm": 6.0}
KEYS: dict[str, Any] = {"cfas": ["RGGB", "RYNCy"], "channel": "N", "base": "Y", "to": "G"}


@pytest.fixture(scope="module")
def study() -> sweep.LoadedStudy:
    return sweep.make_study(**KEYS)


@pytest.mark.parametrize(
    ("filters", "words"),
    [
        ({"lefts_nm": 600.0}, "unknown parameter .got 'lefts_nm'.*did you mean 'left_nm'"),
        ({"left_nm": 600.0}, "left_width_nm: missing; allowed: 0 to 500"),
        (STOPBAND | {"left_nm": 3.0}, "left_nm: out of range .got .3.0..; allowed: 200 to 2000"),
        (STOPBAND | {"left_nm": [600.0, 610.0], "right_nm": [640.0, 645.0, 650.0]}, "as many values of each"),
        (STOPBAND | {"N": np.ones(301)}, "unknown parameter .got 'N'"),
        (STOPBAND | {"cfa": "RGGB"}, "no filter of the study on RGGB has these parameters"),
    ],
)
def test_wrong_parameters_are_told(study: sweep.LoadedStudy, filters: dict[str, Any], words: str) -> None:
    with pytest.raises(sweep.SweepError, match=words):
        study.evaluate(**filters)


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"base": None}, "^base: missing; allowed: C, R"),
        ({"channel": None}, "channel: missing; allowed: R, G, B, Y, N, Cy"),
        ({"channel": "R"}, "cfa: several CFAs have the channel R; allowed: RGGB, RYNCy"),
    ],
)
def test_what_a_filter_lacks_is_told(changed: dict[str, Any], words: str) -> None:
    keys = {key: value for key, value in (KEYS | changed).items() if value is not None}
    with pytest.raises(sweep.SweepError, match=words):
        sweep.make_study(**keys)


def test_runs_convert_to_other_libraries(tmp_path: Path) -> None:
    run = sweep.make_study(
        cfas=["RGGB", "RCCB"],
        scenarios={"near": {}, "far": {"visibility_m": 100, "target": {"distance_m": 50, "fov_deg": 60}}},
    ).run(tmp_path)
    labeled = run.to_xarray()
    assert labeled.csd_yellow_red.dims == ("design", "scenario")
    assert labeled.csd_yellow_red.attrs["units"] == "DN"
    rows = run.table.set_index(["name", "scenario"])
    assert labeled.csd_yellow_red.sel(scenario="far")[1] == rows.csd_yellow_red["RCCB", "far"]
