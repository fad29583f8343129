"""The first screen says the truth: who leads, what limits it, and what holds over scenarios."""

from __future__ import annotations

import base64
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from sweep.camera.model import scene_model
from sweep.metrics.limiting import limiting_lights
from sweep.report import make_report, read_output
from sweep.report.answer import headline_numbers
from sweep.report.leaders import capital, full_name, leaders_of
from sweep.report.noise import usable_range
from sweep.report.page_data import payload
from sweep.report.series import Line, SeriesFigure, lead_sentence
from sweep.report.trade_off import overview_figure
from sweep.results.tables import REPORT
from sweep.study import load_study

from ..build import ran, sentences_of
from ..conftest import STUDIES, FinishedFolder
from .shipped import EVERY, SEARCHED


def whole(folder: Path) -> pd.DataFrame:
    """The result table as it lies on the disk, rows that were computed."""
    table = pd.read_parquet(folder / "results.parquet")
    return table[table["status"] == "ok"]


@pytest.mark.parametrize("name", EVERY)
def test_the_headline_names_the_best_of_all_rows(finished: FinishedFolder, name: str) -> None:
    folder = finished(name)
    output, table = read_output(folder), whole(folder)
    leaders, separation = leaders_of(output), output.trade_off[0].name
    rows = table[table["scenario"] == leaders.scenario]
    made = rows[rows["kind"].isin(["sweep", "search"])]
    allowed = made[made["feasible"]] if len(made) else rows[rows["feasible"]]
    assert leaders.chosen is not None
    assert leaders.chosen[output.goal.name] == allowed[output.goal.name].max()
    assert leaders.separates is not None
    assert leaders.separates[separation] == rows[separation].max()
    text = " ".join(sentences_of(output))
    if " leads" not in text:
        assert output.trade_off[0].formatted(leaders.chosen[separation]) in text


@pytest.mark.parametrize("name", EVERY)
def test_designs_beyond_the_best_one_are_named(finished: FinishedFolder, name: str) -> None:
    """Every plain CFA or named design that separates more than the best one is beaten by one that the answer names."""
    folder = finished(name)
    output, table = read_output(folder), whole(folder)
    text, leaders, separation = " ".join(sentences_of(output)), leaders_of(output), output.trade_off[0].name
    if " leads" in text:
        return  # a series has its own test
    assert leaders.chosen is not None
    rows = table[(table["scenario"] == leaders.scenario) & (table[separation] > leaders.chosen[separation])]
    if len(rows):
        best = rows[rows[separation] == rows[separation].max()]
        names = best["name"].astype(object).where(best["name"].notna(), "ilter " + best["filter_id"].astype(str))
        assert any(name in text for name in names)


def test_the_large_numbers_compare_with_the_plain_cfa_that_separates_most(finished: FinishedFolder) -> None:
    folder = finished("stopband")
    table = whole(folder)
    best = table[table["kind"] == "search"].iloc[0]
    plain = table[table["kind"] == "reference"].sort_values("csd_yellow_red").iloc[-1]
    numbers = headline_numbers(read_output(folder))
    assert [value for value, *_ in numbers[:2]] == [
        f"{best['csd_yellow_red']:.0f} DN",
        f"{best['cfa_sensitivity']:.3f}",
    ]
    for (*_, comparison), column in zip(numbers, ("csd_yellow_red", "cfa_sensitivity"), strict=False):
        assert comparison.startswith(f"{best[column] / plain[column]:.2f} times {plain['name']}")
    assert numbers[2][0] == f"{best['limit'] - best['csd_yellow_red']:.0f} DN"


def test_the_light_of_a_cfa_is_that_of_its_pixels(finished: FinishedFolder) -> None:
    study = load_study(STUDIES / "stopband.yaml")
    qe = {name: curve.sum() for name, curve in study.sensor.qe.items()}
    table = whole(finished("stopband")).set_index("name")
    for name, pixels in (("RGGB", "R G G B"), ("RYYCy", "R Y Y Cy")):
        light = np.mean([qe[pixel] for pixel in pixels.split()]) / qe["C"]
        assert table.loc[name, "cfa_sensitivity"] == pytest.approx(light, rel=1e-12)


