"""Names of studies, changed keys, several studies in one call, the version, and what is told before computing."""

from __future__ import annotations

import webbrowser
from pathlib import Path

import numpy as np
import pytest
from ruamel.yaml import YAML

import sweep
from sweep.runs import run_study
from sweep.study.goals import unreachable_constraints
from sweep.study.shipped import shipped_folder

from ..build import BASE, load, one_line, stopband_study
from ..commanded import commanded
from ..conftest import STUDIES

GRID = "{left_nm: [600, 610], left_width_nm: 20, right_nm: 650, right_width_nm: 10}"


def small(folder: Path, name: str, after: str = "") -> Path:
    path = folder / f"{name}.yaml"
    path.write_text(stopband_study(name, GRID, after=after))
    return path


def test_a_name_is_a_study_of_this_folder_or_of_the_project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert shipped_folder() == STUDIES
    monkeypatch.chdir(tmp_path)
    assert "116,286 designs" in commanded("check", "stopband")[1]
    (tmp_path / "studies").mkdir()
    small(tmp_path / "studies", "stopband")
    assert ": 3 designs" in commanded("check", "stopband")[1]  # the nearer one counts
    assert "did you mean 'stopband'?" in commanded("check", "stopbnd")[2]


@pytest.mark.usefixtures("plain_pictures")
def test_several_studies_in_one_call(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[str] = []
    monkeypatch.setattr(webbrowser, "open", lambda url: bool(opened.append(url)) or True)
    paths = [
        small(tmp_path, "one"),
        small(tmp_path, "bad", "constraints: {nothing: {min: 1}}\n"),
        small(tmp_path, "two"),
    ]
    out = tmp_path / "out"
    code, _, err = commanded("run", *paths, "--output", out, "--jobs", 1, "--open", "--set", "seed=5")
    assert (code, err.count("unknown quantity (got 'nothing')")) == (2, 1)
    assert opened == [(out / name / "seed=5" / "report.html").as_uri() for name in ("one", "two")]
    resolved = YAML(typ="safe").load((out / "two" / "seed=5" / "study.resolved.yaml").read_text())
    assert resolved["seed"] == 5


AT = "left_nm: {}, left_width_nm: {}, right_nm: {}, right_width_nm: 10"
NAMED = "{left_nm: 600, left_width_nm: 10, right_nm: 650, right_width_nm: 10}"


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        ("sensitivity: {min: 0.9}", "sensitivity: {min: 90}", "allowed: 0 to 10; 90 % are 0.9"),
        ("sensitivity: {min: 0.9}", "slope_per_nm: {max: -1}", "slope_per_nm has no such values (got -1.0)"),
        ("left_width_nm: [5, 10]", "left_width_nm: [5, 10, 5]", "grid.left_width_nm: a value twice"),
        ("      right_nm: 650", "      right_nm: 580", "edges has no filter whose edges are in order"),
        (NAMED, f"{{{AT.format(660, 10, 640)}}}", "designs.mine.at: mine is inverted"),
        (NAMED, f"{{{AT.format(640, 60, 641)}}}", "designs.mine.at: mine is inverted"),  # at one end
        (
            "search:\n  space: edges",
            f"boxes: {{b: {{cfa: RYNCy, channel: N, base: Y, to: G, box: {{{AT.format([660, 680], 10, [630, 640])}}}}}}}",
            "boxes.b.box: b has no",
        ),
    ],
)
def test_check_refuses_what_cannot_be_meant(tmp_path: Path, old: str, new: str, line: str) -> None:
    assert old in BASE
    with one_line(line):
        load(tmp_path, BASE.replace(old, new))


@pytest.mark.parametrize(
    ("name", "above"), [("sensitivity", 9), ("cfa_sensitivity", 1), ("edge_width_nm", 1000), ("band_width_nm", 1000)]
)
def test_no_design_of_a_box_exceeds_its_reported_maximum(tmp_path: Path, name: str, above: float) -> None:
    """Of 2,000 designs drawn from the box, none has more than the bound; just below its best one nothing is refused."""
    study = load(tmp_path, BASE.replace("sensitivity: {min: 0.9}", f"{name}: {{min: {above}}}"))
    assert study.search is not None
    space = study.search.space
    (issue,) = unreachable_constraints(study, space, "chart")
    bound = float(str(issue).partition(" has more than ")[2].split()[0])
    rng = np.random.default_rng(1)
    low, high = (np.array([end(axis) for axis in space.axes]) for end in (min, max))
    points = low + rng.random((2000, low.size)) * (high - low)
    assert space.filter is not None
    if name.endswith("width_nm"):
        values = (points @ space.filter.family.dimensions[name].T).min(axis=1)
    else:
        values = sweep.LoadedStudy(study).evaluate(N=space.curves(points, 301)[:, 0])[name].to_numpy()
    assert values.max() <= bound
    study = load(tmp_path, BASE.replace("sensitivity: {min: 0.9}", f"{name}: {{min: {values.max()}}}"))
    assert unreachable_constraints(study, space, "chart") == []


def test_a_run_from_python_refuses_it_too(tmp_path: Path) -> None:
    study = load(tmp_path, BASE.replace("sensitivity: {min: 0.9}", "csd_yellow_red: {min: 1e6}"))
    with pytest.raises(sweep.SweepError, match="no design can be feasible"):
        run_study(study, tmp_path / "out", 1, lambda *_: None)
