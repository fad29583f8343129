"""What a worst case costs where nothing is off: levels of the trade-off beside random filters and their own worst cases."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from sweep.base.types import in_turn
from sweep.metrics.evaluate import designed_quantities
from sweep.metrics.members import population_imager
from sweep.metrics.smooth import smooth_csd
from sweep.report import make_report, read_output, summary_lines
from sweep.run.search import run_search
from sweep.search import price
from sweep.search.problem import Problem, SearchRun
from sweep.search.solver import search_from
from sweep.study import Study, load_study

from ..build import faults, ran
from .lamps import lights

TEXT = """\
study: price
sensor: ar0820
lights: {files: [{file: own.csv, quantity: photons, signals: {green: [g1], yellow: [y1], red: [r1, r2]}}]}
cfas: [RGGB, RYNCy]
population: {temperature_c: [-40, 105]}
boxes:
  edges:
    cfa: RYNCy
    channel: N
    base: Y
    to: G
    box: {left_nm: [580, 640], left_width_nm: 8, right_nm: [630, 690], right_width_nm: 8, depth: 1}
objective: worst_csd_yellow_red
constraints: {sensitivity: {min: 0.85}}
search: {starts: 2, max_evaluations: 120, nominal_levels: 2, front: {min: 0.85, max: 0.95, count: 2}}
validate: {leave_one_out: true}
"""


def both(study: Study, found: pd.DataFrame) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Nominal and worst case CSD and sensitivity of filters, by their curves alone."""
    space, pair = study.spaces[-1], ("yellow", "red")
    curves = space.curves(found[list(space.parameters)].to_numpy(), study.grid.size)
    view = study.view(space, "chart")
    worst = population_imager(view).worst(curves, [pair])["csd_yellow_red"]
    return smooth_csd(view, curves, pair), worst, designed_quantities(view, curves)["sensitivity"]


@pytest.mark.slow
def test_a_dry_run_knows_the_searches_of_a_price(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    lights(tmp_path, "own", 592, 632)
    (tmp_path / "price.yaml").write_text(TEXT.replace("max_evaluations: 120", "max_evaluations: 24"))
    study = load_study(tmp_path / "price.yaml")
    assert study.search is not None
    asked: list[str] = []

    def counted(problem: Problem, *how: Any) -> SearchRun:
        asked.append(problem.objective.column)
        return search_from(problem, *how)

    monkeypatch.setattr(price, "search_from", counted)
    answer = run_search(study, study.search, in_turn, lambda *_: None)
    n_front = sum(point.best is not None for point in answer.front)
    counts = asked.count("worst_csd_yellow_red"), asked.count("csd_yellow_red")
    assert counts == price.searches_of_price(2, n_front, 2)
    assert min(counts) > 0


@pytest.mark.slow
def test_the_price_of_a_worst_case(tmp_path: Path) -> None:
    lights(tmp_path, "own", 592, 632)
    (tmp_path / "price.yaml").write_text(TEXT)
    study = load_study(tmp_path / "price.yaml")
    ran(study, tmp_path / "out", 1)
    every = pd.read_parquet(tmp_path / "out" / "price.parquet")
    nominal, worst, _ = both(study, every)
    np.testing.assert_allclose(every["nominal"], nominal, rtol=1e-9)
    np.testing.assert_allclose(every["worst"], worst, rtol=1e-9)
    found, of_light = every[every["sensitivity_min"].isna()], every[every["sensitivity_min"].notna()]
    assert len(found) == 4
    assert (found["nominal"].iloc[1:3] >= found["nominal_min"].iloc[1:3] - 1e-6).all()
    assert (found["worst"].diff().iloc[1:] < 0).all()
    assert (found["nominal"].diff().iloc[1:] > 0).all()
    rng = np.random.default_rng(5)
    names, axes = study.spaces[-1].parameters, study.spaces[-1].axes
    drawn = pd.DataFrame({n: rng.uniform(min(a), max(a), 4000) for n, a in zip(names, axes, strict=True)})
    drawn = drawn[drawn["right_nm"] > drawn["left_nm"] + 10]
    nominal, worst, light = both(study, drawn)
    for row in found.to_dict("records"):
        rivals = worst[(light >= 0.85) & (nominal >= row["nominal"])]
        assert rivals.max(initial=0.0) <= row["worst"] + 0.5
    assert list(of_light["sensitivity_min"]) == [0.85, 0.85, 0.95, 0.95]
    for at, (first, last) in enumerate(
        zip(of_light.iloc[::2].itertuples(), of_light.iloc[1::2].itertuples(), strict=True)
    ):
        enough = light >= (0.85, 0.95)[at]
        assert enough.sum() > 50
        assert worst[enough].max() <= first.worst + 0.5
        assert nominal[enough].max() <= last.nominal + 0.5
        assert last.worst <= first.worst
        assert first.nominal <= last.nominal
        assert min(first.sensitivity, last.sensitivity) >= first.sensitivity_min - 1e-9
    assert (light >= 0.85).sum() > 200
    left_out = pd.read_parquet(tmp_path / "out" / "leave_one_out.parquet")
    assert list(left_out["objective"]) == ["worst_csd_yellow_red"] * 2 + ["csd_yellow_red"] * 2
    ends = {"worst_csd_yellow_red": found["worst"].iloc[0], "csd_yellow_red": found["nominal"].iloc[-1]}
    for row in left_out.to_dict("records"):
        assert row["seen"] >= ends[row["objective"]] - 1e-6  # fewer lights cannot lower the optimum
        assert row["with_it"] <= ends[row["objective"]] + 0.5
        assert row["fall"] == pytest.approx(row["seen"] - row["with_it"])
    output = read_output(tmp_path / "out")
    make_report(output)
    said = "\n".join(summary_lines(output))
    assert "The largest worst-case yellow/red CSD that the search finds falls from" in said
    for words in ("worst-case yellow/red CSD", "yellow/red CSD"):
        assert f"A light that the search of the {words} has not seen costs" in said
    assert (tmp_path / "out" / "figures" / "price-light.svg").exists()
    assert "Price of the worst case" in (tmp_path / "out" / "report.html").read_text()


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("objective: worst_csd", "objective: csd", "objective that is a single worst case (got 'csd_yellow_red')"),
        ("nominal_levels: 2", "nominal_levels: -1", "nominal_levels"),
        ("nominal_levels: 2", "nominal_level: 2", "did you mean 'nominal_levels'?"),
    ],
)
def test_wrong_levels_are_one_line(tmp_path: Path, old: str, new: str, said: str) -> None:
    lights(tmp_path, "own", 592, 632)
    found = faults(tmp_path, TEXT.replace(old, new))
    assert any(said in fault for fault in found), found
