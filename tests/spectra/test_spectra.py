from __future__ import annotations

import numpy as np
import pytest

from sweep.base.errors import DataError, SweepError
from sweep.spectra.spectrum import (
    WavelengthGrid,
    check_samples,
    energy_from_photons,
    linear_basis,
    photons_from_energy,
)

GRID = WavelengthGrid()


@pytest.mark.parametrize(
    ("keys", "word"),
    [
        ({"step_nm": 7.0}, "divide"),
        ({"start_nm": 700.0, "stop_nm": 400.0}, "below"),
        ({"start_nm": 0.4, "stop_nm": 0.7, "step_nm": 0.1}, "nm"),
        ({"step_nm": float("nan")}, "finite"),
    ],
)
def test_bad_grid_is_refused(keys: dict[str, float], word: str) -> None:
    with pytest.raises(SweepError, match=word):
        WavelengthGrid(**keys)


@pytest.mark.parametrize(
    ("wave", "data", "word"),
    [
        ([400, 500, 700], [1, np.nan, 1], "500 nm is not a finite"),
        ([400, 700, 500], [1, 1, 1], "not sorted"),
        ([400, 500, 500, 700], [1, 1, 1, 1], "occurs twice"),
        ([400, np.nan, 700], [1, 1, 1], "wavelength is not a finite"),
        ([400, 500], [1, 1, 1], "two or more"),
    ],
)
def test_dirty_samples_are_refused(wave: list[float], data: list[float], word: str) -> None:
    with pytest.raises(DataError, match=word):
        check_samples(wave, data)


def test_photon_energy_of_555_nm() -> None:
    # h c / 555 nm = 3.5792e-19 J (CODATA 2018)
    photons = photons_from_energy(np.array([555.0]), np.array([1.0]))
    assert photons[0] == pytest.approx(1 / 3.57918e-19, rel=1e-5)
    assert energy_from_photons(np.array([555.0]), photons)[0] == pytest.approx(1, rel=1e-15)


def test_hats_interpolate_as_lines_do() -> None:
    rng = np.random.default_rng(2)
    for n in (1, 2, 7, 40):
        knots, values = np.cumsum(rng.uniform(0.1, 2, n)), rng.uniform(-1, 1, n)
        at = np.concatenate([rng.uniform(knots[0] - 1, knots[-1] + 1, 50), knots])
        np.testing.assert_allclose(values @ linear_basis(at, knots), np.interp(at, knots, values), rtol=0, atol=1e-14)
