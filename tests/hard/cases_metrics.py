"""Hard cases of the color separation distance and of the front: nearest pairs, ties, tiny, enormous and many."""

from __future__ import annotations

from fractions import Fraction

import mpmath as mp
import numpy as np
from scipy.spatial import cKDTree

from sweep.metrics.pareto import non_dominated
from sweep.metrics.separation import separation, separations

from .registry import EPS, Result, hard_case, outcome, relative, worst

ONE, OTHER = np.array([0]), np.array([1])


def exact_csd(points: np.ndarray, first: np.ndarray, second: np.ndarray) -> mp.mpf:
    """The smallest distance of one design, ndarray[n_signals, n_channels], from exact squares."""
    rows = [[Fraction(float(value)) for value in point] for point in points]
    squares = (sum((a - b) ** 2 for a, b in zip(rows[i], rows[j], strict=True)) for i in first for j in second)
    least = min(squares)
    return mp.sqrt(mp.mpf(least.numerator) / least.denominator)


def of_exact(response: np.ndarray, allowed: float) -> Result:
    """Worst relative error of the CSD over designs with two signals."""
    found = separation(response, ONE, OTHER)
    return worst((relative(f, exact_csd(r, ONE, OTHER)), allowed) for f, r in zip(found, response, strict=True))


@hard_case("nearly coincident points at 1e8 DN")
def near_points() -> Result:
    """Exact rationals, root in 50 digits. Allowed: near floats subtract exactly (Sterbenz); 3 squares, 2 sums, 1 root:
    2 eps.
    """
    steps = np.random.default_rng(1).integers(1, 50, (60, 3)) * 2.0**-26  # the spacing of float64 at 1e8
    return of_exact(np.stack([np.full((60, 3), 1e8), 1e8 + steps], axis=1), 2 * EPS)


@hard_case("coincident points at any offset")
def coincident_points() -> Result:
    """Exactly 0. Allowed: x - x is exactly 0."""
    offsets = np.array([0.0, 5e-324, 1e-200, 0.1, 4095.5, 1e8, 1e15, 1e300])
    response = np.repeat(offsets[:, None, None] * np.array([1.0, 0.3, 0.7]), 2, axis=1)
    return Result(float(np.abs(separation(response, ONE, OTHER)).max()), 0.0)


@hard_case("points that differ in their last bit")
def last_bit() -> Result:
    """Exact rationals, root in 50 digits. Allowed: the difference is exact; 1 square, 1 root: 2 eps."""
    values = np.array([1e-300, 1e-3, 1.0, 4095.0, 1e8, 1e150])
    pairs = np.stack([values, np.nextafter(values, np.inf)], axis=1)
    return of_exact(pairs[..., None], 2 * EPS)


@hard_case("differences of 1e-200 and of 1e200")
def tiny_and_enormous() -> Result:
    """Exact rationals, root in 50 digits. Allowed: a rounded difference in each channel, two hypot within 1 ulp each: 4
    eps.
    """
    unit = np.random.default_rng(2).uniform(0.1, 1, (40, 2, 3))
    return of_exact(np.concatenate([unit * 1e-200, unit * 1e200]), 4 * EPS)


@hard_case("differences about where squares leave the range of a float")
def at_the_switch() -> Result:
    """Exact rationals, root in 50 digits. Allowed: a rounded difference, squares or hypot over 3 channels: 4 eps on
    both sides of the switch.
    """
    unit = np.random.default_rng(3).uniform(0.1, 1, (1, 2, 3))
    scale = np.array([1e-154, 1e-141, 0.99e-140, 1.01e-140, 1e-139, 1e139, 0.99e140, 1.01e140, 1e141, 1e154, 1e306])
    return of_exact(unit * scale[:, None, None], 4 * EPS)


@hard_case("channels 200 orders of magnitude apart")
def mixed_scales() -> Result:
    """Exact rationals, root in 50 digits. Allowed: the small channels vanish beside the large one's rounding: 4 eps."""
    first = np.zeros((3, 1, 3))
    second = np.array([[1e-100, 1e100, 1.0], [1e-200, 1e-160, 0.0], [3e160, 4e160, 1e-200]])[:, None]
    return of_exact(np.concatenate([first, second], axis=1), 4 * EPS)


@hard_case("a distance of five times the smallest float")
def denormal_triangle() -> Result:
    """3-4-5 triangle. Allowed: the result is a multiple of 5e-324, hypot within one of them."""
    least = 5e-324
    found = separation(np.array([[[0.0, 0.0], [3 * least, 4 * least]]]), ONE, OTHER)[0]
    return Result(abs(found - 5 * least), least)


@hard_case("float32 response")
def float32_response() -> Result:
    """Exact rationals of the float32 values, root in 50 digits. Allowed: float32 values are exact in float64, so
    nothing but its own roundings counts: 4 eps.
    """
    unit = np.random.default_rng(4).uniform(0.1, 1, (30, 2, 3))
    scale = np.repeat([4095.0, 1e-21, 1e25], 10)[:, None, None]
    near = np.full((10, 2, 3), 4000.0)
    near[:, 1] += 2.0**-12 * np.arange(1, 11)[:, None]  # the spacing of float32 at 4000 is 2^-12
    return of_exact(np.concatenate([unit * scale, near]).astype(np.float32), 4 * EPS)


