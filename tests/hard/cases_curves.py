"""Hard cases of curves and filters: laser lines between grid nodes, NaN in a user's file, edges at their extremes."""

from __future__ import annotations

from fractions import Fraction
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory

import mpmath as mp
import numpy as np
from scipy.io import savemat

from sweep.base.errors import DataError, StudyError, SweepError
from sweep.camera.sensor import make_sensor
from sweep.designs.edge import edge, edge_gradient
from sweep.designs.families.dual import Dual
from sweep.designs.families.stopband import Stopband
from sweep.metrics.bound import FEASIBLE
from sweep.spectra.formats import read_curves
from sweep.spectra.lights import make_lights
from sweep.spectra.spectrum import WavelengthGrid, check_samples, resample
from sweep.study import load_study

from .registry import EPS, Result, hard_case, outcome, refused, worst

GRID = WavelengthGrid()
WAVE = GRID.nodes_nm
BASE = 0.3 + 0.5 / (1 + np.exp(-(WAVE - 500) / 20))
TARGET = 0.2 + 0.1 * np.sin(WAVE / 40)
LINES = [(c, w) for c in (632.8, 632.5, 500.0, 589.2949, 400.499999) for w in (1e-6, 0.01, 0.7, 5.0)]


def line(center_nm: float, half_nm: float) -> tuple[np.ndarray, np.ndarray]:
    """A triangular laser line on a dark floor, as samples."""
    return np.array([380.0, center_nm - half_nm, center_nm, center_nm + half_nm, 720.0]), np.eye(5)[2] / half_nm


def exact_mean(wave: np.ndarray, data: np.ndarray, low: Fraction, high: Fraction) -> Fraction:
    """Mean of the piecewise linear interpolant over low..high, in exact rationals."""
    total = Fraction(0)
    samples = [(Fraction(float(w)), Fraction(float(v))) for w, v in zip(wave, data, strict=True)]
    for (a, u), (b, v) in pairwise(samples):
        left, right = max(a, low), min(b, high)
        if left < right:
            total += (right - left) * (u + (v - u) * ((left + right) / 2 - a) / (b - a))
    return total / (high - low)


@hard_case("laser lines between nodes, mean over bins")
def lines_by_mean() -> Result:
    """Exact rational integral of the samples over every bin. Allowed: a bin is a difference of two sums of up to 5
    pieces with 6 roundings each: 10 eps of the line's integral 1.
    """
    results = []
    for center, half in LINES:
        wave, data = line(center, half)
        found = resample(wave, data, GRID, "mean")
        for node, value in zip(WAVE, found, strict=True):
            if abs(node - center) < half + 2:
                ends = (
                    max(Fraction(node) - Fraction(1, 2), Fraction(400)),
                    min(Fraction(node) + Fraction(1, 2), Fraction(700)),
                )
                exact = exact_mean(wave, data, *ends)
                results.append((abs(float(Fraction(float(value)) - exact)), 10 * EPS))
            else:
                results.append((abs(float(value)), 10 * EPS))
    return worst(results)


@hard_case("laser lines between nodes, integral")
def integral_of_lines() -> Result:
    """Exact rational area of the triangle. Allowed: the bins' sums telescope: 10 eps of the whole, and 9 for adding 301
    of them pairwise.
    """
    results = []
    for center, half in LINES[:-1]:
        wave, data = line(center, half)
        area = exact_mean(wave, data, Fraction(400), Fraction(700)) * 300
        found = float(GRID.integrate(resample(wave, data, GRID, "mean")))
        results.append((abs(float(Fraction(found) - area)), 20 * EPS))
    return worst(results)


@hard_case("laser lines between nodes, linear")
def lines_by_interpolation() -> Result:
    """0 at every node: no photons, refused. Allowed: a line that no node sees must not become a light without photons."""
    wave, data = line(632.8, 0.01)
    photons = resample(wave, data, GRID, "linear")
    words = ("no photons on the wavelength grid", "400 to 700 nm")
    lost = refused(lambda: make_lights(GRID, "laser", [("a", "red", photons)], "file"), DataError, *words)
    on_node = resample(*line(633.0, 0.01), GRID, "linear")
    return outcome(not photons.any() and lost and on_node[233] == 100.0 and on_node.sum() == 100.0)


@hard_case("spectra over 21 orders of magnitude keep their sign")
def no_negative_bins() -> Result:
    """No bin of a curve that is nowhere negative is negative. Allowed: sums only grow, so their differences are not
    negative.
    """
    rng, least = np.random.default_rng(1), 0.0
    for _ in range(100):
        wave = np.unique(np.concatenate([[390.0], rng.uniform(395, 705, 400), [710.0]]))
        least = min(least, float(resample(wave, 10 ** rng.uniform(-18, 3, wave.size), GRID, "mean").min()))
    return Result(abs(least), 0.0)


