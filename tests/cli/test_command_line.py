"""Names of studies, changed keys, several studies in one call, the version, and what is told before computing."""

from __future__ import annotations

import webbrowser
from pathlib import Path

import numpy as np
import pytest
from ruamel.yaml import YAML

import sweep
from sweep.runs import run_study
from sweep.study import load_study
from sweep.study.goals import unreachable_constraints
from sweep.study.shipped import shipped_folder

from ..build import BASE, load, stopband_study
from ..commanded import commanded
from ..conftest import STUDIES

GRID = "{left_nm: [600, 610], left_width_nm: 20, right_nm: 650, right_width_nm: 10}"


def small(folder: Path, name: str, after: str = "") -> Path:
    path = folder / f"{name}.yaml"
    path.write_text(stopband_study(name, GRID, after=after))
    return path


def test_the_version() -> None:
    assert commanded("--version") == (0, f"sweep {sweep.__version__}\n", "")


def test_a_name_is_a_study_of_this_folder_or_of_the_project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert shipped_folder() == STUDIES
    monkeypatch.chdir(tmp_path)
    assert "116,286 designs" in commanded("check", "stopband")[1]
    (tmp_path / "studies").mkdir()
    small(tmp_path / "studies", "stopband")
    assert ": 3 designs" in commanded("check", "stopband")[1]  # the nearer one counts
    code, _, err = commanded("check", "stopbnd")
    assert code == 2
    assert "did you mean 'stopband'?" in err
    code, _, err = commanded("check", "stopbnd.yaml")
    assert (code, "cannot be read" in err) == (2, True)


def test_the_measured_study_finds_its_curves_from_anywhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    code, said, err = commanded("check", "measured")
    assert (code, "232,565 designs" in said) == (0, True), err


def test_a_changed_key_is_checked_like_the_file_and_kept(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    path.write_text(BASE)
    changed = load_study(
        path, changes={"constraints.sensitivity.min": "0.92", "sweeps.edges.grid.right_nm": "[640, 650]"}
    )
    assert changed.constraints["sensitivity"].min == 0.92
    assert changed.n_designs == load_study(path).n_designs + 12
    for text, said in (
        (
            "constraints.sensitivity.min=x",
            "sweep: --set constraints.sensitivity.min=x: constraints.sensitivity.min: not allowed (got 'x')",
        ),
        ("constraints.sensitivty.min=0.9", "did you mean 'sensitivity'?"),
        ("study.name=x", "--set study.name=x: `study` is no mapping"),
        ("cfas.7=RGGB", "no such entry of the list (got '7')"),
        ("seed", "not KEY=VALUE (got 'seed')"),
        ("seed=[", "--set seed=[: not valid YAML"),
    ):
        code, out, err = commanded("check", path, "--set", text)
        assert (code, out, len(err.splitlines())) == (2, "", 1)
        assert said in err


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
    code, said, err = commanded("run", *paths, "--output", out, "--jobs", 1, "--open", "--set", "seed=5")
    assert code == 2
    assert err.count("unknown quantity (got 'nothing')") == 1
    assert [line for line in said.splitlines() if line.startswith("==")] == [f"== {path} ==" for path in paths]
    assert opened == [(out / name / "seed=5" / "report.html").as_uri() for name in ("one", "two")]
    resolved = YAML(typ="safe").load((out / "two" / "seed=5" / "study.resolved.yaml").read_text())
    assert resolved["seed"] == 5


def test_percentages_and_unreachable_constraints_are_reported(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    path.write_text(BASE.replace("sensitivity: {min: 0.9}", "sensitivity: {min: 90}"))
    for command in ("check", path), ("run", path, "--output", tmp_path / "out"):
        code, _, err = commanded(*command)
        assert (code, err.count("\n")) == (2, 1)
        assert (
            "constraints.sensitivity.min: sensitivity has no such values (got 90.0); allowed: 0 to 10; 90 % are 0.9"
            in err
        )
    path.write_text(BASE.replace("sensitivity: {min: 0.9}", "sensitivity: {min: 5}"))
    for command in ("check", path), ("run", path, "--output", tmp_path / "out"):
        code, _, err = commanded(*command)
        assert code == 3
        assert "out of reach: sensitivity >= 5" in err
    assert not (tmp_path / "out").exists()


def assert_refused(folder: Path, text: str, line: str) -> None:
    path = folder / "a.yaml"
    path.write_text(text)
    code, _, err = commanded("check", path)
    assert (code, err.count("\n"), line in err) == (2, 1, True), err


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        ("sensitivity: {min: 0.9}", "slope_per_nm: {max: -1}", "slope_per_nm has no such values (got -1.0)"),
        (
            "sensitivity: {min: 0.9}",
            "min_transmission: {min: 1.5}",
            "min_transmission has no such values (got 1.5); allowed: 0 to 1",
        ),
        ("left_width_nm: [5, 10]", "left_width_nm: [5, 10, 5]", "grid.left_width_nm: a value twice"),
        (
            "      right_nm: 650",
            "      right_nm: 580",
            "edges has no filter whose edges are in order: one edge lies ",
        ),
    ],
)
def test_check_refuses_what_cannot_be_meant(tmp_path: Path, old: str, new: str, line: str) -> None:
    assert old in BASE
    assert_refused(tmp_path, BASE.replace(old, new), line)


def test_check_refuses_inverted_designs_and_boxes(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    start = "study: a\nsensor: ar0820\nlights: tl16\ncfas: [RGGB, RYNCy]\n"
    of = "cfa: RYNCy, channel: N, base: Y, to: G"
    band = "left_nm: {}, left_width_nm: {}, right_nm: {}, right_width_nm: 10"
    for text, line in (
        (f"designs: {{d: {{{of}, at: {{{band.format(660, 10, 640)}}}}}}}", "designs.d.at: d is inverted"),
        (f"designs: {{d: {{{of}, at: {{{band.format(640, 60, 641)}}}}}}}", "designs.d.at: d is inverted"),  # at one end
        (
            f"boxes: {{b: {{{of}, box: {{{band.format([660, 680], 10, [630, 640])}}}}}}}\nsearch: {{space: b}}",
            "boxes.b.box: b has no",
        ),
    ):
        assert_refused(tmp_path, f"{start}{text}\n", line)
    path.write_text(f"{start}designs: {{d: {{{of}, at: {{{band.format(630, 10, 640)}}}}}}}\n")
    assert commanded("check", path)[0] == 0


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
