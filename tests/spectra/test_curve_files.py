from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from sweep.base.errors import DataError
from sweep.spectra.formats import digest, read_curves


def written(tmp_path: Path, text: str, name: str = "curves.csv") -> Path:
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    return path


def issues(path: Path) -> list[str]:
    with pytest.raises(DataError) as caught:
        read_curves(path)
    return [str(issue).replace(str(path), "FILE") for issue in caught.value.issues]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("wavelength_nm,R\n400,0.1\n410,nan\n420,\n430,1\n", "FILE: R: several values in a row are missing"),
        ("wavelength_nm,R\n400,0.1\n410,-0.2\n", "FILE: R: negative value at 410 nm"),
        ("wavelength_nm,R\n400,0.1\n410,x\n", "FILE:3: R: not a usable number (got 'x')"),
        ("wavelength_nm,R\n400,0.1\n400,0.2\n410,0.1\n410,0.2\n", "twice, with other values"),
        ("wavelength_nm,R\n400,0.1\n410,0.2,0.3\n", "FILE:3: wrong number of columns (got 3)"),
        ("wavelength_km,R\n0.4,0.1\n0.41,0.2\n", "FILE:1: wavelength_km: no column wavelength"),
        ("wavelength_nm,R\n0.4,0.1\n0.7,0.2\n", "um"),
        ("frequency,R\n400,0.1\n", "FILE:1: "),
        ("wavelength_nm,R,R\n400,0.1,0.2\n", "FILE:1: R: column occurs twice"),
        ("wavelength_nm\n400\n410\n", "no curve"),
        ("wavelength_nm,R\n400,1\n", "two or more"),
        ("", "empty"),
    ],
)
def test_a_fault_of_a_csv_names_file_line_column_value(tmp_path: Path, text: str, said: str) -> None:
    (found,) = issues(written(tmp_path, text))
    assert said in found


def test_every_fault_of_a_csv_is_named(tmp_path: Path) -> None:
    assert len(issues(written(tmp_path, "wavelength_nm,R,G\n400,a,1\n410,1,-1\n405,x,1\n420,2,2\n"))) == 3
    assert len(issues(written(tmp_path, "wavelength_nm,a\n400,1\nx,1\n700,2\n"))) == 1


def test_mat_of_one_spectrum(tmp_path: Path) -> None:
    path = tmp_path / "light.mat"
    savemat(path, {"wavelength": np.arange(400, 701, 10.0)[:, None], "data": np.ones((1, 31))})
    assert list(read_curves(path).values) == ["curve_1"]


@pytest.mark.parametrize(
    ("fields", "word"),
    [
        ({"wavelength": [400.0, 410.0], "dat": [1.0, 1.0]}, "did you mean 'dat'"),
        ({"wavelength": [400.0, 410.0], "data": [[1.0, 1.0, 1.0]]}, "does not fit"),
    ],
)
def test_a_wrong_mat_is_one_line(tmp_path: Path, fields: dict[str, object], word: str) -> None:
    path = tmp_path / "wrong.mat"
    savemat(path, fields)
    found = issues(path)
    assert len(found) == 1
    assert word in found[0]


def test_damaged_files_are_faults(tmp_path: Path) -> None:
    for content in (b"\x89HDF\r\n\x1a\n" + bytes(200), b"MATLAB 7.3 MAT-file" + bytes(400)):
        path = tmp_path / "damaged.mat"
        path.write_bytes(content)
        assert len(issues(path)) == 1
    (tmp_path / "latin.csv").write_bytes(b"wavelength_nm,\xe9\n400,1\n700,1\n")
    assert read_curves(tmp_path / "latin.csv").notes == ("the text is not UTF-8, and was read as Latin-1",)
    assert "cannot be read" in issues(tmp_path / "absent.csv")[0]
    assert "not a readable spreadsheet" in issues(written(tmp_path, "x", "curves.xlsx"))[0]
    assert ".csv" in issues(written(tmp_path, "x", "curves.xls"))[0]


def test_digest_is_sha256_of_the_bytes(tmp_path: Path) -> None:
    # FIPS 180-2's example of "abc"
    assert digest(written(tmp_path, "abc")).startswith("ba7816bf8f01cfea414140de5dae2223")


def test_old_line_ends_are_read(tmp_path: Path) -> None:
    path = tmp_path / "mac.csv"
    path.write_bytes(b"wavelength_nm,a\r400,1\r700,2\r")
    assert list(read_curves(path).values["a"]) == [1, 2]
    assert "CSV" in issues(written(tmp_path, 'wavelength_nm,a\n400,"' + "1" * 200_000 + "\n"))[0]
