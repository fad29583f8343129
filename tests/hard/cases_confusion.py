"""Hard cases of the noise metrics: singular and zero covariance, tails of 1e-300, variances far apart, NaN."""

from __future__ import annotations

from itertools import product, starmap

import mpmath as mp
import numpy as np

from sweep.metrics.discrimination import contrast_to_noise, detectability, error_bounds, pairwise_error

from .registry import EPS, Result, hard_case, outcome, relative, worst

ONE, OTHER = np.array([0]), np.array([1])
Point = tuple[list[mp.mpf], list[mp.mpf]]
TAIL = 1e-13
"""Relative accuracy of SciPy's normal tail (Cephes states 5e-14 for its erfc)."""


def error_bound(mean: np.ndarray, variance: np.ndarray, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    return error_bounds(mean, variance, {"first": first, "second": second})[1]


def points(mean: np.ndarray, variance: np.ndarray) -> list[Point]:
    """Mean and variance of each signal of one design."""
    pairs = zip(mean, variance, strict=True)
    return [([mp.mpf(float(v)) for v in m], [mp.mpf(float(v)) for v in s]) for m, s in pairs]


def distance(a: Point, b: Point) -> mp.mpf:
    return mp.sqrt(sum((p - q) ** 2 for p, q in zip(a[0], b[0], strict=True)))


def exact_cnr(a: Point, b: Point) -> mp.mpf:
    apart = [(p - q) / distance(a, b) for p, q in zip(a[0], b[0], strict=True)]
    return distance(a, b) / mp.sqrt(sum(u**2 * (s + t) / 2 for u, s, t in zip(apart, a[1], b[1], strict=True)))


def exact_d_prime(a: Point, b: Point) -> mp.mpf:
    return mp.sqrt(sum((p - q) ** 2 * 2 / (s + t) for p, q, s, t in zip(a[0], b[0], a[1], b[1], strict=True)))


def exact_error(a: Point, b: Point) -> mp.mpf:
    normal = [2 * (p - q) / (s + t) for p, q, s, t in zip(a[0], b[0], a[1], b[1], strict=True)]
    along = sum(w * (p - q) for w, p, q in zip(normal, a[0], b[0], strict=True))
    spread = sum(mp.sqrt(sum(w**2 * s for w, s in zip(normal, each[1], strict=True))) for each in (a, b))
    return mp.erfc(along / spread / mp.sqrt(2)) / 2


def overlap(a: Point, b: Point) -> mp.mpf:
    """Integral of sqrt(p q), channel by channel, cut into pieces about the peak of the product."""
    whole = mp.mpf(1)
    for p, q, s, t in zip(a[0], b[0], a[1], b[1], strict=True):

        def root(x: mp.mpf, p: mp.mpf = p, q: mp.mpf = q, s: mp.mpf = s, t: mp.mpf = t) -> mp.mpf:
            return mp.exp(-((x - p) ** 2) / (4 * s) - (x - q) ** 2 / (4 * t)) / mp.root(4 * mp.pi**2 * s * t, 4)

        peak, width = (p * t + q * s) / (s + t), mp.sqrt(2 * s * t / (s + t))
        # In units of the peak, since the quadrature stops at an absolute error.
        top, ends = root(peak), [peak + k * width for k in (-24, -6, -2, 0, 2, 6, 24)]
        whole *= top * mp.quad(lambda x, root=root, top=top: root(x) / top, ends, method="gauss-legendre")
    return whole


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


@hard_case("contrast to noise of generic diagonal covariances")
def generic_cnr() -> Result:
    """The formula for the nearest of 12 pairs, 50 digits. Allowed: distance 3 eps, direction 4, floor 5: 12 eps."""
    pairs = of_pairs(1, contrast_to_noise)
    return worst((relative(f, exact_cnr(*min(p, key=lambda pair: distance(*pair)))), 12 * EPS) for f, p in pairs)


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
    root = np.sqrt(variance)
    normal = 2 * direction / variance.sum(axis=1)
    x = (normal * direction).sum(axis=1) / np.sqrt((normal[:, None] ** 2 * root**2).sum(axis=2)).sum(axis=1)
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


@hard_case("Bhattacharyya coefficient from near 1 to 1e-300", slow=True)
def bhattacharyya() -> Result:
    """Integral of sqrt(p q), 50 digits. Allowed: the coefficient is exp(-d): 16 eps of d, one rounding of exp."""
    rng = np.random.default_rng(5)
    variance = 10 ** rng.uniform(-2, 2, (15, 2, 2))
    variance[:4, 1] = variance[:4, 0] * (1 + np.array([0.0, 1e-9, 1e-4, 1e-2]))[:, None]
    scale = np.sqrt(variance.sum(axis=1) * rng.dirichlet([1, 1], 15))
    reach = np.sqrt(np.concatenate([[0.0, 1e-12, 1e-6, 1e-3], np.linspace(0.1, 680, 11)]))
    mean = np.stack([np.zeros((15, 2)), 2 * scale * reach[:, None]], axis=1)
    mean[:, 1] += 1000.0
    mean[:, 0] += 1000.0
    found = error_bound(mean, variance, ONE, OTHER)
    exact = [overlap(*points(m, v)) for m, v in zip(mean, variance, strict=True)]
    return worst(
        (relative(f, e), EPS + 16 * EPS * max(1.0, float(-mp.log(e)))) for f, e in zip(found, exact, strict=True)
    )


@hard_case("Bhattacharyya coefficient of variances 1e400 apart")
def far_variances() -> Result:
    """(2 sqrt(s t) / (s + t))^(1/2), 50 digits. Allowed: the coefficient is exp(-d): 16 eps of d, one rounding of exp."""
    results = []
    for s, t in ((1e-200, 1e200), (1e-300, 1e-100), (1e-150, 1e150), (1.0, 1 + 1e-9), (3e-320, 1.0)):
        found = error_bound(np.zeros((1, 2, 1)), np.array([[[s], [t]]]), ONE, OTHER)[0]
        exact = mp.sqrt(2 * mp.sqrt(mp.mpf(s) * t) / (mp.mpf(s) + t))
        results.append((relative(found, exact), EPS + 16 * EPS * max(1.0, float(-mp.log(exact)))))
    return worst(results)


@hard_case("zero covariance")
def zero_covariance() -> Result:
    """Definitions: certain, or nothing told. Allowed: distances of points without noise are certain, coincident points
    tell nothing.
    """
    metrics = (contrast_to_noise, detectability, pairwise_error, error_bound)
    mean = np.array([[[1e8, 2.0], [1e8 + 2.0**-20, 2.0]], [[1e8, 2.0], [1e8, 2.0]]])
    found = [list(metric(mean, np.zeros_like(mean), ONE, OTHER)) for metric in metrics]
    return outcome(found == [[np.inf, 0.0], [np.inf, 0.0], [0.0, 0.5], [0.0, 1.0]])


@hard_case("coincident points with noise")
def coincident_with_noise() -> Result:
    """Closed form. Allowed: a difference of 0 over noise is exactly 0: error 1/2, overlap 1."""
    mean, variance = np.full((1, 2, 3), 1e8), np.full((1, 2, 3), 7.3)
    found = [float(m(mean, variance, ONE, OTHER)[0]) for m in (contrast_to_noise, detectability, pairwise_error)]
    bound = error_bound(mean, variance, ONE, OTHER)[0]
    return outcome([*found, bound] == [0.0, 0.0, 0.5, 1.0])


@hard_case("singular covariance: a channel without variance and with equal means", slow=True)
def singular_without_contrast() -> Result:
    """The same design without that channel, 50 digits. Allowed: 12 eps of each metric's argument; condition of the tail
    1 + x^2, of exp(-d) d.
    """
    results = []
    for mean, variance in zip(*random_designs(6, 10, signals=2, spread=20.0), strict=True):
        m, v = (np.insert(a, 1, b, axis=1)[None] for a, b in ((mean, 1e6), (variance, 0.0)))
        a, b = points(mean, variance)
        error, bound = exact_error(a, b), overlap(a, b)
        results += [
            (relative(contrast_to_noise(m, v, ONE, OTHER)[0], exact_cnr(a, b)), 12 * EPS),
            (relative(detectability(m, v, ONE, OTHER)[0], exact_d_prime(a, b)), 12 * EPS),
            (relative(pairwise_error(m, v, ONE, OTHER)[0], error), 12 * EPS * (1 - 2 * float(mp.log(error))) + TAIL),
            (relative(error_bound(m, v, ONE, OTHER)[0], bound), EPS + 12 * EPS * max(1.0, float(-mp.log(bound)))),
        ]
    return worst(results)


@hard_case("singular covariance: a channel without variance and with different means")
def singular_with_contrast() -> Result:
    """Closed form: told apart for certain; the floor counts only the noise along the line. Allowed: d' infinite, error
    and bound 0; 12 eps of the contrast.
    """
    mean, variance = np.array([[[0.0, 0.0], [3.0, 4.0]]]), np.array([[[2.0, 0.0], [6.0, 0.0]]])
    certain = detectability(mean, variance, ONE, OTHER)[0] == np.inf
    certain &= pairwise_error(mean, variance, ONE, OTHER)[0] == 0 == error_bound(mean, variance, ONE, OTHER)[0]
    contrast = relative(contrast_to_noise(mean, variance, ONE, OTHER)[0], mp.mpf(5) / (mp.mpf(3) / 5 * 2))
    return Result(contrast if certain else np.inf, 12 * EPS)


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
        error, bound = mp.erfc(z / mp.sqrt(2)) / 2, mp.exp(-z * z / 4)
        results += [
            (relative(detectability(m, v, ONE, OTHER)[0], z * mp.sqrt(2)), 12 * EPS),
            (relative(pairwise_error(m, v, ONE, OTHER)[0], error), 12 * EPS * (1 + float(z) ** 2) + TAIL),
            (relative(error_bound(m, v, ONE, OTHER)[0], bound), EPS + 12 * EPS * max(1.0, float(z) ** 2)),
        ]
    return worst(results)


@hard_case("differences and deviations of 1e-150 to 1e200")
def far_scales() -> Result:
    """Closed form of one channel. Allowed: 4 eps: a root, a ratio; nothing is squared."""
    results = []
    for apart, variance in ((1e200, 1.0), (1e-150, 1e-300), (1e200, 1e300), (1e-200, 1.0), (3.0, 1e-300)):
        mean = np.array([[[0.0], [apart]]])
        exact = mp.mpf(apart) / mp.sqrt(mp.mpf(variance))
        for metric in (contrast_to_noise, detectability):
            found = metric(mean, np.full_like(mean, variance), ONE, OTHER)[0]
            results.append((relative(found, exact), 4 * EPS))
    return worst(results)


@hard_case("contrast to noise at a tie of the nearest pair")
def contrast_at_a_tie() -> Result:
    """3-4-5 triangles: the pair with the most noise counts. Allowed: distance and direction from integers; 4 eps of
    direction, floor and ratio.
    """
    mean = np.array([[[0.0, 0.0], [3.0, 4.0], [4.0, 3.0], [-5.0, 0.0], [60.0, 80.0]]])
    variance = np.array([[[1.0, 1.0], [3.0, 1.0], [9.0, 3.0], [2.0, 90.0], [999.0, 999.0]]])
    # (1 + 9) / 2 x 16 / 25 + (1 + 3) / 2 x 9 / 25 = 98 / 25, more than the others' 43 / 25 and 3 / 2.
    exact = 5 / mp.sqrt(mp.mpf(98) / 25)
    orders = [np.array(o) for o in ((1, 2, 3, 4), (4, 3, 2, 1), (2, 4, 1, 3))]
    return worst((relative(contrast_to_noise(mean, variance, ONE, o)[0], exact), 4 * EPS) for o in orders)


@hard_case("a NaN in a mean or in a variance")
def nan_stays() -> Result:
    """NaN for that design, the other designs as alone. Allowed: what is not known is neither certain nor coincident,
    and no other design's.
    """
    mean, variance = random_designs(8, 4)
    metrics = (contrast_to_noise, detectability, pairwise_error, error_bound)
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
        normal = 2 * (mean[1] - mean[0]) / variance.sum(axis=0)
        low, high = (
            np.sort((m + np.sqrt(v) * rng.standard_normal((n, 3))) @ normal)
            for m, v in zip(mean, variance, strict=True)
        )
        # The k-th largest of one meets the k-th smallest of the other where both err k times.
        share = np.searchsorted(high - low[::-1], 0.0) / n
        found = pairwise_error(mean[None], variance[None], ONE, OTHER)[0]
        results.append((abs(found - share), 4 * np.sqrt(found * (1 - found) / n)))
    return worst(results)


def wrong_types(mean: np.ndarray, variance: np.ndarray, kinds: np.ndarray, rng: np.random.Generator, n: int) -> float:
    """How often the most likely signal is of a wrong type, for the signal that errs most often."""
    shares = []
    for signal, kind in enumerate(kinds):
        drawn = mean[signal] + np.sqrt(variance[signal]) * rng.standard_normal((n, mean.shape[1]))
        likely = -((drawn[:, None] - mean) ** 2 / variance + np.log(variance)).sum(axis=2)
        shares.append(float((kinds[likely.argmax(axis=1)] != kind).mean()))
    return max(shares)


@hard_case("the error bounds against the most likely signal", slow=True)
def bounds_hold() -> Result:
    """20,000 draws of each signal, told by maximum likelihood. Allowed: a bound: nothing above it but 4 standard
    deviations of a share of 20,000.
    """
    rng = np.random.default_rng(10)
    n, results = 20_000, []
    for seed in range(12):
        mean, variance = random_designs(20 + seed, 1, spread=float(rng.uniform(20, 200)))
        kinds = np.array([0, 0, 0, 1, 1, 1, 1])
        allowed = 4 * np.sqrt(0.25 / n)
        bound = error_bounds(mean, variance, {"first": FIRST, "second": SECOND})[1][0]
        excess = wrong_types(mean[0], variance[0], kinds, rng, n) - bound
        results.append((max(0.0, excess), allowed))
        kinds = np.array([0, 0, 1, 1, 1, 2, 2])
        members = {str(kind): np.flatnonzero(kinds == kind) for kind in range(3)}
        excess = wrong_types(mean[0], variance[0], kinds, rng, n) - error_bounds(mean, variance, members)[1][0]
        results.append((max(0.0, excess), allowed))
    return worst(results)
