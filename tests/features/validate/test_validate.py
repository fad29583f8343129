"""Readings of simulated cameras against their studies."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from scipy.stats import kstest

import sweep
from sweep.base.errors import SweepError
from sweep.camera.noise.moments import moments
from sweep.camera.pixel import Pixel
from sweep.features.validate.bench import UNKNOWNS, Fit
from sweep.features.validate.from_study import bench_of
from sweep.features.validate.readings import read_readings

from ...build import one_line
from ...commanded import commanded
from . import simulated
from .simulated import Camera, write_readings, write_study

AS_IT_IS = Camera(0.42, 171.3, 4.0, 0.05, 2.7)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("bench")
    write_study(made)
    write_readings(made, AS_IT_IS.readings(np.random.default_rng(1)))
    return made


@pytest.fixture(scope="module")
def study(folder: Path) -> sweep.LoadedStudy:
    return sweep.load_study(folder / "bench.yaml")


def facts_of(study: sweep.LoadedStudy, camera: Camera, seed: list[int], folder: Path) -> Any:
    file = write_readings(folder, camera.readings(np.random.default_rng(seed)))
    return sweep.validate(study, file, output=folder / "out").facts


def test_a_camera_that_is_as_modeled_is_found_to_be_so(study: sweep.LoadedStudy, folder: Path, tmp_path: Path) -> None:
    answer = sweep.validate(study, folder / "readings.csv", output=tmp_path)
    facts = answer.facts
    assert facts["p"] > 0.01
    assert facts["mends_most"] is None
    assert "no reason to doubt the model" in answer.lines[0]
    for name in UNKNOWNS:
        found = facts["unknowns"][name]
        assert found["low"] < getattr(AS_IT_IS, name) < found["high"]
        assert found["high"] - found["low"] < 0.1 * getattr(AS_IT_IS, name)
    apart = facts["separation"]
    assert apart["types"] == ("yellow", "red")
    assert apart["measured_dn"] == pytest.approx(apart["predicted_dn"], abs=2 * apart["half_width_dn"])
    rows = pd.read_parquet(tmp_path / "validation.parquet")
    assert len(rows) == 84
    assert (rows["left_out"] == "").all()
    np.testing.assert_allclose(rows["predicted_dn"], rows["dn"], atol=1.5)
    assert "Predicted over measured" in (tmp_path / "validation.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("wrong", "about_nm", "sign"), [({"high": 0.08}, (620, 660), 1), ({"moved_nm": 6}, (560, 600), -1)]
)
def test_the_wrong_curve_is_named(
    study: sweep.LoadedStudy, tmp_path: Path, wrong: dict[str, float], about_nm: tuple[float, float], sign: int
) -> None:
    write_study(tmp_path)
    facts = facts_of(study, Camera(0.42, 171.3, 4.0, 0.05, 2.7, **wrong), [2], tmp_path)
    assert facts["p"] < 1e-6
    assert facts["mends_most"]["channel"] == "R"
    assert about_nm[0] <= facts["mends_most"]["middle_nm"] <= about_nm[1]
    assert np.sign(facts["mends_most"]["change"]) == sign


@pytest.mark.slow
def test_statistics_of_eighty_cameras(study: sweep.LoadedStudy, tmp_path: Path) -> None:
    """Forty as modeled but for their unknowns: p is uniform, intervals cover 95 %. Forty with a wrong R: it is named."""
    write_study(tmp_path)
    p, covered, named = list[float](), list[bool](), 0
    for number in range(40):
        rng = np.random.default_rng([5, number])
        numbers = [rng.uniform(*ends) for ends in ((0.3, 0.6), (80, 300), (-8, 8), (0.01, 0.12), (1.5, 5))]
        camera = Camera(*numbers)
        facts = facts_of(study, camera, [6, number], tmp_path)
        p.append(facts["p"])
        for name, found in facts["unknowns"].items():
            covered.append(found["low"] <= getattr(camera, name) <= found["high"])
        wrong = {"high": 0.08} if number % 2 else {"moved_nm": 6.0 if number % 4 else -6.0}
        facts = facts_of(study, Camera(*numbers, **wrong), [7, number], tmp_path)
        named += facts["mends_most"] is not None and facts["mends_most"]["channel"] == "R"
    assert np.mean(np.array(p) >= 0.01) >= 0.95
    assert kstest(p, "uniform").pvalue > 0.01
    assert 0.90 <= np.mean(covered) <= 0.98
    assert named >= 36


def test_moments_are_those_of_the_readout() -> None:
    """Gain, black level and noise of readings that count, against exact sums over the electrons."""
    pixel = Pixel(gain_dn_per_e=0.4, offset_dn=160, read_noise_e=2.5)
    electrons = np.array([5.0, 300, 6000])
    mean, rounded, variance = moments(electrons, pixel)
    np.testing.assert_allclose(rounded, 0.4 * electrons + 160, atol=1e-3)
    np.testing.assert_allclose(variance, 0.16 * (electrons + 2.5**2) + 1 / 12, rtol=1e-3)
    np.testing.assert_allclose(mean, rounded, atol=1e-3)


def test_single_pixels_and_stated_light(study: sweep.LoadedStudy, folder: Path, tmp_path: Path) -> None:
    """The green of a row of reds reads as the channel; light that is stated tells the gain without noise."""
    table = pd.read_csv(folder / "readings.csv")
    pixels = {"R": (0, 0), "G": (0, 1), "B": (1, 1)}
    placed = table.assign(
        row=[pixels[name][0] for name in table["channel"]], column=[pixels[name][1] for name in table["channel"]]
    )
    as_pixels = sweep.validate(study, _saved(folder, placed.drop(columns="channel")), output=tmp_path).facts
    as_channels = sweep.validate(study, folder / "readings.csv", output=tmp_path).facts
    assert as_pixels["chi2"] == pytest.approx(as_channels["chi2"])
    watts = 0.02
    photons = watts / (6.62607015e-34 * 299792458 / 592e-9)
    area_m2, seen = (2.1e-6) ** 2, 0.5
    dn = 160 + 0.41 * photons * area_m2 * seen * 0.01
    curve = pd.DataFrame({"nm": [400, 591, 592, 593, 720], "line": [0, 0, 1, 0, 0]})
    curve.to_csv(folder / "line.csv", index=False)
    flat = sweep.make_study(
        sensor=sweep.sensor(pd.DataFrame({"M": [seen, seen]}, index=[400, 720]), clear="M"),
        cfas={"mono": {"tile": [["M"]]}},
        wavelengths={"stop_nm": 700},
    )
    stated = pd.DataFrame(
        {
            "lamp": ["dark", "line.csv:line", "line.csv:line"],
            "channel": "M",
            "exposure_ms": [10.0, 10.0, 10.0],
            "dn": [160, dn, dn],
            "pixels": 10**6,
            "irradiance (uW/cm2)": [np.nan, 100 * watts, 100 * watts],
        }
    )
    found = sweep.validate(flat, _saved(folder, stated), hold=["crosstalk"], output=tmp_path).facts
    assert found["unknowns"]["gain"]["value"] == pytest.approx(0.41, rel=1e-5)


def _saved(folder: Path, table: pd.DataFrame) -> Path:
    table.to_csv(folder / "changed.csv", index=False)
    return folder / "changed.csv"


def test_corrected_curves_are_the_fitted_camera(study: sweep.LoadedStudy, folder: Path, tmp_path: Path) -> None:
    file = tmp_path / "corrected.csv"
    answer = sweep.validate(study, folder / "readings.csv", output=tmp_path, corrected=file)
    curves = sweep.read_curves(file)
    shift_nm = answer.facts["unknowns"]["shift"]["value"]
    expected = simulated.qe()["R"] * simulated.ir_cut(shift_nm)
    np.testing.assert_allclose(curves["R"][5:], expected[5:], rtol=1e-4)
    assert re.search(r"`pixel: \{gain_dn_per_e: 0\.42\d+, offset_dn: 171\.\d+, crosstalk: 0\.0\d+\}`", answer.lines[-1])


def test_readings_near_both_ends_are_left_out(study: sweep.LoadedStudy, folder: Path, tmp_path: Path) -> None:
    table = pd.read_csv(folder / "readings.csv")
    table.loc[3, ["dn", "sigma_dn"]] = 4095, 0
    table.loc[4, "dn"] = 2
    facts = sweep.validate(study, _saved(folder, table), output=tmp_path).facts
    assert facts["left_out"] == {"near full scale": 1, "near 0 DN": 1}
    assert facts["p"] > 0.01


def fits(study: sweep.LoadedStudy, table: pd.DataFrame, file: Path) -> Fit:
    """The fit of readings, without a page."""
    table.to_csv(file, index=False)
    return bench_of(study.study, *read_readings(file), None, ()).fitted()


def true_noise_dn(table: pd.DataFrame) -> pd.Series:
    """Noise of the camera as it is."""
    return np.sqrt(AS_IT_IS.gain * (table["dn"] - AS_IT_IS.black) + (AS_IT_IS.gain * AS_IT_IS.read_noise) ** 2 + 1 / 12)


def test_noise_over_two_frames_has_half_the_freedom(study: sweep.LoadedStudy, folder: Path) -> None:
    """Means of two frames of 500 pixels have 1,000 values, and their noise 500 differences."""
    table, rng, found = pd.read_csv(folder / "readings.csv"), np.random.default_rng(8), list[Fit]()
    noise = true_noise_dn(table)
    for _ in range(12):
        dn = table["dn"] + noise * rng.normal(size=len(table)) * np.sqrt(1 / 1000 - 1 / simulated.PIXELS)
        spread = noise * np.sqrt(rng.chisquare(500, len(table)) / 500)
        drawn = table.assign(dn=dn, sigma_dn=spread, pixels=500, frames=2)
        found.append(fits(study, drawn, folder / "changed.csv"))
    assert min(fit.p for fit in found) > 1e-3
    assert sum(fit.chi2 for fit in found) == pytest.approx(sum(fit.freedom for fit in found), rel=0.08)


@pytest.mark.slow
def test_few_pixels_shift_no_gain(study: sweep.LoadedStudy, folder: Path) -> None:
    """A noise of few values is as often too large as too small; the gain is no larger for it."""
    table, rng, gains = pd.read_csv(folder / "readings.csv"), np.random.default_rng(9), list[float]()
    noise = true_noise_dn(table)
    for _ in range(14):
        spread = noise * np.sqrt(rng.chisquare(9, len(table)) / 9)
        dn = table["dn"] + noise * rng.normal(size=len(table)) * np.sqrt(1 / 10 - 1 / simulated.PIXELS)
        gains.append(fits(study, table.assign(dn=dn, sigma_dn=spread, pixels=10), folder / "changed.csv").unknowns[1])
    assert np.mean(gains) == pytest.approx(AS_IT_IS.gain, rel=0.03)


def test_a_pixel_that_fills_before_the_study_says(study: sweep.LoadedStudy, tmp_path: Path) -> None:
    """The gain is lower than the study's, so that full pixels are below what it takes for full scale."""
    write_study(tmp_path)
    table = Camera(0.28, 171.3, 4.0, 0.05, 2.7).readings(np.random.default_rng(3))
    more = table[table["lamp"] == "white"].assign(exposure_s=0.05, dn=round(0.28 * 10000 + 171.3), sigma_dn=0.8)
    facts = sweep.validate(study, write_readings(tmp_path, pd.concat([table, more])), output=tmp_path / "out").facts
    assert facts["left_out"]["near full scale"] == 9
    assert facts["p"] > 0.01


