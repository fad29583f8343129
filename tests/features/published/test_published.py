"""Printed figures beside those of a run."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from sweep.base.errors import StudyError
from sweep.report import make_report, read_output
from sweep.runs import run_study
from sweep.study import load_study

from ...conftest import STUDIES
from ...spectra.test_calibrate import SCRIPT


@pytest.mark.usefixtures("plain_pictures")
def test_the_comparison_of_a_report_has_every_printed_figure(tmp_path: Path) -> None:
    """Table 1 to the printed digit, all 48 CSDs within 3 % or 2 DN, and the sensitivity near."""
    run_study(load_study(STUDIES / "paper.yaml"), tmp_path, 1, lambda *_: None)
    make_report(read_output(tmp_path))
    comparison = pd.read_parquet(tmp_path / "paper_comparison.parquet")
    pd.testing.assert_frame_equal(comparison, pd.read_csv(tmp_path / "paper_comparison.csv"), check_dtype=False)
    table = comparison[comparison["table"] == "Table 1"]
    assert list(table["ours"]) == [18, 7.3, 5.9]
    assert (table["error"] == 0).all()
    figures = comparison[comparison["quantity"].str.startswith(("csd_", "sensitivity"))]
    assert list(figures["quantity"].str.split("_").str[0].value_counts()) == [48, 1]
    for row in figures.itertuples():
        assert abs(row.ours_exact - row.paper) <= SCRIPT.allowed(row.quantity, row.paper), row


def test_published_names_are_checked(tmp_path: Path) -> None:
    path, text = tmp_path / "paper.yaml", (STUDIES / "paper.yaml").read_text()
    for old, new, word in (
        ("    RGGB: {csd", "    RGBG: {csd", "did you mean 'RGGB'"),
        ("RGGB: {csd_green_yellow", "RGGB: {csd_green_yelow", "did you mean 'csd_green_yellow'"),
        ("urban: {object_resolution_px", "urban: {sensitivity", "allowed: object_resolution_px"),
        ("at: paper_N2", "at: RYN5Cy", "unknown built-in filter"),
    ):
        assert old in text
        path.write_text(text.replace(old, new, 1))
        with pytest.raises(StudyError, match=word):
            load_study(path)
