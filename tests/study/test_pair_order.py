"""Pairs of signal types have no order: neither files nor keys, nor names of goals, change a column."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sweep.study import Study

from ..build import issues, load
from ..curve_texts import WAVE, bell, csv

PEAKS_NM = {"red": 635, "yellow": 590, "green": 505}
TEXT = """\
study: own
sensor: ar0820
lights: {files: [{file: leds.csv, signals: SIGNALS}]}
cfas: [RGGB]
objective: OBJECTIVE
constraints: {CONSTRAINT: {min: 1}}
recognition: {states: [red, yellow]}
scenarios: {chart: {noise: true}}
"""


def study_of(folder: Path, kinds: list[str], objective: str, constraint: str) -> Study:
    csv(
        folder,
        "wavelength_nm," + ",".join(PEAKS_NM),
        WAVE,
        *(bell(peak, 20) for peak in PEAKS_NM.values()),
        name="leds.csv",
    )
    signals = "{" + ", ".join(f"{kind}: [{kind}]" for kind in kinds) + "}"
    text = TEXT.replace("SIGNALS", signals).replace("OBJECTIVE", objective).replace("CONSTRAINT", constraint)
    return load(folder, text)


def test_red_first_is_the_same_study(tmp_path: Path) -> None:
    plain = study_of(tmp_path, ["green", "yellow", "red"], "csd_yellow_red", "dprime_yellow_red")
    turned = study_of(tmp_path, ["red", "yellow", "green"], "csd_red_yellow", "dprime_red_yellow")
    assert list(turned.quantities) == list(plain.quantities)
    assert "csd_yellow_red" in turned.quantities
    assert turned.states == ("yellow", "red")
    assert turned.objective == plain.objective
    assert turned.constraints == plain.constraints
    np.testing.assert_array_equal(turned.lights.photons, plain.lights.photons)


@pytest.mark.parametrize("name", ["csd_red_amber", "dprime_red_blue"])
def test_names_of_no_pair_are_refused(tmp_path: Path, name: str) -> None:
    study_of(tmp_path, ["green", "yellow", "red"], "csd_yellow_red", "csd_yellow_red")
    text = TEXT.replace("SIGNALS", "{green: [green], yellow: [yellow], red: [red]}")
    (found,) = issues(tmp_path, text.replace("OBJECTIVE", name).replace("CONSTRAINT", "csd_yellow_red"))
    assert "unknown objective" in found
