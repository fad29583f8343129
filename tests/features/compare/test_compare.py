"""Finished runs side by side: what differs, whose front dominates what, who is best."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from shutil import copytree

import numpy as np
import pandas as pd
import pytest

from sweep.base.errors import OutputError, SweepError
from sweep.features.compare.compare import compare
from sweep.report.numbers import NARROW, amount
from sweep.study import load_study

from ...build import STUDY, ran
from ...conftest import without_pictures
from ...tampering import listed_anew

SWEEP = STUDY.replace("COUNT", "3").split("search:")[0]
CHART = SWEEP.replace("  dim: {exposure: {kind: fixed, exposure_s: 0.002}}\n", "")
PLAIN = CHART.split("designs:")[0].replace(", RYNCy]", "]")


@pytest.fixture
def plain_fronts(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pictures that take no time, for tests that do not look at them."""
    without_pictures(monkeypatch)


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Small finished runs, by what is special about them."""
    folder = tmp_path_factory.mktemp("runs")
    studies = {
        "tiny": STUDY.replace("COUNT", "3").replace("200}", "200, front: {min: 0.9, max: 0.98, count: 3}}"),
        "chart": CHART.replace("study: tiny", "study: chart"),
        "sparse": CHART.replace("study: tiny", "study: sparse").replace("count: 3", "count: 2"),
        "brighter": CHART.replace("study: tiny", "study: brighter").replace("white_patch}", "white_patch, level: 0.8}"),
        "plain": PLAIN.replace("study: tiny", "study: plain"),
        "orange": CHART.replace("study: tiny", "study: orange") + "objective: csd_orange_red\n",
        "deep": CHART.replace("study: tiny", "study: deep\npixel: {bits: 20}"),
        "infeasible": CHART.replace("study: tiny", "study: infeasible").replace("min: 0.9", "min: 1.9"),
        "hostile": CHART.replace("study: tiny", "study: '<script>alert(\"$x_1\")</script> 猫'").replace(
            "mine:", "'<b>&$m':"
        ),
    }
    made = {}
    for name, text in studies.items():
        (folder / f"{name}.yaml").write_text(text, encoding="utf-8")
        made[name] = folder / "out" / name
        ran(load_study(folder / f"{name}.yaml"), made[name], 1)
    return made


def compared(folders: Sequence[Path], to: Path) -> tuple[str, str]:
    """What is printed, and the page."""
    return "\n".join(compare(folders, output=to).lines), (to / "compare.html").read_text(encoding="utf-8")


@pytest.mark.usefixtures("plain_fronts")
def test_two_runs_say_who_is_best(runs: dict[str, Path], tmp_path: Path) -> None:
    said, page = compared([runs["chart"], runs["sparse"]], tmp_path / "to")
    best = {}
    for name in ("chart", "sparse"):
        frame = pd.read_parquet(runs[name] / "results.parquet")
        best[name] = frame[frame["feasible"] & (frame["kind"] == "sweep")]["csd_yellow_red"].max()
    assert best["chart"] > best["sparse"]
    shown = amount(best["chart"], "DN").replace(NARROW, " ")
    assert said.startswith(f"A chart has the most yellow/red separation, each under its own constraints: {shown}")
    table = pd.read_csv(tmp_path / "to" / "compare.csv")
    np.testing.assert_allclose(table["goal"], [best["chart"], best["sparse"]], rtol=1e-12)
    assert set(re.findall(r"https?://[\w./]+", page)) <= {"http://www.w3.org/2000/svg", "http://www.w3.org/1999/xlink"}


@pytest.mark.usefixtures("plain_fronts")
@pytest.mark.parametrize(
    ("names", "words"),
    [
        ("chart brighter", "Not ranked: scenes differ."),
        ("chart orange", "Not ranked: objectives differ."),
        ("chart deep", "Not ranked: pixels differ."),
        ("infeasible chart", "A infeasible has no design that was swept or searched and meets its constraints."),
        ("plain plain", "B plain has no design that was swept or searched"),
    ],
)
def test_only_what_is_alike_is_ranked(runs: dict[str, Path], tmp_path: Path, names: str, words: str) -> None:
    said, _ = compared([runs[name] for name in names.split()], tmp_path)
    assert words in said, said


def test_files_of_others_stay(runs: dict[str, Path], tmp_path: Path) -> None:
    (tmp_path / "compare.csv").write_bytes(b"mine")
    with pytest.raises(OutputError, match="holds something else already"):
        compare([runs["plain"], runs["plain"]], output=tmp_path)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == {"compare.csv": b"mine"}


def test_hostile_names_are_text(runs: dict[str, Path], tmp_path: Path) -> None:
    said, page = compared([runs["hostile"], runs["chart"]], tmp_path)
    assert "<script>alert" not in page
    assert "&lt;script&gt;" in page
    assert "猫" in page
    assert "A <script>" in said


@pytest.mark.usefixtures("plain_fronts")
def test_runs_with_other_curves_are_not_ranked(runs: dict[str, Path], tmp_path: Path) -> None:
    copytree(runs["chart"], tmp_path / "other")
    curves = pd.read_parquet(tmp_path / "other" / "curves.parquet")
    curves.loc[(curves["kind"] == "light").idxmax(), "value"] *= 1.1
    curves.to_parquet(tmp_path / "other" / "curves.parquet", index=False)
    listed_anew(tmp_path / "other")
    said, _ = compared([runs["chart"], tmp_path / "other"], tmp_path / "to")
    assert "Not ranked: curves of the lamps differ." in said


@pytest.mark.usefixtures("plain_fronts")
def test_invalid_comparison_is_one_line(runs: dict[str, Path], tmp_path: Path) -> None:
    for folders in ([runs["chart"]], [runs["chart"]] * 27, [runs["chart"], tmp_path]):
        with pytest.raises(SweepError) as caught:
            compare(folders, output=tmp_path / "to")
        assert len(str(caught.value).splitlines()) == 1
    assert not (tmp_path / "to").exists()
