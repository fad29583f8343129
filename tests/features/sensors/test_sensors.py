"""Several sensors and lights in one study, measured curves, and curves that are not known exactly."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.integrate import trapezoid
from scipy.special import ndtr

from sweep.base.errors import StudyError
from sweep.camera.curve_errors import CurveErrors
from sweep.camera.sensor import BUILT_IN_SENSORS
from sweep.search.solver import smooth_evaluation
from sweep.spectra.builtin.data_sets.tl16 import lights
from sweep.spectra.builtin.measured_sets import SENSORS, WIDE
from sweep.spectra.spectrum import WavelengthGrid
from sweep.study import load_study, sensor_studies_in

from ...build import load, ran
from ...commanded import commanded
from ...conftest import MEASURED, draw_nothing

GRID = WavelengthGrid(start_nm=400, stop_nm=664, step_nm=1)


def own_csd(qe: np.ndarray, counts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Yellow/red CSD, DN, of a chart that is exposed for 95 % of the white patch, and mean QE of the tile, by own code.

    `qe` has shape (n, n_channels, n_wavelengths); the signals have K times the photons of an equal-energy white in photons.
    """
    tl16 = lights(GRID)
    light = np.array([tl16.photons[i] for i in range(len(tl16.names))])
    # [n, n_channels, n_signals]
    response = trapezoid(qe[:, :, None] * light) / trapezoid(light)
    mean = trapezoid(qe) / (qe.shape[2] - 1)
    white = mean.max(axis=1)
    dn = 0.95 * 4095 * tl16.photon_ratio * response / white[:, None, None]
    yellow, red = (dn[:, :, tl16.members[kind]] for kind in ("yellow", "red"))
    apart = np.sqrt(((yellow[..., :, None] - red[..., None, :]) ** 2).sum(axis=1))
    return apart.min(axis=(1, 2)), mean @ counts / counts.sum()


ERRORS = CurveErrors(gain=0.05, shift_nm=2.0, noise=0.03, correlation_nm=30.0, ir_cut_nm=3.0, draws=2000)


def own_draws(names: list[str], n: int, errors: CurveErrors, rng: np.random.Generator) -> np.ndarray:
    """Curves of opencam as the errors allow, ndarray[n, n_names, n_wavelengths], without the package's code."""
    raw = pd.read_csv(MEASURED / "qe_opencam.csv")
    wave, cut = GRID.nodes_nm, np.maximum(raw["ir_cut"].to_numpy(), 1e-3)
    moved = np.array([np.interp(wave - e, wave, cut) for e in errors.ir_cut_nm * rng.uniform(-1, 1, n)])
    values, vectors = np.linalg.eigh(np.exp(-0.5 * ((wave[:, None] - wave) / errors.correlation_nm) ** 2))
    root = vectors * np.sqrt(np.maximum(values, 0))
    curves = []
    for name in names:
        dye = raw[name].to_numpy() * raw["ir_cut"].to_numpy() / cut
        shift = errors.shift_nm * rng.uniform(-1, 1, n)
        noise = 1 + errors.noise * (2 * ndtr(rng.standard_normal((n, wave.size)) @ root.T) - 1)
        gain = 1 + errors.gain * rng.uniform(-1, 1, (n, 1))
        curves.append(np.array([np.interp(wave - s, wave, dye) for s in shift]) * noise * gain * moved)
    return np.stack(curves, axis=1)


def uncertain(folder: Path, errors: CurveErrors) -> pd.DataFrame:
    text = (
        "study: uncertain\nsensor: opencam\nlights: tl16\nwavelengths: {stop_nm: 664}\n"
        f"cfas: [RGGB, RYYCy]\nuncertainty: {errors.model_dump_json(exclude_none=True)}\n"
    )
    ran(load(folder, text), folder / "out", 1)
    table = pd.read_parquet(folder / "out" / "uncertainty.parquet")
    return table[table["quantity"] == "csd_yellow_red"].set_index("name")


