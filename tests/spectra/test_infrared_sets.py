"""Near infrared: modeled filament signals, measured LEDs, tiles with infrared pixels, and the study of IR cuts."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.integrate import trapezoid

from sweep.camera.mosaic import Mosaic
from sweep.camera.sensor import BUILT_IN_SENSORS
from sweep.spectra.builtin.registry import BUILT_IN_LIGHTS
from sweep.spectra.color import REGIONS, SIGNAL_REGIONS, chromaticity
from sweep.spectra.signal_color import VISIBLE, light_color
from sweep.spectra.spectrum import WavelengthGrid
from sweep.study import load_study

from ..build import ran
from ..conftest import STUDIES

MEASURED = Path(__file__).parents[2] / "sweep" / "spectra" / "builtin" / "measured"


def test_filament_signals_have_the_colors_of_the_norm_and_planck_s_infrared() -> None:
    grid = WavelengthGrid(start_nm=380, stop_nm=1080, step_nm=1)
    lights = BUILT_IN_LIGHTS["filament"](grid)
    for kind, xy in zip(lights.types, chromaticity(grid, lights.photons), strict=True):
        assert REGIONS[kind].violation(xy[None])[0] <= 0
    wave = grid.nodes_nm
    photons = wave**-4 / np.expm1(6.62607015e-34 * 299792458 / (wave * 1e-9 * 1.380649e-23 * 2856))
    behind = lights.photons[lights.names.index("red_2856K")]
    clear = wave > 850
    np.testing.assert_allclose(behind[clear] / behind[-1], photons[clear] / photons[-1], rtol=1e-4)


def test_filaments_keep_their_infrared_where_others_end(tmp_path: Path) -> None:
    text = (STUDIES / "infrared.yaml").read_text()
    (tmp_path / "infrared_cuts.csv").write_text((STUDIES / "infrared_cuts.csv").read_text())
    ends = {}
    for name in ("filament", "luxeon", "led_benkner", "tl16"):
        path = tmp_path / f"{name}.yaml"
        path.write_text(text.replace("lights: filament", f"lights: {{builtin: {name}, outside: zero}}"))
        lights = load_study(path).lights
        ends[name] = 400 + 5 * int(np.flatnonzero(lights.photons.sum(axis=0)).max())
    assert ends == {"filament": 1000, "luxeon": 695, "led_benkner": 700, "tl16": 700}


def test_measured_leds_are_those_of_their_file() -> None:
    grid = WavelengthGrid()
    lights = BUILT_IN_LIGHTS["led_benkner"](grid)
    raw = pd.read_csv(MEASURED / "led_benkner.csv").set_index("wavelength_nm").loc[grid.nodes_nm]
    for name in ("green_1", "red_1", "red_2", "red_3"):
        photons = raw[name].to_numpy() * grid.nodes_nm
        np.testing.assert_allclose(lights.photons[lights.names.index(name)], photons / trapezoid(photons), rtol=1e-12)
    colors = dict(zip(lights.names, chromaticity(grid, lights.photons), strict=True))
    inside = {name: bool(SIGNAL_REGIONS["en_12368"]["red"].violation(colors[name][None])[0] <= 0) for name in colors}
    assert (inside["red_1"], inside["red_2"], inside["red_3"]) == (True, True, False)


def test_lamps_of_the_surrogate_that_ite_forbids() -> None:
    grid = WavelengthGrid()
    lights = BUILT_IN_LIGHTS["tl16"](grid)
    colors, outside = chromaticity(grid, lights.photons), {}
    for kind in ("yellow", "red"):
        ours = [at for at, name in enumerate(lights.names) if name.startswith("us_") and name.endswith(kind)]
        outside[kind] = int((SIGNAL_REGIONS["ite"][kind].violation(colors[ours]) > 0).sum()), len(ours)
    assert outside == {"yellow": (2, 11), "red": (3, 11)}


def test_a_green_lamp_may_have_the_color_of_a_marker_lamp() -> None:
    """Monochromatic light by the CIE's table: greens of EN 12368 from 495 to 498 nm are blue-green of J578, too."""
    cie = pd.read_csv(MEASURED.parent / "cie_1931.csv", header=None, skiprows=1).to_numpy()
    both = []
    for nm, *xyz in cie[:, :4]:
        x, y = (value / sum(xyz) for value in xyz[:2])
        green = y <= 0.726 - 0.726 * x and x <= 0.625 * y - 0.041 and y >= 0.4
        photons = (VISIBLE.nodes_nm == nm).astype(float)
        color = light_color(photons)
        assert color is not None
        assert (color.region == "green") == green
        assert bool(color.markers) == (y <= 0.5 - 0.5 * x and x <= 0.2 and y >= 0.32)
        both += [nm] * bool(green and color.markers)
    assert (min(both), max(both)) == (495, 498)


