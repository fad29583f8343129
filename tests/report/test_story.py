"""What reports say, against the rows on the disk: the best of all, who has more, who leads where, ranges of use."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some

from sweep.metrics.quantity import Column
from sweep.report import read_output
from sweep.report.leaders import leaders_of
from sweep.report.sections.edges import Edges
from sweep.report.sections.field import Field
from sweep.report.sections.lamps import Lamps
from sweep.report.sections.noise import Noise
from sweep.report.sections.price import Price
from sweep.report.sections.series import Series
from sweep.report.sections.tasks import Tasks
from sweep.report.sections.trade_off import TradeOff
from sweep.report.series import Numbers
from sweep.report.words import of_column

from ..build import output_of, sentences_of
from ..conftest import FinishedFolder

LONG = ("robust", "noise", "angle")
SLOW = (
    "least_loss",
    "least_loss_by_pixel",
    "chromatic",
    "dye",
    "band",
    "dual",
    "paper",
    "freeform",
    "producible",
    "rccb",
    "distance",
    "accuracy",
    "scorecard",
    "balanced",
    "measured",
)
EVERY = [
    "stopband",
    *(pytest.param(name, marks=[pytest.mark.slow, pytest.mark.long]) for name in LONG),
    *(pytest.param(name, marks=pytest.mark.slow) for name in SLOW),
]
OF_SERIES = ("noise", "distance")


def whole(folder: Path) -> pd.DataFrame:
    """The result table as it lies on the disk, rows that were computed."""
    table = pd.read_parquet(folder / "results.parquet")
    return table[table["status"] == "ok"]


@pytest.mark.parametrize("name", EVERY)
def test_the_answer_names_the_best_of_all_rows(finished: FinishedFolder, name: str) -> None:
    """And of designs that separate more than it, one that the answer or its limits name; a series has its own test."""
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
    if name in OF_SERIES:
        return
    text = " ".join(sentences_of(output))
    assert of_column(output.trade_off[0], leaders.chosen[separation]).replace("\u00a0", " ") in text
    best = rows[rows[separation] == rows[separation].max()]
    if best[separation].iloc[0] > leaders.chosen[separation]:
        names = best["name"].astype(object).where(best["name"].notna(), "ilter " + best["filter_id"].astype(str))
        assert any(name in text for name in names)


def test_the_price_is_that_of_the_rows(finished: FinishedFolder) -> None:
    folder = finished("stopband")
    table = pd.read_parquet(folder / "designs.parquet").set_index("name")
    (price,) = Price.of(read_output(folder))
    assert price.names == ("RGGB", "RYYCy", "best stopband")
    for column, values in zip(price.columns, price.values, strict=True):
        assert values == tuple(table.loc[name, column.name] for name in price.names)


def test_the_map_of_edges_has_the_most_of_all_widths(finished: FinishedFolder) -> None:
    folder = finished("stopband")
    rows = whole(folder)
    swept = rows[(rows["kind"] == "sweep") & rows["feasible"]]
    (edges,) = Edges.of(read_output(folder))
    for at, left in enumerate(edges.x):
        for row, right in enumerate(edges.y):
            there = swept[(swept["left_nm"] == left) & (swept["right_nm"] == right)]["csd_yellow_red"]
            assert edges.most[row, at] == (there.max() if len(there) else pytest.approx(np.nan, nan_ok=True))


DN = Column(name="csd_yellow_red", metric="csd", meaning="x", unit="DN", label="yellow/red CSD", direction="more", pair=("yellow", "red"))  # fmt: skip
SOME = some.lists(some.sampled_from([0.0, 0.4, 1.0, 2.0, 35.0, 35.0, 139.0, 1e5]), min_size=4, max_size=4)


def series_of(
    lines: dict[str, list[float]],
    x: tuple[float, ...],
    swaps: dict[tuple[str, str], tuple[tuple[float, float]]] | None = None,
) -> Series:
    values = {name: np.array(y, dtype=float) for name, y in lines.items()}
    numbers, light = Numbers("road", "distance_m", x), dict.fromkeys(lines, 0.5)
    return Series(DN, numbers, "", values, {}, light, next(iter(lines)), swaps=swaps or {})


@settings(deadline=None, derandomize=True)
@given(some.dictionaries(some.sampled_from(["RGGB", "RYYCy", "mine", "yours"]), SOME, min_size=1))
def test_who_leads_has_the_most_at_each_number_of_its_range(lines: dict[str, list[float]]) -> None:
    series = series_of(lines, (20.0, 100.0, 250.0, 300.0))
    leads = series.leads_of
    assert [start for _, start, _ in leads] == [0, *(stop + 1 for _, _, stop in leads[:-1])]
    assert leads[-1][2] == 3
    for leader, start, stop in leads:
        for at in range(start, stop + 1):
            most = max(y[at] for y in lines.values())
            assert most < 1 if leader is None else lines[leader][at] == most >= 1


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        (
            {"A": [90, 81, 61], "B": [80, 77, 68]},
            "most up to 240 m (90.0 DN at 100 m; B 80.0 DN); **B** from 250 m on (68.0 DN at 300 m; A 61.0 DN).",
        ),
    ],
)
def test_a_series_says_who_leads_from_where_to_where(lines: dict[str, list[float]], said: str) -> None:
    """A promise ends inside what was computed: A and B change places at 245 m."""
    *_, sentence = series_of(lines, (100.0, 200.0, 300.0), {("A", "B"): ((245.0, 71.0),)}).answer
    assert sentence.replace("\u00a0", " ").endswith(said)


@pytest.mark.slow
@pytest.mark.parametrize("name", OF_SERIES)
def test_a_series_is_of_the_rows_on_the_disk(finished: FinishedFolder, name: str) -> None:
    folder = finished(name)
    output, table = read_output(folder), whole(folder)
    for section in Series.of(output):
        assert isinstance(section, Series)
        for design, values in section.values.items():
            for number, value in zip(section.numbers.x, values, strict=True):
                scenes = [
                    s
                    for s in output.scenarios
                    if s.startswith(f"{section.numbers.base} ") and s.endswith(f"={number:.12g}")
                ]
                row = table[(table["name"] == design) & table["scenario"].isin(scenes)]
                assert row[section.column.name].tolist() == [value]


@pytest.mark.slow
@pytest.mark.long
def test_ranges_of_use_end_where_the_error_is_the_allowed_one(finished: FinishedFolder) -> None:
    folder = finished("noise")
    crossings = pd.read_parquet(folder / "crossings.parquet")
    sections = [section for section in Noise.of(read_output(folder)) if isinstance(section, Noise)]
    assert {section.numbers.base for section in sections} == {"read noise", "exposure", "distance"}
    for section in sections:
        for design, ranges in section.ranges.items():
            known = crossings[(crossings["series"] == section.numbers.base) & (crossings["name"] == design)]
            known = known[known["quantity"] == "chromatic_error"]
            ends = sorted(end for low_high in ranges for end in low_high if np.isfinite(end))
            assert ends == sorted(known["at"])
            for number, error in zip(section.numbers.x, section.errors[design], strict=True):
                inside = any(low <= number <= high for low, high in ranges)
                assert inside == (error <= section.allowed)


@pytest.mark.slow
@pytest.mark.long
def test_values_over_the_field_are_those_of_the_rows(finished: FinishedFolder) -> None:
    folder = finished("angle")
    places = pd.read_parquet(folder / "sensor_map.parquet")
    output = read_output(folder)
    (field,) = Field.of(output)
    assert isinstance(field, Field)
    names = output.named_rows.set_index("design_id")["name"]
    for name, values in field.values.items():
        own = places[places["design_id"].map(names) == name].sort_values("height")
        assert own["csd_yellow_red"].tolist() == values.tolist()
        assert field.worst[name] <= values.min() + 1e-9


@pytest.mark.slow
@pytest.mark.long
def test_a_worst_case_stands_beside_the_nominal_one(finished: FinishedFolder) -> None:
    folder = finished("robust")
    table = whole(folder).set_index("name")
    lamps = next(section for section in Lamps.of(read_output(folder)) if isinstance(section, Lamps))
    for one in lamps.designs:
        assert (one.worst, one.nominal) == tuple(table.loc[one.name, ["worst_csd_yellow_red", "csd_yellow_red"]])


@pytest.mark.slow
def test_gains_and_losses_are_those_of_the_rows(finished: FinishedFolder) -> None:
    folder = finished("scorecard")
    table = pd.read_parquet(folder / "designs.parquet").set_index("name")
    (tasks,) = Tasks.of(read_output(folder))
    assert isinstance(tasks, Tasks)
    for at, column in enumerate(tasks.columns):
        for name, factors in tasks.factors.items():
            ratio = table.loc[name, column.name] / table.loc["RGGB", column.name]
            assert factors[at] == pytest.approx(ratio if column.direction == "more" else 1 / ratio)


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


def test_the_best_of_another_cfa_is_named(tmp_path: Path) -> None:
    output = output_of(tmp_path, TWO_TILES)
    table = output.table
    made = table[(table["kind"] == "sweep") & table["feasible"]]
    most = made.loc[made.groupby("cfa", observed=True)["csd_yellow_red"].idxmax()].sort_values("csd_yellow_red")
    other, best = most.iloc[0], most.iloc[1]
    (trade_off,) = TradeOff.of(output)
    assert isinstance(trade_off, TradeOff)
    assert trade_off.best.name == f"filter {best['filter_id']}"
    (side,) = trade_off.others
    assert f"(filter {other['filter_id']})" in side.name
    assert any(side.name in line for line in trade_off.limits)
