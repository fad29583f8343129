"""Catalogs of colorants: what is read, what is not, and why."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sweep.base.errors import DataError
from sweep.spectra.colorants import measured_films, read_colorants
from sweep.spectra.spectrum import WavelengthGrid

GRID = WavelengthGrid()
NM = np.arange(300, 801, 2)


def dye(peak_nm: float, height: float = 80_000.0) -> np.ndarray:
    return height * np.exp(-(((NM - peak_nm) / 30) ** 2))


def written(path: Path, values: np.ndarray, nm: np.ndarray = NM) -> Path:
    """Two columns of text, as the PhotochemCAD database has them."""
    rows = "\n".join(f"{a:.2f}\t{b:.6f}" for a, b in zip(nm, values, strict=True))
    path.write_text(f"Wavelength (nm)\tCoefficient\n{rows}\n")
    return path


def test_measured_films_absorb_where_their_dyes_do() -> None:
    """The peak of rhodamine 6G: k is 0.791 at 530 nm in the database, and the absorbance 4 pi k 800 / (530 ln 10)."""
    films = measured_films(GRID)
    assert films.names[0] == "rhodamine 6G"
    assert (len(films), films.refused) == (9, ())
    at = films.absorbance[0].argmax()
    assert GRID.nodes_nm[at] == 530
    assert films.peaks[0] == pytest.approx(4 * np.pi * 0.791 * 800 / (530 * np.log(10)), rel=1e-3)


def test_a_folder_says_what_was_read_and_what_not(tmp_path: Path) -> None:
    written(tmp_path / "a good.txt", dye(620))
    written(tmp_path / "b noisy.txt", dye(560) - 500)
    written(tmp_path / "c negative.txt", dye(560) - 20_000)
    written(tmp_path / "d nothing.txt", np.zeros(NM.size))
    written(tmp_path / "e cut.txt", dye(690)[NM <= 650], NM[NM <= 650])
    written(tmp_path / "f ends.txt", dye(480)[NM <= 620], NM[NM <= 620])
    (tmp_path / "g empty.txt").write_text("")
    catalog = read_colorants([tmp_path], GRID)
    assert catalog.names == ("a good", "b noisy", "f ends")
    assert [text.split(":")[0][0] for text in catalog.refused] == ["c", "d", "e", "g"]
    assert any(note.startswith("b noisy.txt: ") for note in catalog.notes)
    np.testing.assert_allclose(catalog.peaks, [80_000, 79_500, 80_000], rtol=1e-6)
    np.testing.assert_allclose(catalog.absorbance[0], np.interp(GRID.nodes_nm, NM, dye(620) / 80_000), atol=1e-8)
    assert (catalog.absorbance[2][GRID.nodes_nm > 621] == 0).all()


def test_a_peak_outside_the_grid_stays_the_unit(tmp_path: Path) -> None:
    """An absorbance is that of the whole spectrum: a dye of the near ultraviolet has no peak of 1 on the grid."""
    catalog = read_colorants([written(tmp_path / "uv.txt", dye(350))], GRID)
    assert catalog.absorbance.max() < 0.1
    assert catalog.peaks[0] == pytest.approx(80_000)


def test_columns_of_one_file_are_colorants_and_a_repeated_name_is_not_read_twice(tmp_path: Path) -> None:
    table = "wavelength_nm,one,two\n" + "\n".join(
        f"{nm},{a},{b}" for nm, a, b in zip(NM, dye(500), dye(600), strict=True)
    )
    (tmp_path / "dyes.csv").write_text(table)
    catalog = read_colorants([tmp_path / "dyes.csv", tmp_path], GRID)
    assert catalog.names == ("dyes one", "dyes two")
    assert len(catalog.refused) == 2


def test_a_folder_without_spectra_is_refused(tmp_path: Path) -> None:
    (tmp_path / "bad.txt").write_text("nothing")
    with pytest.raises(DataError, match="no colorants"):
        read_colorants([tmp_path], GRID)
