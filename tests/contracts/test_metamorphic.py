"""Studies that say the same in another way have the same numbers; what is more or less moves a result in one sense."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from sweep.study import Study, load_study

from ..golden import numbers_of

WAVE = np.arange(400.0, 701.0, 2.0)
PEAKS = {"green": (500, 512, 530), "yellow": (586, 590, 594), "red": (622, 630, 640)}
STUDY = """\
study: alike
sensor: ar0820
lights:
  files:
    - {file: leds.csv, signals: {green: [g1, g2, g3], yellow: [y1, y2, y3], red: [r1, r2, r3]}}
pixel: {read_noise_e: 2, offset_dn: 64, dark_e_per_s: 20}
columns: all
scenarios:
  chart: {exposure: {kind: white_patch, level: 0.9}}
  night: {intensity_cd: 200, background_cd_m2: 5, exposure: {kind: fixed, exposure_s: 0.0008}, noise: true}
  far: {target: {distance_m: 60, fov_deg: 60, phase_px: [0.3, 0.4]}, optics: {f_number: 2}}
cfas:
  RGGB:
  RYNCy:
designs:
  mine: {cfa: RYNCy, channel: N, base: Y, to: G, at: {left_nm: 606, left_width_nm: 16, right_nm: 646, right_width_nm: 9}}
"""


def leds() -> pd.DataFrame:
    """Spectra of nine LEDs, in energy."""
    columns = {
        f"{kind[0]}{at}": np.exp(-(((WAVE - peak) / 9) ** 2))
        for kind, peaks in PEAKS.items()
        for at, peak in enumerate(peaks, 1)
    }
    return pd.DataFrame({"wavelength_nm": WAVE, **columns})


@pytest.fixture
def study(tmp_path: Path) -> Callable[..., Study]:
    """A study of files, with texts of its own replaced."""

    def made(*replaced: tuple[str, str], table: pd.DataFrame | None = None) -> Study:
        (leds() if table is None else table).to_csv(tmp_path / "leds.csv", index=False)
        text = STUDY
        for old, new in replaced:
            assert text.count(old) == 1, old
            text = text.replace(old, new)
        path = tmp_path / "alike.yaml"
        path.write_text(text)
        return load_study(path)

    return made


def values_of(study: Study, *, without: tuple[str, ...] = ()) -> pd.Series:
    """Its numbers by scenario, design and column, in one order."""
    numbers = numbers_of(study)
    numbers = numbers[~numbers["column"].isin(without)]
    return numbers.set_index(["scenario", "name", "column"])["value"].sort_index()


def assert_same(one: pd.Series, other: pd.Series, share: float = 1e-9) -> None:
    assert len(one) == len(other) > 20
    np.testing.assert_allclose(
        one.to_numpy(), other.to_numpy(), rtol=share, atol=1e-7, err_msg=str(one.index.to_list()[:3])
    )


def test_twice_the_light_in_half_the_time_is_the_same(study: Callable[..., Study]) -> None:
    bright = study(
        ("intensity_cd: 200, background_cd_m2: 5", "intensity_cd: 400, background_cd_m2: 10"),
        ("exposure_s: 0.0008", "exposure_s: 0.0004"),
        ("dark_e_per_s: 20", "dark_e_per_s: 40"),
    )
    one, other = (values_of(each, without=("exposure_s",)).loc["night"] for each in (study(), bright))
    assert_same(one, other)


@pytest.mark.parametrize(
    "tile",
    ["[[G, R], [B, G]]", "[[G, B], [R, G]]", "[[B, G], [G, R]]", "[[R, G], [G, B]]"],
    ids=["mirrored", "turned", "upside down", "as it is"],
)
def test_a_field_does_not_know_where_a_tile_begins(study: Callable[..., Study], tile: str) -> None:
    one, other = study(), study(("  RGGB:\n", f"  RGGB: {{tile: {tile}}}\n"))
    for scenario in ("chart", "night"):
        assert_same(values_of(one).loc[scenario], values_of(other).loc[scenario])


REORDERED = {
    "signals": (
        "green: [g1, g2, g3], yellow: [y1, y2, y3], red: [r1, r2, r3]",
        "red: [r3, r1, r2], green: [g2, g3, g1], yellow: [y1, y3, y2]",
    ),
    "CFAs": ("  RGGB:\n  RYNCy:\n", "  RYNCy:\n  RGGB:\n"),
    "keys": (
        "pixel: {read_noise_e: 2, offset_dn: 64, dark_e_per_s: 20}",
        "pixel: {dark_e_per_s: 20, read_noise_e: 2, offset_dn: 64}",
    ),
    "scenarios": (
        "  chart: {exposure: {kind: white_patch, level: 0.9}}\n  night: {intensity_cd: 200, background_cd_m2: 5, exposure: {kind: fixed, exposure_s: 0.0008}, noise: true}\n",
        "  night: {intensity_cd: 200, background_cd_m2: 5, exposure: {kind: fixed, exposure_s: 0.0008}, noise: true}\n  chart: {exposure: {kind: white_patch, level: 0.9}}\n",
    ),
}


@pytest.mark.parametrize("what", list(REORDERED))
def test_an_order_changes_nothing(study: Callable[..., Study], what: str) -> None:
    assert_same(values_of(study()), values_of(study(REORDERED[what])))


def in_unit(name: str, per_nm: float) -> pd.DataFrame:
    """Spectra whose wavelengths have another unit."""
    table = leds()
    return table.assign(wavelength_nm=per_nm * table["wavelength_nm"]).rename(columns={"wavelength_nm": name})


@pytest.mark.parametrize(
    "table",
    [
        leds()[["wavelength_nm", *sorted(leds().columns[1:], reverse=True)]],
        in_unit("wavelength_um", 1e-3),
        in_unit("wavelength_A", 10.0),
    ],
    ids=["another order", "micrometers", "angstroms"],
)
def test_another_order_or_unit_of_a_file_changes_nothing(study: Callable[..., Study], table: pd.DataFrame) -> None:
    assert_same(values_of(study()), values_of(study(table=table)))


def test_a_lamp_more_raises_no_separation_and_no_bound(study: Callable[..., Study]) -> None:
    one, more = (
        study(),
        study(
            ("red: [r1, r2, r3]}", "red: [r1, r2, r3, r4]}"), table=leds().assign(r4=np.exp(-(((WAVE - 615) / 8) ** 2)))
        ),
    )
    before, after = values_of(one), values_of(more)
    csds = [key for key in before.index if key[2].startswith(("csd_", "pixel_csd_", "dprime_", "chromatic_csd"))]
    assert len(csds) > 20
    assert (after[csds] <= before[csds] + 1e-9).all()
    assert (after[csds] < before[csds] - 1).any()


def test_each_is_a_list_of_scenarios(study: Callable[..., Study]) -> None:
    far = "  far: {target: {distance_m: 60, fov_deg: 60, phase_px: [0.3, 0.4]}, optics: {f_number: 2}}"
    each = study(
        (
            far,
            "  far: {target: {fov_deg: 60, phase_px: [0.3, 0.4]}, optics: {f_number: 2}, each: {target.distance_m: [60, 90]}}",
        )
    )
    listed = study((far, "\n".join(far.replace("far", f"far{m}").replace("60, fov", f"{m}, fov") for m in (60, 90))))
    a, b = values_of(each, without=("value", "target.distance_m")), values_of(listed)
    for m in (60, 90):
        assert_same(a.loc[f"far distance_m={m}"], b.loc[f"far{m}"])
