"""Figures that no hardware has: one line, or numbers that are finite; nothing between."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from copy import deepcopy
from dataclasses import replace
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from ruamel.yaml import YAML

from sweep.base.errors import StudyError
from sweep.runs.rows import Job, Rows, rows_of, rules_of
from sweep.spectra.color import chromaticity, display_colors
from sweep.spectra.spectrum import WavelengthGrid
from sweep.study import Study, load_study

from ..build import one_line
from ..mutations import at
from ..watchdog import within

HANG_S = 120.0
# Every number that a study can say of pixel, optics, scene, exposure and noise.
PATCH = """\
photon_radiance: 2.0e+18
off_axis_deg: 5.0
exposure: {kind: white_patch, level: 0.95, photon_ratio: 0.08}
optics: {f_number: 4.0, transmission: 0.9, cra_deg: 12.0}
noise: {read_noise_e: 3.0, dark_e_per_s: 2.0, prnu: 0.02}
"""
ROAD = """\
intensity_cd: 200.0
exposure: {kind: fixed, exposure_s: 0.004}
optics: {f_number: 2.0, focus_m: 90.0, transmission: 0.9}
target: {distance_m: 100.0, fov_deg: 60.0, width_px: 3840, diameter_m: 0.2, phase_px: [0.25, 0.5]}
off_axis_deg: 10.0
visibility_m: 500.0
background_cd_m2: 10.0
drive: {duty: 0.5, frequency_hz: 90.0}
noise: {read_noise_e: 3.0, dark_e_per_s: 2.0, prnu: 0.02}
"""
STUDY = """\
study: all
sensor: ar0820
lights: tl16
wavelengths: {start_nm: 400.0, stop_nm: 700.0, step_nm: 10.0}
pixel: {pitch_um: 2.1, fill_factor: 0.9, well_e: 10000.0, bits: 12, gain_dn_per_e: 0.4, offset_dn: 0.5, crosstalk: 0.01,
  read_noise_e: 2.0, dark_e_per_s: 5.0, prnu: 0.01}
tolerance_dn: 1.0
geometry: {far: {distance_m: 100.0, fov_deg: 60.0, width_px: 3840, diameter_m: 0.2}}
cfas: [RYNCy]
designs:
  one: {cfa: RYNCy, channel: N, base: Y, to: G, at: {left_nm: 600.0, left_width_nm: 10.0, right_nm: 650.0, right_width_nm: 10.0}}
sweeps:
  grid: {cfa: RYNCy, channel: N, base: Y, to: 0.1, grid: {left_nm: {min: 590.0, max: 610.0, count: 2}, left_width_nm: [5.0],
    right_nm: 650.0, right_width_nm: {values: [5.0]}, depth: 1.0}}