@hard_case("a class of one member and one of 100,000")
def one_against_many() -> Result:
    """SciPy's k-d tree. Allowed: 2 eps for each of the two sums of squares and roots."""
    points = np.random.default_rng(5).uniform(0, 4095, (100_001, 4))
    exact = cKDTree(points[1:]).query(points[0])[0]
    members = np.arange(1, 100_001)
    both = [separation(points[None], *pair)[0] for pair in ((ONE, members), (members, ONE))]
    return worst((relative(found, exact), 4 * EPS) for found in both)


@hard_case("a class of 500 members and one of 100,000: no table of all pairs", slow=True)
def many_against_many() -> Result:
    """SciPy's k-d tree. Allowed: 2 eps for each of the two sums of squares and roots."""
    points = np.random.default_rng(6).uniform(0, 4095, (100_500, 3))
    exact = cKDTree(points[500:]).query(points[:500])[0].min()
    few, many = np.arange(500), np.arange(500, 100_500)
    return worst((relative(separation(points[None], *p)[0], exact), 4 * EPS) for p in ((few, many), (many, few)))


@hard_case("one of 100,000 members coincides")
def one_coincides() -> Result:
    """Exactly 0. Allowed: x - x is exactly 0, and no distance is less than 0."""
    points = np.random.default_rng(7).uniform(1, 4095, (100_010, 3))
    points[77_777] = points[3]
    return Result(abs(separation(points[None], np.arange(10), np.arange(10, 100_010))[0]), 0.0)


@hard_case("ties of the nearest pair")
def ties() -> Result:
    """3-4-5 triangles. Allowed: all squares, sums and the root are integers."""
    red = np.array([[100.0, 100.0]])
    yellow = red + np.array([[3, 4], [-3, 4], [4, -3], [0, 5], [-5, 0], [6, 8]])
    orders = np.random.default_rng(8).permuted(np.tile(np.arange(6), (50, 1)), axis=1)
    response = np.stack([np.concatenate([red, yellow[order]]) for order in orders])
    return Result(float(np.abs(separation(response, ONE, np.arange(1, 7)) - 5).max()), 0.0)


@hard_case("the nearest pair changes along a line of designs")
def switch_of_the_pair() -> Result:
    """Exact rationals of both pairs, root in 50 digits; Lipschitz bound 1. Allowed: exact differences, 2 squares, 1
    sum, 1 root: 2 eps; a point moves by dt, so the CSD by no more and its rounding.
    """
    t = np.arange(2049) / 2048
    response = np.zeros((t.size, 3, 2))
    response[:, 1] = np.stack([1 + t, np.full_like(t, 0.5)], axis=1)
    response[:, 2] = np.stack([2 - t, np.full_like(t, 0.5)], axis=1)  # both pairs are equally far at t = 1/2
    found = separation(response, ONE, np.array([1, 2]))
    exact = [mp.sqrt(mp.mpf(min(2048 + k, 4096 - k)) ** 2 / 2048**2 + 0.25) for k in range(t.size)]
    off = [(relative(f, e), 2 * EPS) for f, e in zip(found, exact, strict=True)]
    jumps = [(max(0.0, step - 1 / 2048), 8 * EPS) for step in np.abs(np.diff(found))]
    return worst(off + jumps)


@hard_case("a NaN in one design of many blocks")
def nan_in_one_design() -> Result:
    """NaN there, |a - b| elsewhere. Allowed: exact; a NaN is no distance."""
    response = np.random.default_rng(9).integers(0, 4096, (300_000, 3, 1)).astype(float)
    response[123_456, 1] = np.nan
    found = separations(response, {"a": ONE, "b": OTHER, "c": np.array([2])})
    good = True
    for (a, b), values in found.items():
        i, j = ("abc".index(name) for name in (a, b))
        exact = np.abs(response[:, i, 0] - response[:, j, 0])
        good &= bool(np.array_equal(values, exact, equal_nan=True) and np.isnan(values).sum() == ("b" in (a, b)))
    return outcome(good)


@hard_case("a NaN response with underflowing squares")
def nan_beside_the_underflow() -> Result:
    """NaN. Allowed: a NaN is in no order, so it must not be lost where lengths are computed again."""
    response = np.array([[[0.0, 0.0], [1e-200, np.nan]], [[0.0, 0.0], [3e-200, 4e-200]]])
    found = separation(response, ONE, OTHER)
    return outcome(bool(np.isnan(found[0]) and relative(found[1], mp.mpf("5e-200")) <= 4 * EPS))


@hard_case("ten million designs, one of them NaN", slow=True)
def ten_million_rows() -> Result:
    """A front by construction: 1025 points on a line, all others 0.01 below it. Allowed: multiples of 2^-30 subtract
    exactly; the NaN design neither is on the front nor keeps others off it.
    """
    n, bad = 10_000_000, 7_654_321
    rng = np.random.default_rng(10)
    far = rng.integers(0, 2**30 + 1, n) / 2**30
    light = 1 - far - 0.01 - rng.random(n)
    front = rng.choice(n - 1, 1025, replace=False)
    front += front >= bad
    far[front] = np.arange(1025) / 1024
    light[front] = 1 - far[front]
    response = np.full((n, 2, 1), 1024.0)
    response[:, 1, 0] += far
    response[bad, 1, 0], light[bad] = np.nan, 2.0
    csd = separation(response, ONE, OTHER)
    del response
    wrong = int((np.delete(csd, bad) != np.delete(far, bad)).sum()) + (not np.isnan(csd[bad]))
    on_front = non_dominated(np.stack([csd, light], axis=1))
    expected = np.zeros(n, dtype=bool)
    expected[front] = True
    return Result(float(wrong + (on_front != expected).sum()), 0.0)
