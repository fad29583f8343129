"""What a report says and counts, without a picture."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from shutil import copytree

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from sweep.base.errors import OutputError
from sweep.metrics.pareto import knee
from sweep.report import make_report, read_output, summary_lines
from sweep.report.explorer import explorer_data
from sweep.report.sections.clouds import Clouds
from sweep.report.sections.method import Method
from sweep.results.dictionary import KEYS
from sweep.results.facts import CheckFacts
from sweep.study import load_study

from ..build import output_of, ran, study_file
from ..conftest import FinishedFolder
from ..tampering import listed_anew


def test_the_knee_is_farthest_from_the_line_between_the_ends() -> None:
    # The line from (0, 10) to (2, 0); of the others (1, 9) is the farthest beyond it in the front's own units.
    front = np.array([[0.0, 10.0], [0.5, 9.5], [1.0, 9.0], [1.8, 2.0], [2.0, 0.0]])
    assert knee(front) == 2
    assert knee(front * [1000, 1e-3] + [5, -7]) == 2  # the units do not matter
    assert knee(front[:2]) is None
    assert knee(np.array([[0.0, 2.0], [1.0, 1.0], [2.0, 0.0]])) is None  # a straight front has none
    assert knee(np.array([[0.0, 2.0], [0.5, 0.6], [2.0, 0.0]])) is None  # nor has one that bends inward
    assert knee(np.full((3, 2), 1.0)) is None
    assert knee(np.array([[0.0, 2.0], [np.nan, 1.0], [2.0, 0.0]])) is None


def test_the_method_states_the_largest_difference_of_the_check(finished: FinishedFolder) -> None:
    output = read_output(finished("stopband"))
    kept = output.provenance.plans["chart"]
    (method,) = Method.of(output)
    assert any(
        line.startswith("Left out: ") and "effects that no scene has; 0 of 0.1 DN at risk" in line
        for line in method.limits
    )
    where = {"rows": 3, "design_id": 7, "scenario": "far", "quantity": "csd_yellow_red"}
    check = CheckFacts(**where, largest_dn=0.3, allowed_dn=0.1, slower=4.19)
    plans = {"near": kept, "far": kept.model_copy(update={"error_bound_dn": 0.04})}
    facts = output.provenance.model_copy(update={"plans": plans, "check": check})
    (method,) = Method.of(replace(output, provenance=facts))
    assert any("at most 0.04 of 0.1 DN" in line for line in method.limits)
    said = "Checked: 3 rows at reference settings (4.2 times as long) differ by at most 0.300 DN; 0.1 DN is allowed."
    assert said in method.limits
    assert not check.passed


def test_clouds_are_the_digital_numbers_of_all_lamps(finished: FinishedFolder) -> None:
    output = read_output(finished("stopband"))
    (clouds,) = Clouds.of(output)
    assert isinstance(clouds, Clouds)
    assert list(clouds.axes.items()) == [("RGGB", ("R", "G")), ("RYYCy", ("R", "Y")), ("best stopband", ("R", "N"))]
    assert {kind: len(colors) for kind, colors in clouds.colors.items()} == {
        "green": 16,
        "yellow": 16,
        "orange": 3,
        "red": 16,
    }
    for name, (x, y) in clouds.axes.items():
        (row,) = output.named_rows[output.named_rows["name"] == name]["design_id"]
        points = output.points[output.points["design_id"] == row].set_index(["signal_type", "channel"])["dn"]
        for kind, pair in clouds.clouds[name].items():
            for channel, values in zip((x, y), pair, strict=True):
                assert sorted(values) == sorted(points.loc[(kind, channel)])


def test_every_column_of_the_rows_has_its_meaning(finished: FinishedFolder) -> None:
    rows = pd.read_parquet(finished("stopband") / "results.parquet")
    assert {*rows.columns} <= rows.attrs["meanings"].keys() | {"simulation_key"} | {*KEYS}
    assert rows.attrs["units"] | {"left_nm": "nm", "depth": "", "upper_bound": "DN"} == rows.attrs["units"]
    assert "left edge" in rows.attrs["meanings"]["left_nm"]
    assert "pareto" not in rows
    assert pd.read_parquet(finished("stopband") / "pareto.parquet")["pareto"].all()


def test_a_dollar_in_a_name_is_no_formula() -> None:
    from sweep.report.panels import Line, Lines, Picture

    x = np.linspace(400, 700, 4)
    for name in (r"$\nonsense{", "a$b$c"):
        wide, narrow = Picture((Lines(name, "x", {name: Line(x, x)}),), name).svgs("p")
        assert wide.startswith("<svg")
        assert f">{name}<" in wide
        assert "<svg" in narrow


def test_a_csv_has_every_digit_whatever_numpy_prints(tmp_path: Path) -> None:
    from sweep.results.tables import write_csv

    value = 37.322915213043046
    with np.printoptions(legacy="1.13"):
        write_csv(pd.DataFrame({"a": [value, np.nan], "b": ["x,y", None]}), tmp_path / "t.csv")
    found = pd.read_csv(tmp_path / "t.csv", float_precision="round_trip")
    assert found["a"][0] == value
    assert np.isnan(found["a"][1])
    assert found["b"][0] == "x,y"


@pytest.fixture(scope="module")
def tiny(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("tiny")
    ran(load_study(study_file(folder, 2)), folder / "out", 1)
    return folder / "out"


@pytest.mark.parametrize(("name", "column"), [("designs.parquet", "feasible"), ("pareto.parquet", "csd_yellow_red")])
def test_a_table_that_lacks_a_column_is_one_line(tiny: Path, tmp_path: Path, name: str, column: str) -> None:
    folder = tmp_path / "out"
    copytree(tiny, folder)
    path = folder / name
    pq.write_table(pq.read_table(path).drop_columns([column]), path)
    listed_anew(folder)
    with pytest.raises(OutputError, match=f"{name}: lacks {column}; delete it"):
        read_output(folder)


@pytest.mark.usefixtures("plain_pictures")
def test_a_study_whose_designs_all_failed_says_why(tmp_path: Path) -> None:
    folder = tmp_path / "out"
    path = study_file(tmp_path, 2)
    path.write_text(path.read_text().split("search:")[0])
    ran(load_study(path), folder, 1)
    frame = pd.read_parquet(folder / "designs.parquet")
    swept = frame["kind"] == "sweep"
    frame["status"] = frame["status"].astype(object)
    frame.loc[swept, "status"] = "error: no light"
    frame.loc[swept, ["feasible", "pareto"]] = False
    schema = pq.read_schema(folder / "designs.parquet")
    pq.write_table(pa.Table.from_pandas(frame, schema=schema, preserve_index=False), folder / "designs.parquet")
    pq.write_table(schema.empty_table(), folder / "pareto.parquet")
    listed_anew(folder)
    output = read_output(folder)
    make_report(output)
    assert summary_lines(output)[0] == "Every design failed: error: no light."
    assert explorer_data(output) is None or all(one["kind"] != "sweep" for one in explorer_data(output)["designs"])  # type: ignore[index]


@pytest.mark.usefixtures("plain_pictures")
def test_a_single_design_has_a_report(tmp_path: Path) -> None:
    grid = "{left_nm: 610, left_width_nm: 5, right_nm: 650, right_width_nm: 5}"
    text = (
        "study: single\nsensor: ar0820\nlights: tl16\ncfas: [RYNCy]\n"
        f"sweeps: {{s: {{cfa: RYNCy, channel: N, base: Y, to: G, grid: {grid}}}}}\n"
    )
    output = output_of(tmp_path, text)
    make_report(output)
    assert len(output.best) == 1
