"""Hard cases of the noise metrics: singular and zero covariance, tails of 1e-300, variances far apart, NaN."""

from __future__ import annotations

from itertools import product, starmap

import mpmath as mp
import numpy as np

from sweep.metrics.discrimination import detectability, error_of

from .registry import EPS, Result, hard_case, outcome, relative, worst

ONE, OTHER = np.array([0]), np.array([1])
Point = tuple[list[mp.mpf], list[mp.mpf]]
TAIL = 1e-13
"""Relative accuracy of SciPy's normal tail (Cephes states 5e-14 for its erfc)."""


def points(mean: np.ndarray, variance: np.ndarray) -> list[Point]:
    """Mean and variance of each signal of one design."""
    pairs = zip(mean, variance, strict=True)
    return [([mp.mpf(float(v)) for v in m], [mp.mpf(float(v)) for v in s]) for m, s in pairs]


def pairwise_error(mean: np.ndarray, variance: np.ndarray, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    return error_of(detectability(mean, variance, first, second))


def exact_margin(a: Point, b: Point) -> mp.mpf:
    """Largest root of the sum of D^2 / (Va / l + Vb / (1 - l)), by halves of the logarithm of l / (1 - l)."""
    signals = [(p - q, s, t) for p, q, s, t in zip(a[0], b[0], a[1], b[1], strict=True) if p != q]
    low, high = mp.mpf(-100), mp.mpf(100)
    for _ in range(110):
        middle = (low + high) / 2
        w = mp.exp(middle)
        rises = sum(d**2 * (s - t * w**2) / (s + t * w) ** 2 for d, s, t in signals) > 0
        low, high = (middle, high) if rises else (low, middle)
    share = 1 / (1 + mp.exp(-middle))
    return mp.sqrt(sum(d**2 / (s / share + t / (1 - share)) for d, s, t in signals))


def exact_d_prime(a: Point, b: Point) -> mp.mpf:
    return 2 * exact_margin(a, b)


def exact_error(a: Point, b: Point) -> mp.mpf:
    return mp.erfc(exact_margin(a, b) / mp.sqrt(2)) / 2


def random_designs(seed: int, n: int, signals: int = 7, spread: float = 60.0) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    return rng.uniform(0, spread, (n, signals, 3)), 10 ** rng.uniform(-1, 3, (n, signals, 3))


FIRST, SECOND = np.arange(3), np.arange(3, 7)


def of_pairs(seed: int, metric, spread: float = 60.0):
    """What a metric gives for each of 20 designs, and the points of every pair."""
    mean, variance = random_designs(seed, 20, spread=spread)
    for m, v, found in zip(mean, variance, metric(mean, variance, FIRST, SECOND), strict=True):
        signals = points(m, v)
        yield found, [(signals[i], signals[j]) for i, j in product(FIRST, SECOND)]


@hard_case("d' of generic diagonal covariances")
def generic_d_prime() -> Result:
    """The smallest of 12 pairs, 50 digits. Allowed: difference, sum, half, root and ratio half an eps each, two hypot:
    8 eps.
    """
    return worst((relative(f, min(starmap(exact_d_prime, p))), 8 * EPS) for f, p in of_pairs(2, detectability))


@hard_case("error of a pair for generic diagonal covariances")
def generic_error() -> Result:
    """The largest of 12 pairs, erfc in 50 digits. Allowed: 16 eps of its argument x; condition of the tail at most 1 +
    x^2; the tail itself 1e-13.
    """
    exact = [(f, max(starmap(exact_error, p))) for f, p in of_pairs(3, pairwise_error, 400.0)]
    return worst((relative(f, e), 16 * EPS * (1 - 2 * float(mp.log(e))) + TAIL) for f, e in exact)


@hard_case("errors of 1e-300")
def tiny_errors() -> Result:
    """Erfc in 50 digits. Allowed: x = 37: 16 eps of x times the tail's condition 1 + x^2, and the tail's own 1e-13."""
    rng = np.random.default_rng(4)
    variance = 10 ** rng.uniform(-2, 4, (30, 2, 3))
    direction = rng.uniform(0.2, 1, (30, 3))
    along = [points(np.stack([np.zeros(3), d]), v) for d, v in zip(direction, variance, strict=True)]
    x = np.array([float(exact_margin(*of)) for of in along])
    mean = np.stack([np.zeros((30, 3)), direction * (rng.uniform(36.9, 37.2, 30) / x)[:, None]], axis=1)
    found = pairwise_error(mean, variance, ONE, OTHER)
    exact = [exact_error(*points(m, v)) for m, v in zip(mean, variance, strict=True)]
    assert min(exact) < 1e-299
    return worst((relative(f, e), 16 * EPS * (1 + 37.5**2) + TAIL) for f, e in zip(found, exact, strict=True))


@hard_case("errors of 1e-300 with variances 1e10 to 1e30 apart")
def unlike_variances() -> Result:
    """Erfc in 50 digits. Allowed: as for alike variances: both shares are ratios, none is 1 minus the other."""
    small = 10.0 ** -np.arange(10, 31)
    mean = np.zeros((small.size, 2, 1))
    mean[:, 1] = 37.0
    variance = np.stack([np.ones_like(small), small], axis=1)[..., None]
    results = []
    for m, v in ((mean, variance), (mean, variance[:, ::-1])):
        found = pairwise_error(m, v, ONE, OTHER)
        exact = [exact_error(*points(*design)) for design in zip(m, v, strict=True)]
        allowed = 16 * EPS * (1 + 37.0**2) + TAIL
        results += [(relative(f, e), allowed) for f, e in zip(found, exact, strict=True)]
    return worst(results)


@hard_case("zero covariance")
def zero_covariance() -> Result:
    """Definitions: certain, or nothing told. Allowed: distances of points without noise are certain, coincident points
    tell nothing.
    """
    metrics = (detectability, pairwise_error)
    mean = np.array([[[1e8, 2.0], [1e8 + 2.0**-20, 2.0]], [[1e8, 2.0], [1e8, 2.0]]])
    found = [list(metric(mean, np.zeros_like(mean), ONE, OTHER)) for metric in metrics]
    return outcome(found == [[np.inf, 0.0], [0.0, 0.5]])


@hard_case("coincident points with noise")
def coincident_with_noise() -> Result:
    """Closed form. Allowed: a difference of 0 over noise is exactly 0: error 1/2."""
    mean, variance = np.full((1, 2, 3), 1e8), np.full((1, 2, 3), 7.3)
    found = [float(m(mean, variance, ONE, OTHER)[0]) for m in (detectability, pairwise_error)]
    return outcome(found == [0.0, 0.5])


@hard_case("singular covariance: a channel without variance and with equal means", slow=True)
def singular_without_contrast() -> Result:
    """The same design without that channel, 50 digits. Allowed: 12 eps of each metric's argument; condition of the tail
    1 + x^2, of exp(-d) d.
    """
    results = []
    for mean, variance in zip(*random_designs(6, 10, signals=2, spread=20.0), strict=True):
        m, v = (np.insert(a, 1, b, axis=1)[None] for a, b in ((mean, 1e6), (variance, 0.0)))
        a, b = points(mean, variance)
        error = exact_error(a, b)
        results += [
            (relative(detectability(m, v, ONE, OTHER)[0], exact_d_prime(a, b)), 12 * EPS),
            (relative(pairwise_error(m, v, ONE, OTHER)[0], error), 12 * EPS * (1 - 2 * float(mp.log(error))) + TAIL),
        ]
    return worst(results)


@hard_case("singular covariance: a channel without variance and with different means")
def singular_with_contrast() -> Result:
    """Closed form: told apart for certain. Allowed: d' infinite, error 0."""
    mean, variance = np.array([[[0.0, 0.0], [3.0, 4.0]]]), np.array([[[2.0, 0.0], [6.0, 0.0]]])
    certain = detectability(mean, variance, ONE, OTHER)[0] == np.inf
    return outcome(certain and pairwise_error(mean, variance, ONE, OTHER)[0] == 0)


@hard_case("one of two points without variance")
def half_singular() -> Result:
    """Closed form with the other's variance alone, 50 digits. Allowed: 12 eps of d' and of the error's argument, its
    condition 1 + x^2; 12 eps of d for exp(-d).
    """
    results = []
    for mean, variance in zip(*random_designs(7, 10, signals=2, spread=20.0), strict=True):
        m, v = mean[None, :, :1], variance[None, :, :1].copy()
        v[0, 1] = 0.0
        z = abs(mp.mpf(float(m[0, 0, 0])) - float(m[0, 1, 0])) / mp.sqrt(float(v[0, 0, 0]))
        error = mp.erfc(z / mp.sqrt(2)) / 2
        results += [
            (relative(detectability(m, v, ONE, OTHER)[0], 2 * z), 12 * EPS),
            (relative(pairwise_error(m, v, ONE, OTHER)[0], error), 12 * EPS * (1 + float(z) ** 2) + TAIL),
        ]
    return worst(results)


@hard_case("differences and deviations of 1e-150 to 1e200")
def far_scales() -> Result:
    """Closed form of one channel. Allowed: 4 eps: a root, a ratio; nothing is squared."""
    results = []
    for apart, variance in ((1e200, 1.0), (1e-150, 1e-300), (1e200, 1e300), (1e-200, 1.0), (3.0, 1e-300)):
        mean = np.array([[[0.0], [apart]]])
        exact = mp.mpf(apart) / mp.sqrt(mp.mpf(variance))
        found = detectability(mean, np.full_like(mean, variance), ONE, OTHER)[0]
        results.append((relative(found, exact), 4 * EPS))
    return worst(results)


@hard_case("a NaN in a mean or in a variance")
def nan_stays() -> Result:
    """NaN for that design, the other designs as alone. Allowed: what is not known is neither certain nor coincident,
    and no other design's.
    """
    mean, variance = random_designs(8, 4)
    metrics = (detectability, pairwise_error)
    clean = [metric(mean, variance, FIRST, SECOND) for metric in metrics]
    mean[1, 2, 0] = np.nan
    variance[2] = np.nan
    variance[3, :, 1] = 0.0  # certain in one channel ...
    mean[3, :, 2] = np.nan  # ... and not a number in another
    found = [metric(mean, variance, FIRST, SECOND) for metric in metrics]
    good = all(np.isnan(f[1:]).all() and f[0] == c[0] for f, c in zip(found, clean, strict=True))
    return outcome(good)


@hard_case("error of a pair by simulation", slow=True)
def error_by_simulation() -> Result:
    """A million Gaussian draws of each point along the normal, split where both err equally often. Allowed: 4 standard
    deviations of a share of a million.
    """
    rng = np.random.default_rng(9)
    n, results = 1_000_000, []
    for _ in range(4):
        mean, variance = rng.uniform(0, 12, (2, 3)), 10 ** rng.uniform(0, 2, (2, 3))
        # The plane of the best share of a fine grid, whose normal is D / (Va / l + Vb / (1 - l)).
        shares = np.linspace(0.001, 0.999, 999)[:, None]
        spreads = variance[0] / shares + variance[1] / (1 - shares)
        normal = (mean[1] - mean[0]) / spreads[((mean[1] - mean[0]) ** 2 / spreads).sum(axis=1).argmax()]
        low, high = (
            np.sort((m + np.sqrt(v) * rng.standard_normal((n, 3))) @ normal)
            for m, v in zip(mean, variance, strict=True)
        )
        # The k-th largest of one meets the k-th smallest of the other where both err k times.
        share = np.searchsorted(high - low[::-1], 0.0) / n
        found = pairwise_error(mean[None], variance[None], ONE, OTHER)[0]
        results.append((abs(found - share), 4 * np.sqrt(found * (1 - found) / n)))
    return worst(results)