def test_quantiles_are_those_of_brute_force(tmp_path: Path) -> None:
    """Of 12 quantiles by 20,000 draws of own code, 10 or more lie in the 95 % intervals, and all near them."""
    found, rng, n = uncertain(tmp_path, ERRORS), np.random.default_rng(11), 20_000
    names = ["R", "G", "B", "Y", "Cy"]
    parts = [own_draws(names, 2000, ERRORS, rng) for _ in range(n // 2000)]
    of = {"RGGB": ([0, 1, 2], [1.0, 2, 1]), "RYYCy": ([0, 3, 4], [1.0, 2, 1])}
    csd, light = {}, {}
    for cfa, (channels, counts) in of.items():
        both = [own_csd(part[:, channels], np.array(counts)) for part in parts]
        csd[cfa], light[cfa] = (np.concatenate(one) for one in zip(*both, strict=True))
    drawn: list[tuple[str, str, np.ndarray]] = [(cfa, "dn", csd[cfa]) for cfa in of]
    drawn += [("RYYCy", "ratio", csd["RYYCy"] / csd["RGGB"]), ("RYYCy", "light_ratio", light["RYYCy"] / light["RGGB"])]
    inside = []
    for cfa, what, values in drawn:
        for share in (5, 50, 95):
            own, row = np.quantile(values, share / 100), found.loc[cfa]
            low, high = row[f"{what}_{share}_low"], row[f"{what}_{share}_high"]
            inside.append(low <= own <= high)
            assert low - (high - low) <= own <= high + (high - low), (cfa, what, share)
    assert sum(inside) >= 0.8 * len(inside)
    row = found.loc["RYYCy"]
    assert row["ratio_sd"] == pytest.approx((csd["RYYCy"] / csd["RGGB"]).std(), rel=0.06)


def test_no_sensor_is_below_the_worst_case(tmp_path: Path) -> None:
    """With gains and noise alone, of 2,000 random sensors."""
    errors = ERRORS.model_copy(update={"shift_nm": 0.0, "ir_cut_nm": 0.0, "draws": 200})
    found, rng = uncertain(tmp_path, errors), np.random.default_rng(2)
    smallest = own_csd(own_draws(["R", "G", "B"], 2000, errors, rng), np.array([1.0, 2, 1]))[0].min()
    assert 0.5 * smallest < float(found.loc["RGGB", "at_least_dn"]) <= smallest
    (tmp_path / "moved").mkdir()
    assert np.isnan(uncertain(tmp_path / "moved", ERRORS.model_copy(update={"draws": 100}))["at_least_dn"]).all()


SEVERAL = """\
study: few
question: Does it hold?
wavelengths: {step_nm: 5}
sensors: [ar0820, opencam, ar0132at]
lights: [tl16, luxeon]
cfas:
  RGGB:
  RYNCy: {only: [ar0820, opencam]}
  RGBN: {tile: [[R, G], [B, N]], only: [ar0132*]}
designs:
  paper_N4: {cfa: RYNCy, channel: N, base: Y, to: G, at: paper_N4}
boxes:
  yellow:
    cfa: RYNCy
    channel: N
    base: Y
    to: G
    box: &edges {left_nm: [570, 640], left_width_nm: 8, right_nm: [630, 700], right_width_nm: 8}
  clear: {cfa: RGBN, channel: N, base: C, to: G, box: *edges}
uncertainty: {gain: 0.03, draws: 200}
constraints: {sensitivity: {min: 0.9}}
search: {starts: 2, max_evaluations: 60}
"""


@pytest.fixture(scope="module")
def several(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("several")
    (folder / "few.yaml").write_text(SEVERAL)
    with pytest.MonkeyPatch.context() as patch:
        draw_nothing(patch)
        code, out, err = commanded("run", folder / "few.yaml", "--output", folder / "out", "--jobs", 1)
    assert code == 0, err
    assert "ar0132at: without RYNCy, paper_N4, yellow" in out
    return folder


def test_one_table_has_all_sensors_and_lights(several: Path) -> None:
    rows = pd.read_parquet(several / "out" / "few" / "results.parquet")
    assert len(rows.groupby(["sensor", "lights"])) == 6
    for (sensor, light), part in rows.groupby(["sensor", "lights"], sort=False):
        alone = pd.read_parquet(several / "out" / "few" / f"{sensor}_{light}" / "results.parquet")
        np.testing.assert_array_equal(part["csd_yellow_red"], alone["csd_yellow_red"])
        found = part[part["kind"] == "search"].iloc[0]
        assert found["cfa"] == ("RGBN" if sensor == "ar0132at" else "RYNCy")


def test_filters_for_several_sensors_are_the_worst_on_them(several: Path) -> None:
    table = pd.read_parquet(several / "out" / "few" / "all_sensors.parquet")
    assert set(table["designed_on"]) == {"all sensors", "all but ar0820", "all but opencam"}
    members = {f"{m.sensor} {m.lights}": m for m in sensor_studies_in(several / "few.yaml").members}
    for row in table.to_dict("records"):
        study = load_study(several / "few.yaml", member=members[f"{row['sensor']} {row['lights']}"])
        values = dict(part.rsplit(" ", 1) for part in row["parameters"].split(", "))
        x = np.array([float(values[name]) for name in study.search.space.parameters])
        here = smooth_evaluation(study.problem(study.search), x)
        assert here.objective == pytest.approx(row["objective"], rel=2e-3)
        if not row["judged"]:
            assert row["violation"] == 0
            assert row["sensitivity"] >= 0.9 - 1e-6
            assert row["objective"] <= row["own_best"] * 1.02  # its search may end elsewhere
    # What is designed on more sensors is no better on the worst of fewer.
    of_fewer = table[table["sensor"] == "opencam"].groupby("designed_on")["objective"].min()
    assert of_fewer["all but ar0820"] >= of_fewer["all sensors"] * 0.98


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        ("opencam, ar0132at]", "opencm]", "few.yaml:4: sensor: opencm: unknown"),
        ("opencam, ar0132at]", "ar0820]", "few.yaml:4: sensors: one is named twice"),
        ("[ar0820, opencam, ar0132at]", "[]", "few.yaml:4: sensors: an empty list"),
        ("sensors: [ar0820", "sensor: ar0820\nsensors: [ar0820", "sensors: beside `sensor`"),
        ("base: C, to: G, box", "base: CC, to: G, box", "boxes.clear.base"),
        ("only: [ar0132*]", "only: [ar0133at]", "few.yaml:9: cfas.RGBN.only[0]: unknown sensor"),
        ("{only: [ar0820, opencam]}", "", "few.yaml:11: designs.paper_N4.base: ar0132at: unknown curve"),
        ("opencam]}\n", "opencam]}\n  RYYCy:\n", "cfas.RYYCy: ar0132at: no curve for channel 'Y'; allowed: `only: [S"),
    ],
)
def test_a_mistake_is_one_line(tmp_path: Path, old: str, new: str, line: str) -> None:
    assert old in SEVERAL
    path = tmp_path / "few.yaml"
    path.write_text(SEVERAL.replace(old, new))
    code, _, err = commanded("run", path, "--output", tmp_path / "out", "--jobs", 1, "--quiet")
    assert (code, line in err) == (2, True), err


def test_one_that_fails_does_not_stop_the_others(tmp_path: Path) -> None:
    """No CFA with opencam's yellow pixels has 0.55 of a clear sensor's light; ar0820's have."""
    text = SEVERAL.replace("[tl16, luxeon]", "tl16").replace("[ar0820, opencam, ar0132at]", "[opencam, ar0820]")
    path = tmp_path / "few.yaml"
    path.write_text(
        text.replace("{sensitivity: {min: 0.9}}", "{sensitivity: {min: 0.9}, cfa_sensitivity: {min: 0.55}}")
    )
    code, _, err = commanded("run", path, "--output", tmp_path / "out", "--jobs", 1)
    assert (code, "out of reach: cfa_sensitivity" in err) == (3, True)
    rows = pd.read_parquet(tmp_path / "out" / "few" / "results.parquet")
    assert set(rows["sensor"]) == {"ar0820"}


def test_uncertain_curves_of_thin_layers_are_refused(tmp_path: Path) -> None:
    text = SEVERAL.replace("[ar0820, opencam, ar0132at]", "[ar0132at]").replace("[tl16, luxeon]", "tl16")
    text = text.replace("gain: 0.03", "gain: 0.03, ir_cut_nm: 2")
    load(tmp_path, text)
    moving = text.replace("base: C, to: G", "base: C, to: G, technology: {interference: {effective_index: 1.8}}")
    with pytest.raises(StudyError, match="uncertainty: of filters that do not move with the angle of the light"):
        load(tmp_path, moving)


def test_other_commands_say_how_to_choose_one(tmp_path: Path) -> None:
    path = tmp_path / "few.yaml"
    path.write_text(SEVERAL)
    with pytest.raises(StudyError, match=r"--set sensors=\[ar0820\] --set lights=\[tl16\]"):
        load_study(path)
    assert load_study(path, changes={"sensors": "[opencam]", "lights": "tl16"}).grid.stop_nm == 660
    assert [commanded(command, path)[0] for command in ("check", "plan")] == [0, 2]


def test_a_plain_run_is_not_overwritten(tmp_path: Path) -> None:
    plain = SEVERAL.replace("sensors: [ar0820, opencam, ar0132at]", "sensor: ar0820").replace("[tl16, luxeon]", "tl16")
    path, told = tmp_path / "few.yaml", ("--output", tmp_path / "out", "--jobs", 1)
    path.write_text(plain.split("search:")[0])
    assert commanded("run", path, *told, "--quiet")[0] == 0
    path.write_text(SEVERAL)
    code, out, err = commanded("run", path, *told, "--dry-run")
    assert (code, "few holds another study" in err, "few-2" in out) == (0, True, True)


@pytest.mark.parametrize("name", SENSORS)
def test_a_measured_sensor_has_its_brightest_curve_for_clear(name: str) -> None:
    sensor = BUILT_IN_SENSORS[name](GRID)
    assert sensor.qe[sensor.clear].sum() == pytest.approx(
        max(q.sum() for n, q in sensor.qe.items() if n not in WIDE), rel=0.02
    )