def test_the_limiting_lights_are_as_far_apart_as_the_csd(finished: FinishedFolder) -> None:
    folder = finished("stopband")
    table, points = whole(folder).set_index("design_id"), pd.read_parquet(folder / "points.parquet")
    limited = pd.read_parquet(folder / "limited_by.parquet").set_index("design_id")
    assert set(limited.index) >= set(points["design_id"])
    for design, rows in points.groupby("design_id"):
        dn = rows.pivot_table(index="signal", columns="channel", values="dn")
        types = dict(zip(rows["signal"], rows["signal_type"], strict=True))
        for pair in ("green_yellow", "yellow_red", "orange_red"):
            first, second = limited.loc[design, f"limited_by_{pair}"].split(" / ")
            assert f"{types[first]}_{types[second]}" == pair
            apart = np.linalg.norm(dn.loc[first] - dn.loc[second])
            assert apart == pytest.approx(table.loc[design, f"csd_{pair}"], rel=1e-12)


def test_who_separates_most_names_its_lights_whatever_the_constraints(finished: FinishedFolder) -> None:
    folder = finished("stopband")
    limited, table = pd.read_parquet(folder / "limited_by.parquet").set_index("design_id"), whole(folder)
    most = table.loc[table["csd_yellow_red"].idxmax()]
    assert not most["feasible"]
    said = " ".join(sentences_of(read_output(folder)))
    lights = limited.loc[most["design_id"], "limited_by_yellow_red"]
    assert f"Filter {most['filter_id']} of RYNCy separates most of all: {most['csd_yellow_red']:.0f} DN" in said
    assert f"(limited by {lights}), but its sensitivity is below 0.9 and its slope above 0.06 per nm." in said


def test_lights_without_a_distance_limit_nothing() -> None:
    study = load_study(STUDIES / "stopband.yaml")
    space = next(space for space in study.spaces if space.filter is not None)
    setup = study.setup(space, "chart")
    nothing = np.zeros((1, 1, study.grid.size))
    response = scene_model(setup).read(nothing)[0]
    assert set(limiting_lights(setup, response)) == set(study.pairs)
    assert all(lights[0] is not None for lights in limiting_lights(setup, response).values())
    assert all(lights[0] is None for lights in limiting_lights(setup, response * np.nan).values())


def series(**lines: list[float]) -> SeriesFigure:
    x = np.array([100.0, 200.0, 300.0])
    made = {name: Line(np.array(y), None) for name, y in lines.items()}
    return SeriesFigure("t", "distance_m", "yellow/red CSD / DN", x, made, "")


@pytest.mark.parametrize(
    ("figure", "said"),
    [
        (
            series(A=[90, 81, 61], B=[80, 77, 68]),
            "Yellow/red CSD over distance: A leads up to 200 m (81 DN at 200 m, B 77 DN); "
            "B leads at 300 m (68 DN, A 61 DN).",
        ),
        (
            series(A=[90, 81, 70], B=[80, 77, 68]),
            "Yellow/red CSD over distance: A leads everywhere (70 DN at 300 m, B 68 DN).",
        ),
        (
            series(A=[0.2, 9, 8], B=[0.1, 2, 8]),
            "Yellow/red CSD over distance: no CFA reaches 1 DN at 100 m; A leads from 200 m on (8.0 DN at 300 m, B 8.0 DN).",
        ),
        (series(A=[5, 5, 5]), "Yellow/red CSD over distance: A leads everywhere (5.0 DN at 300 m)."),
    ],
)
def test_a_series_says_who_leads_from_where_to_where(figure: SeriesFigure, said: str) -> None:
    assert lead_sentence(figure) == said


@pytest.mark.slow
def test_a_study_of_plain_cfas_has_an_answer(tmp_path: Path) -> None:
    path = tmp_path / "plain.yaml"
    path.write_text("study: plain\nsensor: ar0820\nlights: tl16\ncfas: [RGGB, RCCC, RYYCy]\n")
    ran(load_study(path), tmp_path / "out", 1)
    output = read_output(tmp_path / "out")
    make_report(output)
    told = "The best CFA of this study, RGGB, separates yellow from red by 139 DN at 0.352 of a clear sensor's light: 4.48 "
    assert sentences_of(output)[0].startswith(told)
    assert (tmp_path / "out" / REPORT).is_file()
    assert (tmp_path / "out" / "cfas.png").is_file()
    assert not (tmp_path / "out" / "pareto.png").exists()


