"""A filter that leaves a run is the one that its row is about."""

from __future__ import annotations

from pathlib import Path
from shutil import copytree

import numpy as np
import pandas as pd
import pytest
from scipy.integrate import trapezoid
from scipy.io import loadmat

import sweep
from sweep.base.errors import OutputError, SweepError
from sweep.features.audit.audit import audit
from sweep.features.export.export import export, relative_transmission
from sweep.results.dataset import part_paths
from sweep.spectra.filter_files import color_hints, csv_text, unique_names
from sweep.spectra.formats import read_curves
from sweep.study import load_study

from ...build import one_line, ran, stopband_study, study_file
from ...curve_texts import WAVE, bell, csv
from ...tampering import listed_anew

FILES = stopband_study(
    "files",
    "{left_nm: [600, 610], left_width_nm: 10, right_nm: [650, 660, 670], right_width_nm: 10}",
    cfas="[RYNCy]",
    curves="""\
sensor:
  name: mine
  files: [{file: qe.csv, columns: {R: red, G: green, Y: yellow, Cy: cyan}, scale: 0.5}]
lights:
  files: [{file: lights.csv, quantity: photons, signals: {yellow: [a], red: [b]}}]
""",
)


@pytest.fixture(scope="module")
def tiny(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("export")
    ran(load_study(study_file(folder, 3), changes={"columns": "all"}), folder / "tiny", 1)
    return folder / "tiny"


@pytest.fixture
def from_files(tmp_path: Path) -> Path:
    """A finished run of a study with curve files, and the files."""
    green, red = bell(530, 35), bell(640, 40)
    csv(
        tmp_path,
        "wavelength_nm,red,green,yellow,cyan",
        WAVE,
        red,
        green,
        np.maximum(green, red),
        bell(480, 40),
        name="qe.csv",
    )
    csv(tmp_path, "wavelength_nm,a,b", WAVE, bell(590, 10), bell(630, 10), name="lights.csv")
    (tmp_path / "files.yaml").write_text(FILES)
    ran(load_study(tmp_path / "files.yaml"), tmp_path / "run", 1)
    return tmp_path / "run"


@pytest.mark.parametrize("key", ["RGGB", "mine", "7", "211"])
def test_the_exported_curves_give_the_csds_of_the_row(tiny: Path, tmp_path: Path, key: str) -> None:
    export(tiny, key, None, output=tmp_path)
    frame = pd.read_parquet(tiny / "results.parquet")
    row = frame[(frame["design_id"] == int(key)) if key.isdecimal() else (frame["name"] == key)].iloc[0]
    made = read_curves(tmp_path / f"{key}.csv")
    channels = {name: values for name, values in made.values.items() if "_over_" not in name}
    study = sweep.read_run(tiny).study
    for name in channels.keys() - {"N"}:
        np.testing.assert_array_equal(channels[name], study.curve(name))
    if key == "RGGB":
        assert list(channels) == ["R", "G", "B"]
    else:
        assert list(channels) == ["R", "Y", "N", "Cy"]
        own = study.evaluate(N=channels["N"], scenario="chart").iloc[0]
        csds = [name for name in frame.columns if name.startswith("csd_")]
        assert len(csds) == 6
        np.testing.assert_allclose(own[csds].astype(float), row[csds].astype(float), rtol=1e-9)
        assert trapezoid(channels["N"]) / trapezoid(channels["Y"]) == pytest.approx(row["sensitivity"], rel=1e-9)
        np.testing.assert_allclose(made.values["N_over_Y"] * channels["Y"], channels["N"], rtol=1e-12)
        assert made.values["N_over_Y"].min() == pytest.approx(row["min_transmission"], rel=1e-9)


def test_isetcam_reads_the_same_filters(tiny: Path, tmp_path: Path) -> None:
    export(tiny, "mine", None, output=tmp_path)
    table, filters = (read_curves(tmp_path / f"mine.{kind}") for kind in ("csv", "mat"))
    np.testing.assert_array_equal(filters.wavelength_nm, table.wavelength_nm)
    assert list(filters.values) == ["rR", "yY", "oN", "cCy"]
    for name, values in filters.values.items():
        np.testing.assert_array_equal(values, table.values[name[1:]])
        assert 0 <= values.min() <= values.max() <= 1
    raw = loadmat(tmp_path / "mine.mat")
    assert (raw["wavelength"].shape, raw["data"].shape, raw["filterNames"].shape) == ((301, 1), (301, 4), (1, 4))
    assert raw["filterOrder"].tolist() == [[1, 2], [3, 4]]


def test_the_same_export_again_is_the_same_and_nothing_else_is_overwritten(tiny: Path, tmp_path: Path) -> None:
    export(tiny, "mine", None, output=tmp_path)
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    export(tiny, "mine", None, output=tmp_path)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before
    (tmp_path / "mine.mat").write_bytes(b"notes")
    (tmp_path / "mine.csv").unlink()
    with pytest.raises(OutputError, match="holds something else already"):
        export(tiny, "mine", None, output=tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["mine.mat"]


def test_a_run_of_files_needs_them_no_more(from_files: Path, tmp_path: Path) -> None:
    data = from_files.parent
    export(from_files, "best", None, output=tmp_path / "kept")
    export(from_files, "best", data, output=tmp_path / "read")
    kept, read = (read_curves(tmp_path / place / "best.csv").values for place in ("kept", "read"))
    assert all(np.array_equal(kept[name], read[name]) for name in ("R", "Y", "N", "Cy"))
    assert kept["Y"].max() == pytest.approx(0.5, rel=1e-3)
    assert "from qe.csv" in loadmat(tmp_path / "kept" / "best.mat")["comment"][0]
    for name in ("qe.csv", "lights.csv"):
        (data / name).unlink()
    export(from_files, "1", None, output=tmp_path / "kept")
    with pytest.raises(SweepError, match="no such file"):
        export(from_files, "2", data, output=tmp_path / "kept")


def test_other_curves_than_those_of_the_run_are_refused(from_files: Path, tmp_path: Path) -> None:
    data = from_files.parent
    (data / "qe.csv").write_text((data / "qe.csv").read_text().replace("\n650,", "\n651,"))
    with pytest.raises(OutputError, match=r"not the files of the run: qe.csv"):
        export(from_files, "3", data, output=tmp_path / "to")
    assert not (tmp_path / "to").exists()
    with pytest.raises(OutputError, match=r"not the files of the run: qe.csv"):
        audit(from_files, data)
    assert not (from_files / "audit.parquet").exists()
    audit(from_files, None)  # with the curves that the run kept
    assert (from_files / "audit.parquet").exists()


def test_a_row_that_was_tampered_with_is_refused(tiny: Path, tmp_path: Path) -> None:
    copytree(tiny, tmp_path / "run")
    part = next(path for path in part_paths(tmp_path / "run") if 30 in set(pd.read_parquet(path)["design_id"]))
    frame = pd.read_parquet(part).set_index("design_id", drop=False)
    frame.loc[30, "right_nm"] += 1
    status = frame["status"].astype(object)
    status.loc[31] = "error: KeyError: x"
    frame["status"] = status.astype("category")
    frame.to_parquet(part, index=False)
    listed_anew(tmp_path / "run")
    with pytest.raises(OutputError, match="the sensitivity differs from the run"):
        export(tmp_path / "run", "30", None, output=None)
    with pytest.raises(SweepError, match=r"the design failed .got 'error: KeyError: x'"):
        export(tmp_path / "run", "31", None, output=None)


def test_unknown_keys_are_one_line(tiny: Path, tmp_path: Path) -> None:
    for key, words in (("mime", "did you mean 'mine'?"), ("1000000", "0 to "), ("-1", "RGGB"), ("", "best")):
        with one_line(words):
            export(tiny, key, None, output=tmp_path)
    for folder, to in ((tmp_path, None), (tiny, tiny / "manifest.json")):
        with pytest.raises(OutputError):
            export(folder, "best", None, output=to)
    assert not list(tmp_path.iterdir())


def test_by_default_files_go_beside_the_run(tiny: Path) -> None:
    export(tiny, "best stopband", None)
    assert {path.name for path in (tiny / "export").iterdir()} == {"best_stopband.csv", "best_stopband.mat"}


def test_a_transmission_where_the_base_has_no_light() -> None:
    base = np.array([0.0, 0.5, 0.4])
    for modified, expected in (([0.0, 0.25, 0.4], [1.0, 0.5, 1.0]), ([0.1, 0.25, 0.6], [np.inf, 0.5, 0.6 / 0.4])):
        np.testing.assert_array_equal(relative_transmission(np.array(modified), base), expected)


def test_a_clear_pixel_is_white() -> None:
    assert color_hints(["R", "C", "N"], {"N": "C"}) == ["r", "w", "o"]  # ISETCam's c is cyan


def test_names_that_a_file_cannot_hold_are_made_so(tmp_path: Path) -> None:
    wave, curve = np.array([500.0, 600.0]), np.array([0.1 + 0.2, 1 / 3])
    names = ['a "b", c', " a\nb ", "a b", "wavelength_nm", "", "blå"]
    curves = {name: curve * (at + 1) / 10 for at, name in enumerate(names)}
    (tmp_path / "x.csv").write_text(csv_text(wave, curves), encoding="utf-8")
    read = read_curves(tmp_path / "x.csv")
    assert list(read.values) == unique_names(names) == ['a "b", c', "a b", "a b_2", "wavelength_nm_2", "_", "blå"]
    for found, made in zip(read.values.values(), curves.values(), strict=True):
        np.testing.assert_array_equal(found, made)
