"""What a report says and counts, without a picture."""

from __future__ import annotations

from io import StringIO
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from sweep.base.errors import OutputError
from sweep.metrics.pareto import knee
from sweep.report import make_report, read_output, summary_lines
from sweep.report.panels import Lines, Points, figure_of, svg
from sweep.report.run import Run
from sweep.report.sections import clouds
from sweep.report.tables import Axis
from sweep.results.dictionary import KEYS

from ..build import STUDY, output_of
from ..conftest import FinishedFolder
from ..tampering import listed_anew


def test_the_knee_is_farthest_from_the_line_between_the_ends() -> None:
    # The line from (0, 10) to (2, 0); of the others (1, 9) is the farthest beyond it in the front's own units.
    front = np.array([[0.0, 10.0], [0.5, 9.5], [1.0, 9.0], [1.8, 2.0], [2.0, 0.0]])
    assert knee(front) == 2
    assert knee(front * [1000, 1e-3] + [5, -7]) == 2  # the units do not matter
    assert knee(front[:2]) is None
    for inward in (1.0, 0.6, np.nan):  # a straight front has none, nor has one that bends inward
        assert knee(np.array([[0.0, 2.0], [1.0, inward], [2.0, 0.0]])) is None


def test_clouds_are_the_digital_numbers_of_all_lamps(finished: FinishedFolder) -> None:
    run = Run(read_output(finished("stopband")))
    (section,) = clouds(run)
    panels = [panel for panel in section.panels if isinstance(panel, Points)]
    channels = [("RGGB", "R", "G"), ("RYYCy", "R", "Y"), ("best stopband", "R", "N")]
    for panel, (name, *pair) in zip(panels, channels, strict=True):
        points = run.output.tables["points.parquet"][
            run.output.tables["points.parquet"]["design_id"] == run.here[name]["design_id"]
        ]
        read = points.set_index(["signal_type", "channel"])["dn"]
        for kind, values in panel.groups.items():
            for channel, of in zip(pair, values, strict=True):
                assert sorted(of) == sorted(read.loc[(kind, channel)])


def test_every_column_of_the_rows_has_its_meaning(finished: FinishedFolder) -> None:
    rows = pd.read_parquet(finished("stopband") / "results.parquet")
    assert {*rows.columns} <= rows.attrs["meanings"].keys() | {"simulation_key"} | {*KEYS}


def test_no_design_dominates_one_of_the_front(finished: FinishedFolder) -> None:
    output = read_output(finished("stopband"))
    first, second = (column.name for column in output.trade_off[:2])
    made = output.table[output.table["feasible"]]
    front = pd.read_parquet(finished("stopband") / "pareto.parquet")
    for a, b in zip(front[first], front[second], strict=True):
        assert not ((made[first] > a) & (made[second] > b)).any()


def test_a_dollar_in_a_name_is_no_formula() -> None:
    x = np.linspace(400, 700, 4)
    for name in (r"$\nonsense{", "a$b$c"):
        assert f">{name}<" in svg(
            Lines(name, Axis("x", "", 400, 700), Axis("", "", 400, 700), lines={name: (x, x)}), "p"
        )


LONG = "a_name_of_" + 11 * "letters_ab"
ONE, TWO = Axis("x", "", 0, 3), np.array([1.0, 2.0])
NAMED = [
    Lines("title", ONE, ONE, lines={LONG: (TWO, TWO), "short": (TWO, TWO / 2)}),
    Points("title", ONE, ONE, points={LONG: (1.0, 2.0), "short": (2.0, 1.0)}),
    Points("title", ONE, ONE, groups={LONG: (TWO, TWO)}),
]


@pytest.mark.parametrize("panel", NAMED)
def test_the_longest_names_leave_room_for_the_axes(panel: Lines | Points) -> None:
    (axes,) = figure_of(panel).axes
    assert axes.get_position().width > 0.45


def test_a_csv_has_every_digit_whatever_numpy_prints() -> None:
    from sweep.results.tables import csv_of

    value = 37.322915213043046
    with np.printoptions(legacy="1.13"):
        text = csv_of(pd.DataFrame({"a": [value], "b": ["x,y"]}))
    found = pd.read_csv(StringIO(text), float_precision="round_trip")
    assert found.iloc[0].tolist() == [value, "x,y"]


@pytest.mark.usefixtures("plain_pictures")
def test_a_study_whose_designs_all_failed_says_why(tmp_path: Path) -> None:
    output_of(tmp_path, STUDY.replace("COUNT", "2").split("search:")[0])
    folder = tmp_path / "out"
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
    pq.write_table(schema.empty_table().drop_columns(["feasible"]), folder / "pareto.parquet")
    listed_anew(folder)
    with pytest.raises(OutputError, match="lacks feasible"):
        read_output(folder)


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