production: {edge_shift_nm: 2.0}
recognition: {error_max: 0.001}
objective: {minimum: {csd_yellow_red: 1.0}}
constraints: {sensitivity: {min: 0.9}, slope_per_nm: {max: 0.06}}
search: {space: grid, starts: 2, max_evaluations: 20, front: {min: 0.9, max: 1.0, count: 2}}
seed: 3
published: {table: {RYNCy: {csd_yellow_red: 31.0}}}
"""


_YAML = YAML(typ="safe", pure=True)
_YAML.default_flow_style = False
_WHOLE = dict(_YAML.load(STUDY)) | {"scenarios": {"patch": _YAML.load(PATCH), "road": _YAML.load(ROAD)}}


def whole() -> dict[str, Any]:
    return deepcopy(_WHOLE)


def part(name: str, content: Any) -> bytes:
    """One of the sections of a study, as a file has it."""
    text = StringIO()
    _YAML.dump({name: content}, text)
    return text.getvalue().encode()


_PARTS = {name: (repr(content), part(name, content)) for name, content in _WHOLE.items()}
"""Sections in which nothing is changed are not written again."""


def numbers(node: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    items = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    for key, value in items:
        if isinstance(value, int | float):
            yield (*path, key)
        yield from numbers(value, (*path, key))


NUMBERS = list(numbers(whole()))


def loaded(tmp_path: Path, tree: dict[str, Any]) -> Study:
    path = tmp_path / "all.yaml"
    kept = {name: text for name, (before, text) in _PARTS.items() if repr(tree.get(name)) == before}
    path.write_bytes(b"".join(kept[name] if name in kept else part(name, content) for name, content in tree.items()))
    with within(HANG_S):
        return load_study(path)


def statuses(study: Study, scenario: str) -> set[str]:
    """Of the first designs of every space, computed with all columns, where every warning is an error."""
    planned = replace(study, plans={scenario: study.plan(scenario)})
    rules, found = rules_of(planned), set()
    for number, space in enumerate(planned.spaces):
        first = Rows.of(Job(number, scenario, 0, min(space.size, 2), 0, 0), planned)
        made = rows_of(first, planned.setup(space, scenario), rules, rules.wanted)
        found |= set(made["status"].to_pylist())
    return found


NONE: tuple[Any, ...] = (*(float("nan"), float("inf"), -float("inf"), 1e300, -1e300, True, "1", 10**99, -(10**99)),)


def check_refused(tmp_path: Path, path: tuple[Any, ...], value: object) -> None:
    tree = whole()
    at(tree, path[:-1])[path[-1]] = value
    with pytest.raises(StudyError) as caught:
        loaded(tmp_path, tree)
    lines = str(caught.value).splitlines()
    assert str(path[0]) in lines[0]
    assert len({line.split(": ")[0] for line in lines}) <= 2, lines  # in one place, though of two types


@pytest.mark.slow
def test_whatever_is_no_number_of_this_world_is_one_line(tmp_path: Path) -> None:
    for path in NUMBERS:
        for value in NONE:
            check_refused(tmp_path, path, value)


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ("wavelengths: {step_nm: 5.0e-324}", "step_nm 4.94066e-324 is too fine: at most 20000 steps"),
        ("wavelengths: {start_nm: 1.0e-300, stop_nm: 1.0e-299}", "between 200 and 2000"),
        ("cfas: {X: {tile: [" + ", ".join(["[" + ", ".join("R" * 65) + "]"] * 2) + "]}}", "allowed: at most 64"),
        ("cfas: {X: {tile: [" + ", ".join(["[R]"] * 65) + "]}}", "allowed: at most 64"),
        ("sweeps: {e: {cfa: RGGB, channel: G, base: R, to: B, grid: {left_nm: {min: 1.0, max: 2.0, count: 1000000000}}}}", "1000000"),
        ("scenarios: {a: {each: {off_axis_deg: {min: 0.0, max: 1.0, count: 1000000}}}}", "each.off_axis_deg: too many values"),
        ("scenarios: {a: {each: {x: {min: -1.0e+308, max: 1.0e+308, count: 3}}}}", "a number, a list of numbers"),
        ("scenarios: {" + ", ".join(f"s{i}: {{}}" for i in range(2001)) + "}", "too many scenarios (got 2001)"),
        ("scenarios: {a: {target: {distance_m: 9, fov_deg: 9, phase_px: [1.0e+10, 1]}}}", "a sampling phase is `any`"),
        ("constraints: {sensitivity: {min: 5.0e-324}}", "too near to 0"),
        ("recognition: {states: [" + ", ".join(f"s{i}" for i in range(41)) + "]}", "allowed: at most 40"),
    ],
)  # fmt: skip
def test_sizes_are_limited(tmp_path: Path, more: str, said: str) -> None:
    small = {"study": "study: a", "sensor": "sensor: ar0820", "lights": "lights: tl16", "cfas": "cfas: [RGGB]"}
    path = tmp_path / "a.yaml"
    path.write_text("\n".join((small | {more.split(":", maxsplit=1)[0]: more}).values()) + "\n")
    with pytest.raises(StudyError) as caught, within(HANG_S):
        load_study(path)
    assert said in str(caught.value)
    assert len(str(caught.value).splitlines()) <= 2


def test_many_axes_are_refused_before_they_are_written_out(tmp_path: Path) -> None:
    tree = whole()
    axis = {"min": 590.0, "max": 610.0, "count": 1_000_000}
    tree["sweeps"] = {f"s{i}": tree["sweeps"]["grid"] | {"grid": {f"x{j}": axis for j in range(50)}} for i in range(20)}
    with pytest.raises(StudyError, match="too many values of parameters"):
        loaded(tmp_path, tree)


def test_many_keys_in_each_scenario_are_refused_before_they_are_copied(tmp_path: Path) -> None:
    tree = whole()
    tree["scenarios"] = {
        "a": {"each": {"off_axis_deg": {"min": 0.0, "max": 1.0, "count": 2000}}, "x": {"y": [0] * 10_000}}
    }
    with pytest.raises(
        StudyError, match=r"a\.each: too many keys in all scenarios that it makes; allowed: at most 500,000"
    ):
        loaded(tmp_path, tree)


QE = "wavelength_nm,a,b\n300,0.5,0.1\n1200,0.5,0.6\n"


def study_of(tmp_path: Path, leds: str, more: str = "") -> Path:
    (tmp_path / "qe.csv").write_text(QE)
    (tmp_path / "led.csv").write_text(leds)
    (tmp_path / "a.yaml").write_text(
        "study: a\nsensor: {files: [{file: qe.csv, columns: {A: a, B: b}}]}\n"
        "lights: {files: [{file: led.csv, quantity: photons, outside: zero, signals: {one: [x], two: [y]}}]}\n"
        "wavelengths: {start_nm: 850, stop_nm: 1000, step_nm: 5}\ncfas: [AABB]\nobjective: csd_one_two\n" + more
    )
    return tmp_path / "a.yaml"


INFRARED = "wavelength_nm,x,y\n800,0,0\n880,1,0\n940,0,1\n1000,0,0\n"


@pytest.mark.parametrize(
    ("scene", "said"),
    [
        ("intensity_cd: 200", "a light that the eye does not see has no luminous intensity: led:x (got 200"),
        ("background_cd_m2: 3", "a background on wavelengths that the eye does not see has no luminance (got 3"),
    ],
)
def test_candelas_of_infrared_are_one_line(tmp_path: Path, scene: str, said: str) -> None:
    path = study_of(tmp_path, INFRARED, f"scenarios: {{a: {{{scene}, exposure: {{kind: fixed, exposure_s: 0.01}}}}}}\n")
    with one_line(said, "allowed: photons between 360 and 830 nm"):
        load_study(path)


def test_infrared_lights_are_computed_and_drawn_gray(tmp_path: Path) -> None:
    study = load_study(study_of(tmp_path, INFRARED))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert statuses(study, "chart") == {"ok"}
        np.testing.assert_array_equal(display_colors(study.grid, study.lights.photons), 0.5)
        mixed = WavelengthGrid(start_nm=600, stop_nm=900, step_nm=1)
        colors = display_colors(mixed, np.eye(mixed.size)[[30, 290]])
    assert colors[0, 0] == pytest.approx(1)  # 630 nm: red
    np.testing.assert_array_equal(colors[1], 0.5)
    with np.errstate(invalid="ignore"):
        assert np.isnan(chromaticity(mixed, np.eye(mixed.size)[[290]])).all()


def test_lights_of_any_sensible_power_are_the_same_lights(tmp_path: Path) -> None:
    rows = [(850, 0.0, 1.0), (900, 3.0, 2.0), (1000, 1.0, 0.0)]
    found = []
    for scale in (1e-99, 1.0, 1e99):
        leds = "wavelength_nm,x,y\n" + "".join(f"{w},{x * scale!r},{y * scale!r}\n" for w, x, y in rows)
        found.append(load_study(study_of(tmp_path, leds)).lights.photons)
    np.testing.assert_allclose(found[0], found[1], rtol=1e-12)
    np.testing.assert_allclose(found[2], found[1], rtol=1e-12)
