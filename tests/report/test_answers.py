"""What pages say, against the rows on the disk: the best of all, figures, ranges of use, tables beside rows."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from sweep.report import read_output
from sweep.report.answers import answer_of
from sweep.report.page import report_of
from sweep.report.panels import Map
from sweep.report.run import Run
from sweep.report.sections import exactness

from ..conftest import FinishedFolder

SLOW = ("paper", "distance", "scorecard", "band", "dye", "robust", "noise", "angle")
EVERY = ["stopband", *(pytest.param(name, marks=pytest.mark.slow) for name in SLOW)]
KINDS = {"stopband": "trade_off", "paper": "trade_off", "distance": "series", "scorecard": "score", "band": "trade_off",
         "dye": "series", "robust": "worst", "noise": "errors_over", "angle": "series"}  # fmt: skip


def whole(folder: Path) -> pd.DataFrame:
    """The result table as it lies on the disk, rows that were computed."""
    table = pd.read_parquet(folder / "results.parquet")
    return table[table["status"] == "ok"]


@pytest.mark.parametrize("name", EVERY)
def test_the_answer_is_the_best_of_all_rows_and_its_figures_are_theirs(finished: FinishedFolder, name: str) -> None:
    folder = finished(name)
    run, table = Run(read_output(folder)), whole(folder)
    answer = answer_of(run)
    assert answer.kind == KINDS[name]
    rows = table[table["scenario"] == run.scene]
    made = rows[rows["kind"].isin(["sweep", "search"])]
    if len(made):
        goal = run.output.goal.name
        assert run.here[run.hero][goal] == made[made["feasible"]][goal].max()
    own = rows.set_index("name")
    for design, row in run.here.items():
        for column in run.figures:
            if design in own.index and column in own:
                value = own.loc[design, column]
                assert row[column] == value or (np.isnan(row[column]) and np.isnan(value))
    shown = report_of(run.output)
    assert run.hero.lower() in shown.sentence.lower()
    assert len(shown.lines) > 1


def test_the_map_of_edges_has_the_most_of_all_widths(finished: FinishedFolder) -> None:
    folder = finished("stopband")
    rows = whole(folder)
    swept = rows[(rows["kind"] == "sweep") & rows["feasible"]]
    (section,) = exactness(Run(read_output(folder)))
    (panel,) = section.panels
    assert isinstance(panel, Map)
    for at, left in enumerate(panel.across):
        for row, right in enumerate(panel.up):
            there = swept[(swept["left_nm"] == left) & (swept["right_nm"] == right)]["csd_yellow_red"]
            assert panel.heights[row, at] == (there.max() if len(there) else pytest.approx(np.nan, nan_ok=True))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["noise", "distance"])
def test_ranges_are_those_of_the_rows_and_their_crossings(finished: FinishedFolder, name: str) -> None:
    """At every number of a series a design is inside of its range if the row says so."""
    folder = finished(name)
    run, table = Run(read_output(folder)), whole(folder)
    answer = answer_of(run)
    sections = answer.more if len(run.series) > 1 else [answer.section]
    for one, section in zip(run.series, sections, strict=False):
        assert section.table is not None
        key = "usable" if answer.kind.startswith("errors") else "ahead"
        for design in section.table.rows:
            marks = section.table.rows[design][key]
            if design == run.reference and key == "ahead":
                continue
            for scene, number in one.scenes.items():
                rows = table[(table["scenario"] == scene) & table["name"].isin([design, run.reference])].set_index(
                    "name"
                )
                if key == "usable":
                    assert run.study.recognition is not None
                    chromatic = [c for c in rows if c.startswith("chromatic_error_")]
                    holds = rows.loc[design, chromatic].max() <= run.study.recognition.error_max
                else:
                    holds = rows.loc[design, run.goal.name] > 1.005 * rows.loc[run.reference, run.goal.name]
                inside = any(low <= number <= high for low, high in marks.spans)  # type: ignore[union-attr]
                assert inside == holds or _near(one.axis, number, marks.spans)  # type: ignore[union-attr]


def _near(axis: object, number: float, spans: object) -> bool:
    """Whether a number is in a gap that is too narrow to be drawn."""
    ends = sorted(end for span in spans for end in span)  # type: ignore[attr-defined]
    gaps = zip(ends[1::2], ends[2::2], strict=False)
    return any(low <= number <= high for low, high in gaps) or axis.percent(number) in (0.0, 100.0)  # type: ignore[attr-defined]
