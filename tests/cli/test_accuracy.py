"""`sweep accuracy`: error and time of accuracy settings."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from sweep.base.errors import OutputError
from sweep.cli.accuracy import denser, measure_accuracy, spread
from sweep.study import load_study

from ..build import stopband_study

TWO_SCENES = stopband_study(
    "two",
    "{left_nm: [600, 610], left_width_nm: 20, right_nm: [650, 655], right_width_nm: 10}",
    before="""\
wavelengths: {step_nm: 5}
pixel: {read_noise_e: 2, offset_dn: 168}
scenarios:
  chart: {}
  anywhere: {target: {distance_m: 250, fov_deg: 60, phase_px: any}, optics: {f_number: 2}, noise: true}
""",
)
COLUMNS = ["scenario", "setting", "value", "designs", "error_dn", "first_s", "following_s", "total_s", "extrapolated"]


def measured(folder: Path, **options: object) -> tuple[list[str], list[tuple[str, int, int]]]:
    """Lines and progress of the command's function on a study of two scenes."""
    path = folder / "two.yaml"
    path.write_text(TWO_SCENES)
    progress: list[tuple[str, int, int]] = []
    lines = measure_accuracy(
        load_study(path),
        lambda step_nm: load_study(path, None, step_nm),
        folder,
        lambda *call: progress.append(call),
        **options,  # type: ignore[arg-type]
    )
    return lines, progress


@pytest.mark.long
def test_presets_and_settings_are_measured_in_the_scenes_that_they_change(tmp_path: Path) -> None:
    few = {"phases_per_px": (4, 64), "grid_step_nm": (7.0, 2.5), "rays": (1,)}
    (tmp_path / "hard_cases.json").write_text('[{"case": "a", "oracle": "b", "error": 1, "allowed": 2, "why": "c"}]')
    lines, progress = measured(tmp_path, settings=few, presets=["standard"])
    table = pd.read_parquet(tmp_path / "accuracy.parquet")
    assert list(table.columns) == COLUMNS
    kinds = table.groupby(["scenario", "setting"])["value"].unique().map(list).to_dict()
    assert kinds == {
        ("chart", "preset"): ["standard", "reference"],
        ("chart", "grid_step_nm"): ["2.5"],  # 7 nm do not divide the range
        ("anywhere", "preset"): ["standard", "reference"],
        ("anywhere", "phases_per_px"): ["4", "64"],
    }
    assert set(table["designs"]) == {1, 4, 10_000}
    assert (table.loc[table["value"] == "reference", "error_dn"] == 0).all()
    coarse, fine = (table.loc[table["value"] == value, "error_dn"].iloc[0] for value in ("4", "64"))
    assert coarse >= fine > 0
    assert (table["total_s"] > 0).all()
    few_s, many_s = (table[table["designs"] == n].set_index(["scenario", "setting", "value"]) for n in (4, 10_000))
    assert not few_s["extrapolated"].any()
    assert not many_s.loc[("chart", "preset", "standard"), "extrapolated"]
    told = many_s[many_s["extrapolated"]]
    whole_s = told["first_s"] + 9_999 * few_s.loc[told.index, "following_s"]
    np.testing.assert_allclose(told["total_s"], whole_s, rtol=1e-12)
    assert [line.split(" (")[0] for line in lines[:2]] == ["chart", "anywhere"]
    assert lines[2] == "1 of 1 hard cases are within their allowed error."
    assert progress[0] == ("measurements", 0, 8)
    assert progress[-1] == ("measurements", 8, 8)
    assert (tmp_path / "accuracy.png").read_bytes().startswith(b"\x89PNG")
    assert (tmp_path / "accuracy.svg").is_file()
    page = (tmp_path / "accuracy.html").read_text()
    assert page.count("data:image/png;base64,") == 1
    assert "phases_per_px" in page
    assert "Hard cases" in page


@pytest.mark.parametrize("text", ["", "{", "[1]", '[{"case": "a"}]'])
def test_a_damaged_table_of_hard_cases_is_refused_with_one_line(tmp_path: Path, text: str) -> None:
    (tmp_path / "hard_cases.json").write_text(text)
    with pytest.raises(OutputError) as refused:
        measured(tmp_path)
    assert len(str(refused.value).splitlines()) == 1
    assert "hard_cases.json" in str(refused.value)


def test_every_beginning_of_the_designs_is_spread_over_all() -> None:
    order = spread(42)
    assert order[0] == 0
    assert sorted(order) == list(range(42))
    for n in range(2, 42):
        gaps = np.diff([*sorted(order[:n]), 42])
        assert gaps.max() <= 3 * 42 / n


def test_a_denser_grid_lies_between_the_ends_of_the_axes(tmp_path: Path) -> None:
    (tmp_path / "two.yaml").write_text(TWO_SCENES)
    plain, *_, swept = load_study(tmp_path / "two.yaml").spaces
    assert denser(plain) is None
    dense = denser(swept)
    assert dense is not None
    assert dense.size >= 10_000
    for axis, known in zip(dense.axes, swept.axes, strict=True):
        assert (min(axis), max(axis)) == (min(known), max(known))
