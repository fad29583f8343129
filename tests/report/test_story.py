"""The first screen says the truth: who leads, what limits it, and what holds over scenarios."""

from __future__ import annotations

import base64
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from sweep.report import read_output
from sweep.report.answer import headline_numbers
from sweep.report.leaders import capital, full_name, leaders_of
from sweep.report.noise import usable_range
from sweep.report.page_data import payload
from sweep.report.series import Line, SeriesFigure, lead_sentence
from sweep.report.trade_off import overview_figure

from ..build import output_of, sentences_of
from ..conftest import FinishedFolder
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


def test_where_a_line_passes_the_level_is_drawn_among_its_values() -> None:
    line = Line(np.array([1e-6, 1e-2]), None, ((8.0, 1e-3),))
    x, y = line.over(np.array([1.0, 10.0]))
    assert (x.tolist(), y.tolist()) == ([1.0, 8.0, 10.0], [1e-6, 1e-3, 1e-2])


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
    output = output_of(tmp_path, TWO_TILES)
    table = output.table
    made = table[(table["kind"] == "sweep") & table["feasible"]]
    most = made.loc[made.groupby("cfa", observed=True)["csd_yellow_red"].idxmax()].sort_values("csd_yellow_red")
    assert len(most) == 2
    other, best = most.iloc[0], most.iloc[1]
    said = sentences_of(output)
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