def study_text(folder: Path, cell: str, after: str = "0.5") -> Path:
    """A study whose red filter has `cell` for a value at 550 nm, and `after` at 560 nm."""
    rows = "\n".join(f"{w},{({550: cell, 560: after}).get(w, 0.5)},0.4" for w in range(390, 720, 10))
    (folder / "qe.csv").write_text(f"wavelength_nm,red,green\n{rows}\n")
    path = folder / "s.yaml"
    path.write_text(
        "study: s\nsensor: {files: [{file: qe.csv, columns: {R: red, G: green}}]}\nlights: tl16\n"
        "scenarios: {chart: {}}\ncfas: [RGGR]\n"
    )
    return path


@hard_case("a NaN in a user's file")
def nan_in_a_file() -> Result:
    """One between two samples is on the straight line between them, and said. Allowed: all else is refused, in one line."""
    good = True
    with TemporaryDirectory() as name:
        folder = Path(name)
        assert load_study(study_text(folder, "0.5")).sensor.qe["R"].shape == (301,)
        for cell in ("nan", "NaN", "", "n/a"):
            path = study_text(folder, cell)
            good &= bool((load_study(path).sensor.qe["R"] == 0.5).all())
            good &= any("red: the missing value at 550 nm is 0.5" in said for said in load_study(path).warnings)
            path = study_text(folder, cell, cell)
            good &= refused(lambda: read_curves(folder / "qe.csv"), DataError, "qe.csv", "red", "in a row are missing")
        for cell in ("-nan", "inf", "1e999", "x"):
            path = study_text(folder, cell)
            good &= refused(lambda: read_curves(folder / "qe.csv"), DataError, "qe.csv:18", "red")
            good &= refused(lambda path=path: load_study(path), StudyError, "qe.csv:18", "red")
        for bad in (np.inf, -0.1):
            data = np.full((31, 2), 0.5)
            data[7, 1] = bad
            savemat(folder / "qe.mat", {"wavelength": np.arange(400.0, 710.0, 10.0), "data": data})
            place = "qe.mat:9" if bad > 0 else "470 nm"
            good &= refused(lambda: read_curves(folder / "qe.mat"), DataError, "qe.mat", "curve_2", place)
    return outcome(good)


@hard_case("a NaN that comes from the program")
def nan_by_call() -> Result:
    """Refused. Allowed: comparisons are written so that NaN fails them."""
    bad = np.full(301, 0.5)
    bad[100] = np.nan
    where = np.where(np.arange(301) == 3, np.nan, WAVE)
    calls = (
        lambda: check_samples(WAVE, bad),
        lambda: check_samples(where, np.full(301, 0.5)),
        lambda: resample(WAVE, bad, GRID),
        lambda: make_sensor("mine", {"R": bad, "G": BASE}, "call"),
        lambda: make_lights(GRID, "mine", [("a", "red", bad)], "call"),
    )
    return outcome(all(refused(call, SweepError) for call in calls))


def quintic(wave: float, center: float, width: float) -> mp.mpf:
    """Rising edge whose 10-90 % width is `width`, as the integral of 30 t^2 (1 - t)^2."""

    def rise(t: mp.mpf) -> mp.mpf:
        return 10 * t**3 - 15 * t**4 + 6 * t**5

    tenth = mp.findroot(lambda t: rise(t) - mp.mpf(1) / 10, mp.mpf("0.2466"))
    t = (mp.mpf(wave) - mp.mpf(center)) * (1 - 2 * tenth) / mp.mpf(width) + mp.mpf(1) / 2
    return rise(min(max(t, mp.mpf(0)), mp.mpf(1)))


@hard_case("edges of 1e-8 to 500 nm")
def edges_in_50_digits() -> Result:
    """Quintic in 50 digits. Allowed: t within 2 eps, slope at most 15/8; Horner's 8 roundings of at most 6 + 15 + 10: 4
    eps x 31.
    """
    results = []
    for width in (1e-8, 1e-3, 0.7, 5.0, 60.0, 500.0):
        for share in (-1.1, -0.99, -0.9, -0.5, -0.1, 0.0, 0.3, 0.5, 0.9, 0.999, 1.1):
            center = 600.1 - share * width
            found = edge(np.array([600.1]), np.array(center), np.array(width))[0]
            results.append((abs(float(found - quintic(600.1, center, width))), (4 * 31 + 2 * 15 / 8) * EPS))
    return worst(results)


