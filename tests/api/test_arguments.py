"""Arguments from Python: copied when they come in, and refused in a line where they are none."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd
import pytest

import sweep

UNCHECKED = pytest.mark.slow
"""Arguments of a wrong type: quick tests check the types of the package themselves."""
NM = np.arange(400, 701)
HALF = np.full(NM.size, 0.5)
ITSELF: dict[str, Any] = {}
ITSELF["pixel"] = ITSELF


def study() -> Any:
    return sweep.make_study(
        cfas=["RGGB", "RYNCy"], boxes={"edges": {"cfa": "RYNCy", "channel": "N", "base": "Y", "to": "G"}}
    )


def table(*names: object) -> pd.DataFrame:
    return pd.DataFrame(np.tile(HALF[:, None], len(names)), index=NM, columns=[*names])


def test_an_array_that_changes_afterwards_changes_nothing() -> None:
    buffer, sensors = np.empty(NM.size), []
    for middle in (600, 630, 660):
        buffer[:] = np.where(abs(NM - middle) < 15, 0.2, 0.6)
        sensors.append(sweep.sensor("ar0820", N=(NM, buffer)))
    values = [
        float(sweep.make_study(sensor=one, cfas=["RYNCy"]).evaluate()["csd_yellow_red"].iloc[0]) for one in sensors
    ]
    assert len({round(value, 6) for value in values}) == 3


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: study().evaluate(left_nm=[], right_nm=[], left_width_nm=6, right_width_nm=6), "out of range"),
        (lambda: study().evaluate(left_nm=10**400, right_nm=650, left_width_nm=6, right_width_nm=6), "not a number"),
        (lambda: study().upper_bound(sensitivity=float("nan")), "sensitivity: no share"),
        pytest.param(*(lambda: study().upper_bound(sensitivity="0.9"), "sensitivity: no share"), marks=UNCHECKED),
        (lambda: study().upper_bound(sensitivity=5), "sensitivity: no share"),
        pytest.param(*(lambda: study().plan("x"), "tolerance_dn: no tolerance"), marks=UNCHECKED),
        (lambda: study().run("unused", jobs=0), "jobs: no number of workers"),
        (lambda: sweep.make_study(cfas=["RGGB"], **ITSELF), "holds itself"),
        (lambda: sweep.Pixel(bits=10.5), "bits: "),  # type: ignore[arg-type]
        (lambda: sweep.sensor("ar0820", N=(NM, HALF * 1j)), "real numbers"),
        (lambda: sweep.sensor("ar0820", N=(NM, np.ma.masked_greater(NM / 700, 0.9))), "none of them masked"),
        (lambda: sweep.sensor(table("R", "R")), "R: column occurs twice"),
        (lambda: sweep.lights(table(1, "1"), types={"red": ["1"]}), "1: column occurs twice"),
        pytest.param(
            lambda: sweep.lights(table("a", "b"), types={"red": "ab"}),  # type: ignore[dict-item]
            "types.red: ",
            marks=UNCHECKED,
        ),
        (lambda: sweep.lights("tl16", types={"red": ["a"]}), "types: built-in lights"),
        (lambda: sweep.lights("tl16", quantity="photons"), "quantity: built-in lights"),
    ],
)
def test_a_wrong_argument_is_one_line(call: Callable[[], object], said: str) -> None:
    with pytest.raises(sweep.SweepError, match=re.escape(said)) as caught:
        call()
    assert len(caught.value.issues) == 1