def test_the_template_is_a_table_without_numbers(study: sweep.LoadedStudy, tmp_path: Path) -> None:
    answer = sweep.bench_template(study, tmp_path / "new.csv")
    table = pd.read_csv(tmp_path / "new.csv")
    assert set(table["lamp"]) == {"dark", *study.study.lights.names}
    assert str(len(table)) in answer.lines[0]
    with one_line("new.csv:2: dn: cannot be used, and 29 more like it"):
        sweep.validate(study, tmp_path / "new.csv", output=tmp_path)
    with one_line("is there already"):
        sweep.bench_template(study, tmp_path / "new.csv")


def test_the_command(folder: Path, tmp_path: Path) -> None:
    study, readings = folder / "bench.yaml", folder / "readings.csv"
    code, out, _ = commanded("validate", study, readings, "--output", tmp_path)
    assert (code, "Separation yellow/red of these lamps in chart" in out) == (0, True)
    code, _, said = commanded("validate", study, readings, "--hold", "gian")
    assert (code, "did you mean 'gain'?" in said) == (2, True)
    code, _, said = commanded("validate", study)
    assert (code, "READINGS: missing" in said) == (2, True)
    assert commanded("validate", study, "--template", tmp_path / "new.csv")[0] == 0


def _set(column: str, row: int, value: object) -> Callable[[pd.DataFrame], pd.DataFrame]:
    """A table with one other cell."""

    def changed(table: pd.DataFrame) -> pd.DataFrame:
        table = table.astype({column: object})
        table.loc[row, column] = value
        return table

    return changed


