"""Hard cases of the whole image chain: metamers, extreme exposures, everything clipped, float32, NaN in one design."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace
from itertools import pairwise
from typing import Any

import mpmath as mp
import numpy as np
from scipy.integrate import trapezoid

from sweep.camera.camera import Camera
from sweep.camera.model import SceneModel
from sweep.camera.mosaic import Mosaic
from sweep.camera.pixel import Pixel
from sweep.camera.scene import FixedExposure, Scene
from sweep.camera.setup import Setup
from sweep.designs.families.stopband import Stopband
from sweep.metrics.evaluate import evaluate
from sweep.metrics.smooth import smooth_csd, smooth_response
from sweep.spectra.lights import Lights
from sweep.spectra.spectrum import WavelengthGrid

from .registry import EPS, Result, hard_case, outcome, relative, worst

GRID = WavelengthGrid(step_nm=5)
WAVE = GRID.nodes_nm
N = GRID.size
RATIO = 0.08
YELLOW, RED = 38, 48  # 590 and 640 nm
NEAR = {"distance_m": 20, "fov_deg": 120}


def lines(*nodes: int) -> np.ndarray:
    """One photon each at nodes of the grid, ndarray[n_signals, n_wavelengths]."""
    return np.eye(N)[list(nodes)] / GRID.step_nm


def lights_of(types: tuple[str, ...], photons: np.ndarray) -> Lights:
    return Lights("lines", tuple(f"{t}{i}" for i, t in enumerate(types)), types, photons, RATIO, "", True)


def halved_ends(values: Iterable[float]) -> list[float]:
    """Values with half of the first and the last one."""
    first, *inner, last = map(float, values)
    return [first / 2, *inner, last / 2]


def random_qe(seed: int, channels: int) -> np.ndarray:
    return np.random.default_rng(seed).uniform(0.05, 0.9, (channels, N))


def made(
    qe: np.ndarray,
    lights: Lights,
    scenario: dict[str, Any] | None = None,
    pixel: dict[str, Any] | None = None,
    cfa: str = "RGGB",
    left_out: frozenset[str] = frozenset(),
) -> Setup:
    """A setup whose channel N, if there is one, is modified."""
    mosaic = Mosaic.from_name(cfa)
    modified = (mosaic.channels.index("N"),) if "N" in mosaic.channels else ()
    given = Scene.model_validate(scenario or {})
    own = Pixel(**(pixel or {}))
    return Setup(Camera(GRID, mosaic, qe, modified, np.full(N, 0.9), own), lights, given, left_out=left_out)


def beyond(setup: Setup, **scenario: object) -> Setup:
    """The setup with figures of the scene that no study may have: the model itself has no limits."""
    return replace(setup, scene=setup.scene.model_copy(update=scenario))


def plain(setup: Setup) -> np.ndarray:
    """No modified channel, one design."""
    return np.empty((1, 0, setup.camera.grid.size))


def electrons_per_s(qe: float, radiance: float = 2e18, f_number: float = 4.0) -> mp.mpf:
    """Of a laser line: pi L / (1 + 4 N^2) A QE, with A = (2.1 um)^2."""
    area = (mp.mpf("2.1") * mp.mpf(10) ** -6) ** 2
    return mp.pi * mp.mpf(radiance) / (1 + 4 * mp.mpf(f_number) ** 2) * area * mp.mpf(float(qe))


FIXED = {"exposure": {"kind": "fixed", "exposure_s": 2e-3}}
NONE: frozenset[str] = frozenset()
SHARP = frozenset({"blur"})
SCENES: dict[str, tuple[dict[str, Any], dict[str, Any], frozenset[str]]] = {
    "white patch": ({}, {}, NONE),
    "fixed": (FIXED, {"offset_dn": 168.0}, NONE),
    "noise": (FIXED | {"noise": True}, {"offset_dn": 168.0, "read_noise_e": 2.0, "prnu": 0.01}, NONE),
    "off axis, crosstalk": (FIXED | {"off_axis_deg": 33.0}, {"crosstalk": 0.07}, NONE),
    "fog": (FIXED | {"target": NEAR, "visibility_m": 100.0}, {}, SHARP),
    "center": (FIXED | {"target": NEAR | {"readout": "center"}}, {"crosstalk": 0.02}, SHARP),
    "pulses": (FIXED | {"drive": {"duty": 0.4, "frequency_hz": 90.0}}, {}, NONE),
}


@hard_case("metamers: laser lines at two wavelengths where every filter is alike")
def metamers() -> Result:
    """Exactly 0, in smooth and in read-out CSD, in seven kinds of scenes. Allowed: the same products are summed, the
    others are 0; equal numbers differ by exactly 0.
    """
    errors = []
    lights = lights_of(("yellow", "red"), lines(YELLOW, RED))
    for scenario, pixel, left_out in SCENES.values():
        qe = random_qe(1, 3)
        qe[:, RED] = qe[:, YELLOW]
        setup = made(qe, lights, scenario, pixel, left_out=left_out)
        errors += [evaluate(SceneModel(setup), plain(setup))["csd_yellow_red"], smooth_csd(setup, plain(setup), PAIR)]
    return Result(float(np.max(errors)), 0.0)


PAIR = ("yellow", "red")


@hard_case("metamers under a filter that changes elsewhere", slow=True)
def metamers_beside_a_band() -> Result:
    """Exactly 0 for every stopband away from both lines. Allowed: the filter is exactly its base outside the band."""
    qe = random_qe(2, 4)
    qe[:, RED] = qe[:, YELLOW]
    setup = made(qe, lights_of(PAIR, lines(YELLOW, RED)), cfa="RYNC")
    x = np.random.default_rng(3).uniform([605, 0, 618, 0, 0], [612, 6, 626, 6, 1], (200, 5))
    curves = Stopband(WAVE, qe[2], 0.1 * qe[2]).curves(x)
    assert (curves[:, 0] != qe[2]).any()
    found = [evaluate(SceneModel(setup), curves)["csd_yellow_red"], smooth_csd(setup, curves, PAIR)]
    return Result(float(np.max(found)), 0.0)


@hard_case("metamers of many lines each")
def broad_metamers() -> Result:
    """0: both spectra give every filter the same sum of dyadic products. Allowed: sums of 61 terms with 3 roundings
    each: 64 half eps of the response, in 3 channels.
    """
    rng = np.random.default_rng(4)
    qe = rng.integers(1, 2**10, (3, N)) / 2.0**10
    first = rng.integers(2**8, 2**9, N) / 2.0**9
    # A direction of integers that no filter sees: from the 3 x 4 system at four nodes.
    a = (qe[:, 1:5] * 2**10).astype(int).tolist()
    null = [
        (-1) ** j * int(mp.nint(mp.det(mp.matrix([[r[k] for k in range(4) if k != j] for r in a])))) for j in range(4)
    ]
    second = first.copy()
    second[1:5] += np.array([float(mp.mpf(v) / max(map(abs, null)) / 8) for v in null])
    photons = np.stack([first, second]) / trapezoid(first, dx=GRID.step_nm)
    setup = made(qe, lights_of(PAIR, photons), {"exposure": {"kind": "fixed", "exposure_s": 1e-3}})
    found = smooth_csd(setup, plain(setup), PAIR)[0]
    response = float(smooth_response(setup, plain(setup)).max())
    read = evaluate(SceneModel(setup), plain(setup))["csd_yellow_red"][0]
    return Result(found if read == 0 else math.inf, 64 * EPS / 2 * response * 2 * math.sqrt(3))


@hard_case("lines whose filters differ by 2^-16")
def near_metamers() -> Result:
    """Camera equation in 50 digits. Allowed: 8 roundings of each response, so 8 eps of the response in each of 3
    channels.
    """
    qe = np.random.default_rng(5).integers(2**10, 2**14, (3, N)) / 2.0**14
    qe[:, RED] = qe[:, YELLOW] + np.array([1, -2, 3]) * 2.0**-16
    setup = made(qe, lights_of(PAIR, lines(YELLOW, RED)), FIXED)
    found = smooth_csd(setup, plain(setup), PAIR)[0]
    gain = electrons_per_s(1.0) * mp.mpf(2e-3) * 4095 / 10_000
    exact = gain * mp.mpf(2) ** -16 * mp.sqrt(14)
    return Result(abs(float(found - exact)), 8 * EPS * float(gain) * math.sqrt(3))


@hard_case("exposures from 5e-324 to 1e300 s")
def exposures() -> Result:
    """Camera equation in 50 digits. Allowed: 12 roundings of a response; in the smallest, the spacing 5e-324 times
    electrons/s and DN/e of each of 4 points.
    """
    qe, results = random_qe(6, 3), []
    lights = lights_of(PAIR, lines(YELLOW, RED))
    for exposure_s in (5e-324, 1e-310, 1e-300, 1e-160, 1e-30, 1.0, 1e150, 1e300):
        setup = beyond(made(qe, lights), exposure=FixedExposure.model_construct(exposure_s=exposure_s))
        found = smooth_csd(setup, plain(setup), PAIR)[0]
        gain = electrons_per_s(1.0) * mp.mpf(exposure_s) * 4095 / 10_000
        exact = gain * mp.sqrt(sum((mp.mpf(float(a)) - mp.mpf(float(b))) ** 2 for a, b in qe[:, [YELLOW, RED]]))
        allowed = 12 * EPS * float(gain) * math.sqrt(3) + 4 * 5e-324
        read = evaluate(SceneModel(setup), plain(setup))["csd_yellow_red"][0]  # all is dark, or full
        results.append((relative(found, exact), float(allowed / exact)))
        results.append((float(read), 0.0))
    return worst(results)


@hard_case("lights from 1e-290 to 1e270 photons under the white-patch exposure")
def radiances() -> Result:
    """Level x full scale x K x QE over the brightest channel's mean, half a bin at each end, in 50 digits. Allowed: the exposure cancels the
    light: 61-term sums and 16 roundings of each response, 64 eps of it.
    """
    qe, results = random_qe(7, 3), []
    top = max(sum(mp.mpf(float(v)) for v in halved_ends(row)) / (N - 1) for row in qe)
    scale = mp.mpf(0.95) * 4095 * mp.mpf(RATIO) / top
    points = [[scale * mp.mpf(float(row[node])) for row in qe] for node in (YELLOW, RED)]
    exact = mp.sqrt(sum((a - b) ** 2 for a, b in zip(*points, strict=True)))
    for radiance in (1e-290, 1e-100, 2e18, 1e100, 1e270):
        setup = beyond(made(qe, lights_of(PAIR, lines(YELLOW, RED))), photon_radiance=radiance)
        found = smooth_csd(setup, plain(setup), PAIR)[0]
        results.append((abs(float(found - exact)), 64 * EPS * float(max(map(max, points))) * math.sqrt(3)))
    return worst(results)


@hard_case("no light at all")
def no_light() -> Result:
    """CSD exactly 0 at a fixed exposure; no exposure, and no number, for the white patch. Allowed: 0 electrons; what
    the exposure of no light would be is not finite and never made up.
    """
    lights = lights_of(PAIR, lines(YELLOW, RED))
    good = True
    for qe, radiance in ((np.zeros((3, N)), 2e18), (random_qe(8, 3), 5e-324)):
        setup = beyond(made(qe, lights, FIXED), photon_radiance=radiance)
        good &= (
            evaluate(SceneModel(setup), plain(setup))["csd_yellow_red"][0] == 0 == smooth_csd(setup, plain(setup), PAIR)
        )
    with np.errstate(invalid="ignore"):
        setup = made(np.zeros((3, N)), lights)
        dark = evaluate(SceneModel(setup), plain(setup))
    return outcome(bool(good and np.isnan(dark["csd_yellow_red"][0]) and np.isinf(dark["exposure_s"][0])))


@hard_case("everything clipped")
def everything_clipped() -> Result:
    """CSD exactly 0 between points that all are at full scale. Allowed: full scale is one number, whatever was cut off
    above it.
    """
    errors = []
    lights = lights_of(("green", *PAIR), lines(25, YELLOW, RED))
    bright = {"exposure": {"kind": "fixed", "exposure_s": 1e4}}
    pixels = ({}, {"offset_dn": 168.0}, {"gain_dn_per_e": 0.1}, {"well_e": 3000.0, "gain_dn_per_e": 3.0}, {"bits": 24})
    for pixel in pixels:
        for more in ({}, {"target": NEAR | {"readout": "center"}}, {"drive": {"duty": 0.9, "frequency_hz": 100.0}}):
            setup = made(random_qe(9, 3), lights, bright | more, pixel)
            found = evaluate(SceneModel(setup), plain(setup))
            errors += [v for name, v in found.items() if name.startswith(("csd_", "best_phase_"))]
    return Result(float(np.max(errors)), 0.0)


@hard_case("the nearest pair changes along a line of filters")
def switch_along_filters() -> Result:
    """Closed form: the distance of the outer pair, of the inner pair, and exactly 0 where two responses meet. Allowed:
    8 roundings of each response: 8 eps of the largest; equal filters are exactly equal responses.
    """
    qe = np.full((4, N), 0.25)
    qe[2] = 0.5
    qe[2, 30], qe[2, RED] = 0.4375, 0.25  # N at 550 and 640 nm; the band holds 590 nm
    setup = made(qe, lights_of(("yellow", "yellow", "red"), lines(30, YELLOW, RED)), FIXED, cfa="RYNC")
    depth = np.arange(1025) / 1024
    x = np.stack([np.full_like(depth, v) for v in (575.0, 0.0, 605.0, 0.0)] + [depth], axis=1)
    found = smooth_csd(setup, Stopband(WAVE, qe[2], np.zeros(N)).curves(x), PAIR)
    gain = electrons_per_s(1.0) * mp.mpf(2e-3) * 4095 / 10_000
    exact = [gain * min(mp.mpf(3) / 16, abs(mp.mpf(1) / 4 - mp.mpf(k) / 2048)) for k in range(1025)]
    results = [(abs(float(f - e)), 8 * EPS * float(gain)) for f, e in zip(found, exact, strict=True)]
    return worst([*results, (float(found[512]), 0.0)])


@hard_case("float32 curves")
def float32_curves() -> Result:
    """Math.fsum of the float32 values; the same scene in float64 before its rounding to float32. Allowed: a float32
    curve is exact in float64: 64 eps; rounding it to float32 moves a sum of positive terms by 2^-24.
    """
    qe = random_qe(10, 4)
    lights = lights_of(PAIR, np.random.default_rng(11).dirichlet(np.ones(N), 2) / GRID.step_nm)
    x = np.random.default_rng(12).uniform([560, 5, 620, 5, 0], [590, 30, 660, 30, 1], (20, 5))
    curves = Stopband(WAVE, qe[2], 0.2 * qe[2]).curves(x)
    setup = made(qe, lights, FIXED, cfa="RYNC")
    narrow, small = setup.with_camera(qe=qe.astype(np.float32)), curves.astype(np.float32)
    found = evaluate(SceneModel(narrow), small)
    base, counts = narrow.camera.qe[2], narrow.camera.mosaic.counts
    results = []
    for index, curve in enumerate(small[:, 0]):
        total = math.fsum(halved_ends(curve))
        whole = math.fsum(
            c * math.fsum(halved_ends(q))
            for c, q in zip(counts, (*narrow.camera.qe[:2], curve, narrow.camera.qe[3]), strict=True)
        )
        steps = [abs(float(b) - float(a)) for a, b in pairwise(curve)]
        exact = {
            "sensitivity": total / math.fsum(halved_ends(base)),
            "cfa_sensitivity": whole / 4 / math.fsum(halved_ends([0.9] * N)),
            "slope_per_nm": max(steps) / GRID.step_nm,
            "min_transmission": min(float(a) / float(b) for a, b in zip(curve, base, strict=True)),
        }
        results += [(relative(found[name][index], value), 64 * EPS) for name, value in exact.items()]
    one, other = smooth_response(narrow, small), smooth_response(setup, curves)
    return worst([*results, (float((np.abs(one - other) / other).max()), 2.0**-24 + 64 * EPS)])


@hard_case("a NaN in one design of a block")
def nan_in_one_design() -> Result:
    """The block without it. Allowed: designs share nothing but the order of a sum over the wavelengths: 64 eps of full
    scale.
    """
    qe = random_qe(13, 4)
    lights = lights_of(PAIR, lines(YELLOW, RED))
    x = np.random.default_rng(14).uniform([560, 5, 620, 5, 0], [590, 30, 660, 30, 1], (64, 5))
    clean = Stopband(WAVE, qe[2], 0.2 * qe[2]).curves(x)
    bad = clean.copy()
    bad[17, 0, RED] = np.nan
    error = 0.0
    for scenario, pixel, left_out in SCENES.values():
        model = SceneModel(made(qe, lights, scenario, pixel, "RYNC", left_out))
        one, other = evaluate(model, clean), evaluate(model, bad)
        if not np.isnan(other["csd_yellow_red"][17]):
            return Result(np.inf, 0.0)
        for name in one:
            off = np.abs(np.delete(one[name], 17) - np.delete(other[name], 17)).max()
            error = max(error, float(off) / (model.readout.pixel.full_scale_dn if "csd" in name else 1.0))
    return Result(error, 64 * EPS)