def shape(*design: float) -> np.ndarray:
    return Stopband(WAVE, BASE, TARGET).curves(np.array([design]))[0, 0]


@hard_case("stopbands of zero width")
def zero_width() -> Result:
    """The base curve, exactly. Allowed: e - e is exactly 0, and base + 0 the base."""
    designs = [(c, w, c, w, 1.0) for c in (400.0, 600.0, 600.3, 700.0) for w in (0.0, 5e-324, 1e-9, 1.0, 300.0)]
    designs += [(600.2, 0.0, 600.8, 0.0, 1.0), (590.0, 10.0, 640.0, 10.0, 0.0)]
    family = Stopband(WAVE, BASE, TARGET)
    formed = all((family.violation(np.array([d])) <= FEASIBLE).all() for d in designs)
    error = max(float(np.abs(shape(*d) - BASE).max()) for d in designs)
    return Result(error if formed else np.inf, 0.0)


@hard_case("edges outside the range of wavelengths")
def edges_outside() -> Result:
    """The base curve where the band is outside, the target where it covers all. Allowed: exactly the base; base +
    (target - base) has two roundings of at most 1: 1 eps.
    """
    outside = [(200.0, 0.0, 399.0, 0.0), (200.0, 100.0, 250.0, 100.0), (720.0, 10.0, 1900.0, 10.0), (1e3, 0, 2e3, 500)]
    across = [(200.0, 0.0, 2000.0, 0.0), (250.0, 100.0, 1200.0, 500.0), (399.9, 0.0, 700.1, 0.0)]
    results = [(float(np.abs(shape(*d, 1.0) - BASE).max()), 0.0) for d in outside]
    results += [(float(np.abs(shape(*d, 1.0) - TARGET).max()), EPS) for d in across]
    return worst(results)


@hard_case("brick walls on and between nodes")
def brick_walls() -> Result:
    """Counting: 1 inside, 1/2 on a wall, 0 outside. Allowed: exact; widths that are no more than rounding of a
    wavelength are walls, too, and have no slope.
    """
    good, at = True, np.arange(595.0, 616.0)
    for width in (0.0, 5e-324, 1e-300, 1e-13):
        for left, right, total in (
            (600.0, 610.0, 10.0),
            (599.5, 610.5, 11.0),
            (600.0, 609.5, 9.5),
            (605.0, 605.0, 0.0),
        ):
            e = [edge(at, np.array(c), np.array(width)) for c in (left, right)]
            counted = [np.where(at > c, 1.0, np.where(at == c, 0.5, 0.0)) for c in (left, right)]
            good &= np.array_equal(e, counted) and float((e[0] - e[1]).sum()) == total
        good &= not np.any(edge_gradient(at, np.array(600.0), np.array(width)))
    return outcome(bool(good))


@hard_case("crossed edges")
def crossed_edges() -> Result:
    """How far they cross, in exact rationals. Allowed: a sum of 4 products of at most 700: 4 eps x 700; crossed by 1e-9
    nm or more is more than 0.
    """
    family, results = Stopband(WAVE, BASE, TARGET), []
    for by in (1e-9, 1e-3, 1.0, 40.0, 300.0):
        for width in (0.0, 0.1, 30.0):
            x = np.array([[620.0 + by / 2, width, 620.0 - by / 2, width, 1.0]])
            found = float(family.violation(x).max())
            exact = Fraction(float(x[0, 0])) - Fraction(float(x[0, 2]))
            results.append((abs(float(Fraction(found) - exact)) if found > 0 else np.inf, 4 * EPS * 700))
    # In order, but the end of one edge lies behind the end of the other.
    results.append((0.0 if family.violation(np.array([[600.0, 200.0, 610.0, 10.0, 1.0]])).max() > 0 else np.inf, 0.0))
    return worst(results)


@hard_case("two channels whose sum is kept")
def dual_keeps_its_sum() -> Result:
    """Twice the base curve, exact rationals. Allowed: two sums, each rounded by half an eps of at most 1: 1 eps."""
    ceiling = np.full(301, 0.97)
    designs = np.random.default_rng(2).uniform([450, 0, 550, 0, 0], [550, 80, 700, 80, 1], (50, 5))
    curves = Dual(WAVE, BASE, ceiling).curves(designs)
    results = []
    for pair in curves:
        sums = [
            Fraction(float(a)) + Fraction(float(b)) - 2 * Fraction(float(c))
            for a, b, c in zip(*pair, BASE, strict=True)
        ]
        results.append((float(max(abs(s) for s in sums)), EPS))
    return worst(results)