def _named(old: str, new: str) -> Callable[[pd.DataFrame], pd.DataFrame]:
    return lambda table: table.rename(columns={old: new})


def _filled(column: str, value: object) -> Callable[[pd.DataFrame], pd.DataFrame]:
    return lambda table: table.assign(**{column: value})


def _without(column: str) -> Callable[[pd.DataFrame], pd.DataFrame]:
    return lambda table: table.drop(columns=column)


def _exchanged(one: str, other: str) -> Callable[[pd.DataFrame], pd.DataFrame]:
    return lambda table: table.assign(channel=table["channel"].replace({one: other, other: one}))


def _one_exposure(table: pd.DataFrame) -> pd.DataFrame:
    return table[(table["lamp"] != "dark") & (table["exposure_s"] == 0.01)]


DAMAGED: dict[str, tuple[Callable[[pd.DataFrame], pd.DataFrame], str]] = {
    **{f"head {new}": (_named(old, new), "csv:1: " + said) for old, new, said in (
        ("exposure_s", "exposure", "exposure: unknown column; did you mean 'exposure_s'?"),
        ("exposure_s", "exposure (min)", "exposure (min): unknown column"),
        ("exposure_s", "integration time", "integration time: unknown column"),
        ("dn", "dn (V)", "dn (V): unknown column"),
        ("dn", "electrons", "electrons: unknown column"),
        ("dn", "mean", "mean: unknown column"),
        ("sigma_dn", "sigma (e)", "sigma (e): unknown column"),
        ("sigma_dn", "variance", "variance: unknown column"),
        ("pixels", "pixel", "pixel: unknown column; did you mean 'pixels'?"),
        ("lamp", "lam", "lam: unknown column; did you mean 'lamp'?"),
        ("lamp", "light", "light: unknown column"),
        ("channel", "chanel", "chanel: unknown column; did you mean 'channel'?"),
        ("channel", "color", "color: unknown column"),
        ("pixels", "irradiance (lx)", "irradiance (lx): unknown column"),
        ("pixels", "irradiance", "irradiance: unknown column"),
        ("sigma_dn", "DN", "dn: column occurs twice"),
        ("pixels", "exposure (ms)", "exposure_s: column occurs twice"),
        ("pixels", "", "unknown column"),
    )},
    **{f"no {column}": (_without(column), f"csv:1: {column}: no such column") for column in ("lamp", "channel", "exposure_s", "dn")},
    **{f"{column} {value}": (_set(column, 5, value), f"csv:7: {column}: {said}") for column, value, said in (
        ("dn", "", "cannot be used"),
        ("dn", "NaN", "cannot be used"),
        ("dn", "n/a", "cannot be used"),
        ("dn", "1.2.3", "cannot be used"),
        ("dn", "saturated", "cannot be used"),
        ("dn", -3, "cannot be used"),
        ("dn", "inf", "cannot be used"),
        ("dn", "1e999", "cannot be used"),
        ("dn", "0x20", "cannot be used"),
        ("exposure_s", "", "cannot be used"),
        ("exposure_s", 0, "cannot be used"),
        ("exposure_s", -0.01, "cannot be used"),
        ("exposure_s", "10 ms", "cannot be used"),
        ("exposure_s", "nan", "cannot be used"),
        ("sigma_dn", -1, "cannot be used"),
        ("sigma_dn", "high", "cannot be used"),
        ("pixels", 0, "cannot be used"),
        ("pixels", 2.5, "cannot be used"),
        ("pixels", "many", "cannot be used"),
        ("lamp", "", "missing"),
        ("lamp", "leds:led593", "unknown lamp (got 'leds:led593'); did you mean 'leds:led592'?"),
        ("lamp", "white", "unknown lamp (got 'white')"),
        ("lamp", "none.csv:white", "unknown lamp (got 'none.csv:white')"),
        ("channel", "", "missing"),
        ("channel", "Y", "unknown channel (got 'Y')"),
        ("channel", "r", "unknown channel (got 'r'); did you mean 'R'?"),
    )},
    "no such column of a file": (_set("lamp", 5, "leds.csv:led593"), "leds.csv: no such column (got 'led593'); did you mean 'led592'?"),
    "not a light": (_set("lamp", 5, "cut.csv:transmission"), "transmission is no energy of a light"),
    "unknown scene": (_filled("scene", "night"), "csv:2: scene: unknown scene (got 'night'); allowed: chart"),
    "two irradiances": (lambda t: t.assign(**{"irradiance (W/m2)": 1, "irradiance (photons/s/m2)": 1}), "two columns of irradiance"),
    "too bright": (lambda t: t.assign(**{"irradiance (W/m2)": 1e300}), "cannot be used"),
    "pixel outside the tile": (lambda t: t.assign(row=2, column=0).drop(columns="channel"), "unknown channel (got '2, 0')"),
    "few": (lambda t: t[t["lamp"] == "leds.csv:led430"][:3], "as many unknowns as readings: nothing is left to check"),
    "no dark, one exposure": (_one_exposure, "black: the readings do not tell the black level"),
    "no noise": (_without("sigma_dn"), "gain: the readings do not tell the gain"),
    "no number of pixels": (_without("pixels"), "gain: the readings do not tell the gain"),
    "no noise in numbers": (_filled("sigma_dn", 0), "gain: the readings do not tell the gain"),
    "all full": (_filled("dn", 4095), "csv:1: dn: all readings are near full scale or near 0 DN"),
    "all dark": (_filled("dn", 0), "csv:1: dn: all readings are near full scale or near 0 DN"),
    "shares of full scale": (lambda t: t.assign(dn=t["dn"] / 4095, sigma_dn=t["sigma_dn"] / 4095), "all readings are near"),
    "no rows": (lambda t: t[:0], "csv:1: no readings"),
    "only dark": (lambda t: t[t["lamp"] == "dark"], "the readings do not tell"),
    "R and B exchanged": (_exchanged("R", "B"), "R and B look exchanged: so their readings fit"),
    "R and G exchanged": (_exchanged("R", "G"), "R and G look exchanged: so their readings fit"),
    "G and B exchanged": (_exchanged("G", "B"), "G and B look exchanged: so their readings fit"),
}  # fmt: skip


@pytest.mark.parametrize("damage", DAMAGED)
def test_a_damaged_table_is_one_line(study: sweep.LoadedStudy, folder: Path, tmp_path: Path, damage: str) -> None:
    change, said = DAMAGED[damage]
    table = change(pd.read_csv(folder / "readings.csv"))
    with pytest.raises(SweepError) as caught:
        sweep.validate(study, _saved(folder, table), output=tmp_path / "out")
    lines = [str(issue) for issue in caught.value.issues]
    assert any(said in line for line in lines), lines
    assert len(lines) == 1 or damage == "only dark", lines
    assert not (tmp_path / "out").exists()
