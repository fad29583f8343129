"""Lights that a design has not seen: beside its own, and left out of the search one by one."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from sweep.base.errors import StudyError
from sweep.report import make_report, read_output
from sweep.runs import held_out, run_study
from sweep.runs.provenance import resolved_yaml

from ..build import issues, load, ran
from ..mischief import StoppedError
from .lamps import lights

FILE = "files: [{file: FILE.csv, quantity: photons, signals: {green: [g1], yellow: [y1], red: REDS}}]"
SWEEP = """\
study: STUDY
sensor: ar0820
lights: {RATIOLIGHTS}
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


def text(study: str, file: str, ratio: str = "", reds: str = "[r1, r2]", after: str = "") -> str:
    lights = FILE.replace("FILE", file).replace("REDS", reds)
    return SWEEP.replace("STUDY", study).replace("RATIO", ratio).replace("LIGHTS", lights) + after


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    lights(tmp_path, "own", 592, 632)
    lights(tmp_path, "other", 597, 626)
    return tmp_path


@pytest.mark.slow
@pytest.mark.usefixtures("plain_pictures")
def test_a_search_without_a_light_finds_no_less(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Fewer pairs of lights cannot lower the optimum; the same design with the light is at most the study's optimum.

    A kill among them loses none.
    """
    requested = "search: {starts: 4, max_evaluations: 400}\nvalidate: {leave_one_out: true}\n"
    study = load(folder, text("one", "own", after=requested))

    def stop(phase: str, done: int, _total: int) -> None:
        if phase == "lights left out" and done == 1:
            raise StoppedError

    with pytest.raises(StoppedError):
        run_study(study, folder / "one", 1, stop)
    counted, search = [], held_out.search_from
    monkeypatch.setattr(held_out, "search_from", lambda *call: counted.append(call[0]) or search(*call))
    ran(study, folder / "one", 1)
    assert len({id(problem) for problem in counted}) == 1  # of two lights one was searched before the kill
    found = pd.read_parquet(folder / "one" / "leave_one_out.parquet")
    assert list(found["signal"]) == ["own:r1", "own:r2"]  # one yellow light alone cannot be left out
    optimum = json.loads((folder / "one" / "provenance.json").read_text())["search"]["best_smooth_objective"]
    assert (found["seen"] >= optimum - 1e-6).all()
    assert (found["with_it"] <= optimum + 1e-3).all()
    assert found["fall"].max() > 1
    np.testing.assert_allclose(found["fall"], found["seen"] - found["with_it"])
    output = read_output(folder / "one")
    make_report(output)
    assert found.loc[found["fall"].idxmax(), "signal"] in (output.folder / "report.html").read_text()


def test_another_light_changes_no_reading_of_a_resolved_study(folder: Path) -> None:
    one, both = load(folder, text("one", "own", reds="[r1]")), load(folder, text("one", "own"))
    assert one.lights.photon_ratio != both.lights.photon_ratio  # r2 is wider
    kept = resolved_yaml(one)
    indent = kept.split("- r1\n")[0].rpartition("\n")[2]
    more = load(folder, kept.replace("- r1\n", f"- r1\n{indent}- r2\n"))
    assert more.lights.names == ("own:g1", "own:y1", "own:r1", "own:r2")
    assert more.lights.photon_ratio == one.lights.photon_ratio


@pytest.mark.parametrize(
    ("after", "said"),
    [
        ("validate: {}\n", "validate.leave_one_out: missing"),
        (
            "validate: {leave_one_out: true}\n",
            "validate.leave_one_out: nothing is searched; allowed: a study with `search`",
        ),
        ("validate: {lights: tl16}\n", "validate.lights: unknown key"),
    ],
)
def test_a_wrong_validation_is_one_line(folder: Path, after: str, said: str) -> None:
    found = issues(folder, text("one", "own", after=after))
    assert any(said in issue for issue in found), found


def with_lights(stated: str) -> str:
    """The study of built-in curves with other lights."""
    return re.sub(r"^lights: .*$", f"lights: {stated}", text("one", "own"), flags=re.MULTILINE)


def test_signal_types_of_a_file_follow_from_its_colors(folder: Path) -> None:
    """The same reading as with its columns named, told to the user, and kept in the resolved study."""
    lights(folder, "third", 590, 634)
    named = load(folder, text("one", "third").replace("photons", "energy"))
    alone = load(folder, with_lights("third.csv"))
    assert any(
        "third.csv: g1, y1, r1, r2: no unit, assumed to be energy; green: g1; yellow: y1; red: r1, r2" in line
        for line in alone.warnings
    )
    assert alone.lights.names == named.lights.names
    np.testing.assert_array_equal(alone.lights.photons, named.lights.photons)
    assert load(folder, with_lights("{builtin: third.csv, name: street}")).lights.name == "street"


@pytest.mark.parametrize(
    ("file", "said"),
    [("othr.csv", "no such file (got 'othr.csv')"), ("qe.csv", "lights of one signal color or none")],
)
def test_a_file_that_is_no_lights_is_one_line(folder: Path, file: str, said: str) -> None:
    (folder / "qe.csv").write_text("nm,a,b\n400,0.1,0.2\n700,0.1,0.2\n")
    with pytest.raises(StudyError, match=re.escape(said)):
        load(folder, with_lights(file))