def test_wide_pixels_are_the_sum_of_measured_ones() -> None:
    grid = WavelengthGrid(step_nm=5)
    sensor = BUILT_IN_SENSORS["rawtoaces/Canon_EOS_5D"](grid)
    total = sum(sensor.qe[channel] for channel in "RGB")
    np.testing.assert_allclose(sensor.qe["Wsum"], total, rtol=1e-14)
    raw, wave = pd.read_csv(MEASURED / "rawtoaces_cameras.csv"), np.arange(380.0, 781)
    measured = [np.interp(wave, raw["wavelength_nm"], raw[f"Canon_EOS_5D:{channel}"]) / wave for channel in "RGB"]
    unscaled = np.sum(measured, axis=0)
    there = np.interp(grid.nodes_nm, wave, unscaled)
    np.testing.assert_allclose(sensor.qe["Wide"], there / unscaled.max(), rtol=1e-6)
    narrow = BUILT_IN_SENSORS["rawtoaces/Canon_EOS_5D"](WavelengthGrid(start_nm=600))
    assert narrow.qe["Wide"][0] == pytest.approx(sensor.qe["Wide"][40], rel=1e-12)
    assert sensor.clear in "RGB"
    assert not sensor.has_clear


def test_a_tile_with_infrared_pixels_repeats_after_four() -> None:
    mosaic = Mosaic.from_name("RGBIR")
    assert dict(zip(mosaic.channels, mosaic.counts, strict=True)) == {"B": 2, "G": 8, "R": 2, "I": 4}


def test_leaks_of_an_ir_cut_are_those_of_own_code(tmp_path: Path) -> None:
    """Ratios of yellow/red and green/yellow CSDs of lamps of equal luminous intensity, and the guide's table."""
    ran(load_study(STUDIES / "infrared.yaml"), tmp_path / "out", 1)
    found = pd.read_parquet(tmp_path / "out" / "results.parquet").set_index("name")
    wave = np.arange(400.0, 1001, 5)
    raw = pd.read_csv(MEASURED / "qe_mt9v024_rgbw.csv")
    rgb = np.array([np.interp(wave, raw["wavelength_nm"], raw[channel]) for channel in "RGB"])
    cie = pd.read_csv(MEASURED.parent / "cie_1931.csv", header=None, skiprows=1).to_numpy()
    efficiency = np.interp(wave, cie[:, 0], cie[:, 2], right=0.0)

    def passes(edge_nm: float) -> np.ndarray:
        return 1 / (1 + np.exp(-(wave - edge_nm) / 8))

    lamps: dict[str, list[np.ndarray]] = {}
    for kind, visible in {
        "green": passes(480) * (1 - passes(530)),
        "yellow": passes(558),
        "red": passes(621),
    }.items():
        for kelvin in (2400, 2856, 3200):
            photons = np.maximum(visible, passes(750)) * wave**-4 / np.expm1(1.438776877e7 / (wave * kelvin))
            lamps.setdefault(kind, []).append(photons / ((photons / wave) @ efficiency))
    leaks = {"RGGB": 0.0, "leak of 1 %": 0.01, "leak of 3 %": 0.03, "leak of 10 %": 0.1, "no IR cut": 1.0}
    own = {}
    for name, leak in leaks.items():
        cut = np.interp(wave, [680, 720], [1.0, leak])
        points = {kind: np.array([(rgb * cut) @ lamp for lamp in spectra]) for kind, spectra in lamps.items()}
        for a, b in (("yellow", "red"), ("green", "yellow")):
            apart = np.linalg.norm(points[a][:, None] - points[b], axis=-1).min()
            own[name, f"csd_{a}_{b}"] = float(apart)
    for (name, column), value in own.items():
        of_ours = found.loc[name, column] / found.loc["RGGB", column]
        assert of_ours == pytest.approx(value / own["RGGB", column], rel=0.015), (name, column)
    guide = (STUDIES / "guide" / "12-sensors.md").read_text()
    table = re.findall(r"^\| [^|]* \| ([\d.]+) \| ([\d.]+) \|$", guide[guide.index("## Near infrared") :], re.MULTILINE)
    for name, cells in zip((*leaks, "RGBIR"), table, strict=True):
        for pair, cell in zip(("yellow_red", "green_yellow"), cells, strict=True):
            assert f"{found.loc[name, f'chromatic_csd_{pair}']:.3g}" == cell
