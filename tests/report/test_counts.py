"""Filters are counted once, named alike in every table, and unknown figures are not feasible."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pyarrow.parquet as pq
import pytest

from sweep.report.page_data import payload
from sweep.report.summary import counts_line
from sweep.report.trade_off import pareto_figure, traded_cfas
from sweep.results.designs import find_design_row
from sweep.results.output import Output

from ..build import output_of, sentences_of

UNKNOWN = """\
study: unknown
sensor: ar0820
lights: tl16
cfas: [RGGB, RYNCy]
sweeps:
  nodes:
    cfa: RYNCy
    channel: N
    base: Y
    family: free_form
    options: {nodes: {start_nm: 600, stop_nm: 660, step_nm: 60}}
    grid: {transmission_600_nm: [0.5, 1], transmission_660_nm: [0.5, 1]}
constraints: {band_width_nm: {min: 10}}
"""
SCENES = """\
study: scenes
sensor: ar0820
lights: tl16
scenarios: {dim: {exposure: {kind: fixed, exposure_s: 1.0e-3}}, bright: {exposure: {kind: fixed, exposure_s: 4.0e-3}}}
cfas: [RGGB, RYNCy]
sweeps:
  edges:
    cfa: RYNCy
    channel: N
    base: Y
    to: G
    grid: {left_nm: [580, 600, 610], left_width_nm: [6, 30], right_nm: [640, 680], right_width_nm: 7}
constraints: {sensitivity: {min: 0.9}}
search: {starts: 4, max_evaluations: 400, scenario: bright}
"""


@pytest.fixture(scope="module")
def scenes(tmp_path_factory: pytest.TempPathFactory) -> Output:
    return output_of(tmp_path_factory.mktemp("scenes"), SCENES)


def test_a_design_without_a_constrained_figure_is_not_feasible_and_the_figure_is_named(tmp_path: Path) -> None:
    output = output_of(tmp_path, UNKNOWN)
    assert not output.table["feasible"].any()
    assert output.table["violation"].isna().all()
    said = sentences_of(output)
    assert said[0] == "No design meets every constraint: band width at least 10 nm."
    assert said[1] == "Designs of free_form have no band width: unknown is not feasible."
    assert ", 0 feasible (every constraint is met)" in counts_line(output)


def test_one_number_of_filters_in_terminal_picture_and_page(scenes: Output) -> None:
    designs = scenes.table[scenes.table["kind"] != "reference"]
    assert f"{12 + 1 + 1} filters (1 of them plain CFAs) in 2 scenarios (27 rows)" in counts_line(scenes)
    assert not scenes.table.loc[scenes.table["kind"] == "reference", "feasible"].any()
    setups = {(view["scenario"], view["cfa"]): view["counts"] for view in payload(scenes)["views"]}
    for scenario in scenes.scenarios:
        for cfa in traded_cfas(scenes):
            rows = designs[(designs["scenario"] == scenario) & (designs["cfa"] == cfa)]
            counts = pareto_figure(scenes, scenario, cfa).counts
            assert counts == setups[scenario, cfa]
            assert counts["feasible"] == rows["feasible"].sum()
            assert counts["infeasible"] == (~rows["feasible"]).sum()
            assert counts["front"] == (rows["feasible"] & rows["pareto"]).sum()


def test_a_filter_has_one_number_in_every_scenario_and_table(scenes: Output) -> None:
    table = pd.read_parquet(scenes.folder / "results.parquet")
    same = ["kind", "name", "space", "cfa", "left_nm", "left_width_nm", "right_nm"]
    assert table.groupby("filter_id")[same].nunique(dropna=False).eq(1).all(axis=None)
    assert table["filter_id"].nunique() == 14
    assert table.loc[table["kind"] == "search", ["filter_id", "space"]].to_numpy().tolist() == [[13, "edges"]]
    known = table.set_index("design_id")["filter_id"]
    for path in scenes.folder.glob("*.parquet"):
        rows = pd.read_parquet(path)
        if "design_id" in rows:
            rows = rows.dropna(subset=["design_id"])
            assert (rows["filter_id"].to_numpy() == known.loc[rows["design_id"]].to_numpy()).all(), path.name
    assert find_design_row(scenes, "5")["filter_id"] == 5


def test_pandas_alone_reads_units_and_meanings(scenes: Output) -> None:
    table = pd.read_parquet(scenes.folder / "results.parquet")
    assert table.attrs["units"]["csd_yellow_red"] == "DN"
    assert table.attrs["meanings"]["csd_yellow_red"] == scenes.columns["csd_yellow_red"].meaning
    field = pq.read_schema(scenes.folder / "results.parquet" / "part-00000000.parquet").field("exposure_s")
    assert field.metadata[b"unit"] == b"s"
    assert field.metadata[b"meaning"]
    assert {*table.columns} - {*table.attrs["meanings"]} == {*scenes.parameters}


def test_the_answer_names_the_best_of_every_scenario(scenes: Output) -> None:
    said = " ".join(sentences_of(scenes))
    for scenario in scenes.scenarios:
        best = scenes.best[scenes.best["scenario"] == scenario].iloc[0]
        assert f"by {best['csd_yellow_red']:.0f} DN" in said
        assert f"in {scenario}" in said.lower()
    leading = scenes.best.iloc[0]
    assert leading["scenario"] == "bright"  # the search's, though not the first one
    assert f"by {leading['csd_yellow_red']:.0f} DN" in sentences_of(scenes)[0]


def test_a_leading_scenario_without_a_feasible_design_is_reported(tmp_path: Path) -> None:
    text = SCENES.replace("{sensitivity: {min: 0.9}}", "{csd_yellow_red: {min: 100}}").split("search:")[0]
    said = sentences_of(output_of(tmp_path, text))
    assert said[0] == "In dim, no design meets every constraint."
    assert said[1].startswith("In bright, filter ")
    assert " separates most of all in dim: " in said[2]
