"""Lights that a design has not seen: beside its own, and left out of the search one by one."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from sweep.features.held_out import tables
from sweep.runs import run_study
from sweep.runs.provenance import resolved_yaml

from ...build import issues, load, ran
from ...curve_texts import WAVE, bell, csv
from ...mischief import StoppedError

SWEEP = """\
study: one
sensor: ar0820
lights: {files: [{file: own.csv, quantity: photons, signals: {green: [g1], yellow: [y1], red: REDS}}]}
cfas: [RGGB, RYNCy]
designs:
  mine: {cfa: RYNCy, channel: N, base: Y, to: G, at: {left_nm: 606, left_width_nm: 8, right_nm: 646, right_width_nm: 7}}
sweeps:
  edges:
    cfa: RYNCy
    channel: N
    base: Y
    to: G
    grid: {left_nm: [600, 610], left_width_nm: [5, 10], right_nm: [640, 650], right_width_nm: 6}
constraints: {sensitivity: {min: 0.85}}
"""


def text(reds: str = "[r1, r2]", after: str = "") -> str:
    return SWEEP.replace("REDS", reds) + after


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    columns = (bell(505, 15), bell(592, 8), bell(632, 9), bell(640, 25))  # r2 is much wider than the others
    csv(tmp_path, "wavelength_nm,g1,y1,r1,r2", WAVE, *columns, name="own.csv")
    return tmp_path


@pytest.mark.slow
@pytest.mark.usefixtures("plain_pictures")
def test_a_search_without_a_light_finds_no_less(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Fewer pairs of lights cannot lower the optimum; the same design with the light is at most the study's optimum.

    A kill among them loses none.
    """
    requested = "search: {starts: 4, max_evaluations: 400}\nvalidate: {leave_one_out: true}\n"
    study = load(folder, text(after=requested))

    def stop(phase: str, done: int, _total: int) -> None:
        if phase == "lights left out" and done == 1:
            raise StoppedError

    with pytest.raises(StoppedError):
        run_study(study, folder / "one", 1, stop)
    counted, search = [], tables.search_from
    monkeypatch.setattr(tables, "search_from", lambda *call: counted.append(call[0]) or search(*call))
    ran(study, folder / "one", 1)
    assert len({id(problem) for problem in counted}) == 1  # of two lights one was searched before the kill
    found = pd.read_parquet(folder / "one" / "leave_one_out.parquet")
    assert list(found["signal"]) == ["own:r1", "own:r2"]  # one yellow light alone cannot be left out
    optimum = json.loads((folder / "one" / "provenance.json").read_text())["search"]["best_smooth_objective"]
    assert (found["seen"] >= optimum - 1e-6).all()
    assert (found["with_it"] <= optimum + 1e-3).all()
    assert found["fall"].max() > 1
    np.testing.assert_allclose(found["fall"], found["seen"] - found["with_it"])


def test_another_light_changes_no_reading_of_a_resolved_study(folder: Path) -> None:
    one, both = load(folder, text("[r1]")), load(folder, text())
    assert one.lights.photon_ratio != both.lights.photon_ratio  # r2 is wider
    kept = resolved_yaml(one)
    indent = kept.split("- r1\n")[0].rpartition("\n")[2]
    more = load(folder, kept.replace("- r1\n", f"- r1\n{indent}- r2\n"))
    assert more.lights.names == ("own:g1", "own:y1", "own:r1", "own:r2")
    assert more.lights.photon_ratio == one.lights.photon_ratio


@pytest.mark.parametrize(
    ("after", "said"),
    [
        (
            "validate: {leave_one_out: true}\n",
            "validate.leave_one_out: nothing is searched; allowed: a study with `search`",
        ),
        ("validate: {lights: tl16}\n", "validate.lights: unknown key"),
    ],
)
def test_a_wrong_validation_is_one_line(folder: Path, after: str, said: str) -> None:
    found = issues(folder, text(after=after))
    assert any(said in issue for issue in found), found