def test_where_a_line_passes_the_level_is_drawn_among_its_values() -> None:
    line = Line(np.array([1e-6, 1e-2]), None, ((8.0, 1e-3),))
    x, y = line.over(np.array([1.0, 10.0]))
    assert (x.tolist(), y.tolist()) == ([1.0, 8.0, 10.0], [1e-6, 1e-3, 1e-2])


BETTER = """\
study: better
sensor: ar0820
lights: tl16
cfas: [RGGB, RYNCy]
sweeps:
  s: {cfa: RYNCy, channel: N, base: Y, to: G, grid: {left_nm: [640, 645], left_width_nm: 20, right_nm: 660, right_width_nm: 20}}
constraints: {sensitivity: {min: 0.9}}
"""


def test_a_plain_cfa_that_is_better_is_named_first(tmp_path: Path) -> None:
    path = tmp_path / "better.yaml"
    path.write_text(BETTER)
    ran(load_study(path), tmp_path / "out", 1)
    said = sentences_of(read_output(tmp_path / "out"))
    ratio = re.search(r"([\d.]+) times the separation of RGGB", said[0])
    assert ratio is not None
    assert float(ratio[1]) < 1
    assert "RGGB separates most of all: 139 DN" in " ".join(said)


TWO_TILES = """\
study: two
sensor: ar0820
lights: tl16
cfas: [RGGB, RYNCy, RCNB]
sweeps:
  y: {cfa: RYNCy, channel: N, base: Y, to: G, grid: {left_nm: [600, 610], left_width_nm: 6, right_nm: 650, right_width_nm: 6}}
  c: {cfa: RCNB, channel: N, base: C, to: G, grid: {left_nm: [600, 610, 620], left_width_nm: 6, right_nm: [650, 655], right_width_nm: 6}}
constraints: {sensitivity: {min: 0.5}}
"""


def test_the_best_of_each_other_cfa_is_named(tmp_path: Path) -> None:
    path = tmp_path / "two.yaml"
    path.write_text(TWO_TILES)
    ran(load_study(path), tmp_path / "out", 1)
    table = whole(tmp_path / "out")
    made = table[(table["kind"] == "sweep") & table["feasible"]]
    most = made.loc[made.groupby("cfa", observed=True)["csd_yellow_red"].idxmax()].sort_values("csd_yellow_red")
    assert len(most) == 2
    other, best = most.iloc[0], most.iloc[1]
    said = sentences_of(read_output(tmp_path / "out"))
    assert re.search(
        rf"filter {best['filter_id']} of {best['cfa']} \(edges at \d+ and \d+ nm\) separates yellow from red by",
        said[0],
    )
    told = f"The best of {other['cfa']} that meets the same, filter {other['filter_id']}, separates yellow from red by "
    assert [line for line in said if line.startswith(f"{told}{other['csd_yellow_red']:.0f} DN at ")]


@pytest.mark.slow
@pytest.mark.parametrize("name", SEARCHED)
def test_headline_star_and_details_name_one_filter(finished: FinishedFolder, name: str) -> None:
    """The star is of the search's answer; the page opens with the details of the best design."""
    output = read_output(finished(name))
    best, data = leaders_of(output).chosen, payload(output)
    assert best is not None
    sentence = sentences_of(output)[0]
    assert full_name(best) in sentence or sentence.startswith(capital(full_name(best)))
    star = overview_figure(output, output.scenario).groups["best"].labels
    at = data["chosen"][output.scenario]
    design_id = np.frombuffer(base64.b64decode(data["design_id"]["bdata"]), "<u4")[at]
    assert design_id == best["design_id"]
    assert [text.rpartition(" ")[0].rpartition(" ")[0] for text in star] == [best["name"]]


@pytest.mark.parametrize(
    ("ends", "said"),
    [((69.14, 130.4), "from 69.2 to 130 cd"), ((123.6, 124.3), "near 124 cd"), ((123.2, 123.8), "near 124 cd")],
)
def test_a_range_that_three_digits_do_not_tell_apart_is_one_number(ends: tuple[float, float], said: str) -> None:
    intensities = np.array([1.0, 100.0, 1000.0])
    assert usable_range(intensities, np.zeros(3, dtype=bool), "cd", np.array(ends)) == said
