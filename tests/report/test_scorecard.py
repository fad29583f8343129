"""The scorecard, color against noise, and pictures: their data, and that a study without tasks has none of it."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from sweep.metrics.quantity import Column
from sweep.report import read_output, summary_lines
from sweep.report.colors import error_curves, noise_optimal, renderings
from sweep.report.scorecard import ScoreRow, _row, scorecard

from ..commanded import commanded

TINY = """
study: tiny
sensor: ar0820
lights: tl16
wavelengths: {start_nm: 400, stop_nm: 700, step_nm: 5}
cfas: [RGGB, RCCC, RYYCy]
tasks: [color, low_light, emergency]
"""
MORE = Column("a_dprime", "task_dprime", "", digits=2, direction="more")
LESS = Column("a_lux", "task_lux", "", digits=2, direction="less")


def row(column: Column, *values: float) -> ScoreRow:
    return _row(column, np.array(values))


def test_best_and_worst_of_a_row() -> None:
    assert [mark for _, mark in row(MORE, 3, 5, 1, 5).cells] == ["", "best", "worst", "best"]
    assert [mark for _, mark in row(LESS, 3, 5, 1).cells] == ["", "worst", "best"]
    assert row(MORE, 3, math.nan, 1).cells == [("3.00", "best"), ("-", ""), ("1.00", "worst")]
    for alike in (row(MORE, 2, 2, 2), row(MORE, 1e-5, 3e-5), row(MORE, math.nan)):
        assert not alike.best | alike.worst  # what is told apart by rounding alone is neither best nor worst


def test_factors_say_how_many_times_better() -> None:
    np.testing.assert_allclose(row(MORE, 2, 6, 1).factors, [1, 3, 0.5])
    np.testing.assert_allclose(row(LESS, 2, 6, 1).factors, [1, 1 / 3, 2])
    assert np.isnan(row(MORE, 2, -6, 1).factors).tolist() == [False, True, False]
    assert np.isnan(row(MORE, -2, 6, 1).factors).all()


@pytest.fixture(scope="module")
def tiny(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("tasks")
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("sweep.report.page._drawings", lambda _: ())
        for name, text in (("tiny", TINY), ("without", TINY.replace("tiny", "without").split("tasks:")[0])):
            (folder / f"{name}.yaml").write_text(text)
            code, _, said = commanded("run", folder / f"{name}.yaml", "--output", folder, "--jobs", 1)
            assert code == 0, said
    return folder


def test_a_run_with_tasks_has_a_scorecard(tiny: Path) -> None:
    output = read_output(tiny / "tiny")
    card = scorecard(output)
    assert card is not None
    assert card.names == ("RGGB", "RCCC", "RYYCy")
    names = [each.column.name for each in card.rows]
    assert "color_delta_e_mean_d65" in names
    assert "color_delta_e_max_d65" not in names
    for each in card.rows:
        np.testing.assert_array_equal(each.values, output.named_rows[each.column.name])
    first = summary_lines(output)[0]
    assert f" of {sum(bool(each.best) for each in card.rows)} figures of tasks and worst in " in first


def test_color_against_noise_passes_through_the_figures_of_the_table(tiny: Path) -> None:
    output = read_output(tiny / "tiny")
    few = output.named_rows.set_index("name")
    curves = error_curves(output)
    assert list(curves) == ["d65", "a", "led", "hps"]
    for light, rows in curves.items():
        for name, curve in rows.groupby("name"):
            snr, error = noise_optimal(curve)
            assert snr == pytest.approx(few.loc[name, f"color_snr_{light}"], rel=1e-9)
            assert error == pytest.approx(few.loc[name, f"color_delta_e_mean_{light}"], rel=1e-9)
            assert curve["snr"].iloc[-1] > curve["snr"].iloc[0]  # less trust in noisy channels, less noise


def test_pictures_show_what_the_eye_and_each_cfa_see(tiny: Path) -> None:
    """A patch of the chart is, on the mean, its color; the eye's picture has no noise; the same seed, the same noise."""
    output = read_output(tiny / "tiny")
    found = renderings(output)
    assert list(found) == ["chart", "night"]
    assert all(list(own) == ["the eye", "RGGB", "RCCC", "RYYCy"] for own in found.values())
    eye, rggb = (found["chart"][name] for name in ("the eye", "RGGB"))
    white = eye[3 * 14 : 4 * 14, :14].reshape(-1, 3)
    assert np.ptp(white, axis=0).max() < 1e-12
    np.testing.assert_allclose(white[0], white[0].mean(), rtol=0.02)
    drawn = rggb[3 * 14 : 4 * 14, :14].reshape(-1, 3)
    assert drawn.std(axis=0).min() > 1e-3
    np.testing.assert_allclose(drawn.mean(axis=0), white[0], rtol=0.05)
    np.testing.assert_array_equal(renderings(output)["night"]["RGGB"], found["night"]["RGGB"])


def test_without_tasks_there_is_nothing_of_them(tiny: Path) -> None:
    output = read_output(tiny / "without")
    assert scorecard(output) is None
    assert error_curves(output) == {}
    assert renderings(output) == {}
    assert not {"color_noise.parquet", "rendered.parquet"} & {path.name for path in (tiny / "without").iterdir()}
