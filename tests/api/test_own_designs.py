"""Filters by the parameters of a family."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import sweep

STOPBAND = {"left_nm": 613.0, "right_nm": 651.0, "left_width_nm": 6.0, "right_width_nm": 6.0}
EDGES = {"cfa": "RYNCy", "channel": "N", "base": "Y", "to": "G"}


@pytest.fixture(scope="module")
def study() -> sweep.LoadedStudy:
    return sweep.make_study(cfas=["RGGB", "RYNCy"], boxes={"edges": EDGES})


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
