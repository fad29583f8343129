"""A filter that leaves a run is the one that its row is about."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.integrate import trapezoid
from scipy.io import loadmat
from scipy.spatial.distance import cdist

import sweep
from sweep.base.errors import OutputError, SweepError
from sweep.report.export import export, relative_transmission
from sweep.results.dataset import part_paths
from sweep.runs.audit import audit
from sweep.spectra.builtin.surrogate import surrogate_parameters
from sweep.spectra.filter_files import color_hints, csv_text, isetcam_mat, unique_names
from sweep.spectra.formats import read_curves
from sweep.study import load_study

from ..build import ran, stopband_study, study_file
from ..commanded import commanded
from ..tampering import listed_anew

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
    wave = np.arange(390.0, 711.0, 5.0)
    bumps = {name: np.exp(-(((wave - at) / wide) ** 2)) for name, at, wide in (("red", 640, 60), ("green", 530, 50))}
    curves = {**bumps, "yellow": np.maximum(*bumps.values()), "cyan": np.exp(-(((wave - 480) / 60) ** 2))}
    lights = {"a": np.exp(-(((wave - 590) / 10) ** 2)) + 1e-9, "b": np.exp(-(((wave - 630) / 10) ** 2)) + 1e-9}
    (tmp_path / "qe.csv").write_text(csv_text(wave, curves))
    (tmp_path / "lights.csv").write_text(csv_text(wave, lights))
    (tmp_path / "files.yaml").write_text(FILES)
    ran(load_study(tmp_path / "files.yaml"), tmp_path / "run", 1)
    return tmp_path / "run"


def distances(folder: Path, channels: dict[str, np.ndarray]) -> dict[str, float]:
    """All CSDs by plain NumPy: photons x QE, the brightest channel on white at 0.95 of full scale, rounding."""
    spectra = pd.read_parquet(folder / "curves.parquet")
    types: dict[str, list[np.ndarray]] = {}
    lights = spectra[spectra["kind"] == "light"]
    for (kind, _), light in lights.groupby(["signal_type", "curve"], sort=False, observed=True):
        types.setdefault(str(kind), []).append(light["value"].to_numpy())
    qe = np.stack(list(channels.values()))
    white = trapezoid(qe).max() / (qe.shape[1] - 1)
    qe[:, [0, -1]] /= 2  # half a bin at each end of the range
    gain = 0.95 * 4095 * surrogate_parameters().photon_ratio / white
    points = {name: np.floor(np.array(photons) @ qe.T * gain + 0.5) for name, photons in types.items()}
    names = list(points)
    return {
        f"csd_{a}_{b}": float(cdist(points[a], points[b]).min()) for i, a in enumerate(names) for b in names[i + 1 :]
    }


@pytest.mark.parametrize("key", ["RGGB", "mine", "best", "7", "211"])
def test_the_exported_curves_give_the_csds_of_the_row(tiny: Path, tmp_path: Path, key: str) -> None:
    exported = export(tiny, key, None, output=tmp_path)
    frame = pd.read_parquet(tiny / "results.parquet")
    if key == "best":
        few = frame[frame["feasible"] & frame["kind"].isin(["sweep", "search"])]
        row = few.loc[few["csd_yellow_red"].idxmax()]
    else:
        row = frame[(frame["design_id"] == int(key)) if key.isdecimal() else (frame["name"] == key)].iloc[0]
    made = read_curves(tmp_path / f"{key}.csv")
    channels = {name: values for name, values in made.values.items() if "_over_" not in name}
    assert list(channels) == (["R", "G", "B"] if key == "RGGB" else ["R", "Y", "N", "Cy"])
    for name, value in distances(tiny, channels).items():
        assert value == pytest.approx(row[name], rel=1e-9), name
    if key != "RGGB":
        assert trapezoid(channels["N"]) / trapezoid(channels["Y"]) == pytest.approx(row["sensitivity"], rel=1e-9)
        np.testing.assert_allclose(made.values["N_over_Y"] * channels["Y"], channels["N"], rtol=1e-12)
        assert made.values["N_over_Y"].min() == pytest.approx(row["min_transmission"], rel=1e-9)
        own = sweep.read_run(tiny).study.evaluate(N=channels["N"], scenario="chart")
        assert own["csd_yellow_red"][0] == pytest.approx(row["csd_yellow_red"], rel=1e-9)
    assert f"yellow/red {row['csd_yellow_red']:.1f} DN" in str(exported)


def test_isetcam_reads_the_same_filters(tiny: Path, tmp_path: Path) -> None:
    export(tiny, "mine", None, output=tmp_path)
    table, filters = (read_curves(tmp_path / f"mine.{kind}") for kind in ("csv", "mat"))
    np.testing.assert_array_equal(filters.wavelength_nm, table.wavelength_nm)
    assert list(filters.values) == ["rR", "yY", "oN", "cCy"]
    for name, values in filters.values.items():
        np.testing.assert_array_equal(values, table.values[name[1:]])
        assert 0 <= values.min() <= values.max() <= 1
    raw = loadmat(tmp_path / "mine.mat")
    assert raw["wavelength"].shape == (301, 1)
    assert raw["data"].shape == (301, 4)
    assert raw["filterNames"].dtype == object
    assert raw["filterNames"].shape == (1, 4)
    assert raw["filterOrder"].tolist() == [[1, 2], [3, 4]]
    (comment,) = raw["comment"]
    assert "left_nm=606" in comment
    assert "surrogate" in comment


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
    for at, key in enumerate(("0", "3", "best")):
        export(from_files, key, None, output=tmp_path / "kept")
        export(from_files, key, data, output=tmp_path / "read")
        kept, read = (read_curves(tmp_path / place / f"{key}.csv").values for place in ("kept", "read"))
        assert all(np.array_equal(kept[name], read[name]) for name in ("R", "Y", "N", "Cy")), at
    assert kept["Y"].max() == pytest.approx(0.5, rel=1e-3)
    said = loadmat(tmp_path / "kept" / "best.mat")["comment"][0]
    assert "from qe.csv" in said
    assert "surrogate" not in said
    for name in ("qe.csv", "lights.csv"):
        (data / name).unlink()
    export(from_files, "1", None, output=tmp_path / "kept")
    with pytest.raises(SweepError, match="no such file"):
        export(from_files, "2", data, output=tmp_path / "kept")


def test_other_curves_than_those_of_the_run_are_refused(from_files: Path, tmp_path: Path) -> None:
    data = from_files.parent
    lines = (data / "qe.csv").read_text().splitlines()
    at = next(number for number, line in enumerate(lines) if line.startswith("650.0,"))
    (data / "qe.csv").write_text("\n".join([*lines[:at], "650.0,0.5,0.1,0.5,0.1", *lines[at + 1 :]]))
    with pytest.raises(OutputError, match=r"differ from the run: R"):
        export(from_files, "3", data, output=tmp_path / "to")
    assert not (tmp_path / "to").exists()
    with pytest.raises(OutputError, match=r"differ from the run: R"):
        audit(from_files, data)
    assert not (from_files / "audit.parquet").exists()
    audit(from_files, None)  # with the curves that the run kept
    assert (from_files / "audit.parquet").exists()


def test_a_row_that_was_tampered_with_is_refused(tiny: Path, tmp_path: Path) -> None:
    from shutil import copytree

    copytree(tiny, tmp_path / "run")
    part = next(path for path in part_paths(tmp_path / "run") if 30 in set(pd.read_parquet(path)["design_id"]))
    frame = pd.read_parquet(part).set_index("design_id", drop=False)
    assert 30 not in set(pd.read_parquet(tiny / "curves.parquet")["design_id"])
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
    filters = pd.read_parquet(tiny / "results.parquet")["filter_id"].max() + 1
    for key, words in (
        ("mime", "did you mean 'mine'?"),
        (str(filters), f"0 to {filters - 1:,}"),
        ("-1", "RGGB"),
        ("", "best"),
    ):
        with pytest.raises(SweepError) as caught:
            export(tiny, key, None, output=tmp_path)
        assert len(caught.value.issues) == 1
        assert words in str(caught.value)
        assert caught.value.exit_code == 2
    for folder, to in ((tmp_path, None), (tiny, tiny / "manifest.json")):
        with pytest.raises(OutputError):
            export(folder, "best", None, output=to)
    code, _, said = commanded("export", tiny, "--design", "mime", "--to", tmp_path)
    assert (code, len(said.splitlines())) == (2, 1), said
    assert not list(tmp_path.iterdir())


def test_by_default_files_go_beside_the_run(tiny: Path) -> None:
    code, _, said = commanded("export", tiny, "--design", "best stopband")
    assert code == 0, said
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
    hints = color_hints(names, {})
    (tmp_path / "x.mat").write_bytes(isetcam_mat(wave, curves, hints, np.array([[0, 1], [2, 5]]), "x"))
    found = read_curves(tmp_path / "x.mat").values
    assert [name[1:] for name in found] == unique_names(names)
    for values, made in zip(found.values(), curves.values(), strict=True):
        np.testing.assert_array_equal(values, made)
