"""Hard cases of noise: a few photons and ten million, clipped ends, rounding, one signal far brighter than the others."""

from __future__ import annotations

import mpmath as mp
import numpy as np

from sweep.camera.camera import Camera
from sweep.camera.model import SceneModel
from sweep.camera.mosaic import Mosaic
from sweep.camera.noise.gaussian import rounding
from sweep.camera.noise.law import pixel_law
from sweep.camera.noise.moments import moments
from sweep.camera.pixel import Pixel
from sweep.camera.scene import Scene
from sweep.camera.setup import Setup
from sweep.metrics.evaluate import evaluate
from sweep.spectra.lights import Lights
from sweep.spectra.spectrum import WavelengthGrid

from ..draws import draws_dn
from .registry import EPS, Result, hard_case, outcome, worst

PLAIN = Pixel(read_noise_e=2.0, offset_dn=64.0)
PIXELS = {
    "plain": PLAIN,
    "no pedestal": Pixel(read_noise_e=3.0),
    "hardly any read noise": Pixel(read_noise_e=0.05),
    "no read noise": Pixel(offset_dn=10.0),
    "ADC first": Pixel(read_noise_e=0.5, gain_dn_per_e=0.6),
    "well below the ADC": Pixel(well_e=9990.5, gain_dn_per_e=0.2, read_noise_e=0.3, offset_dn=168.3),
}
DEEP = Pixel(well_e=1e7, bits=24, read_noise_e=2.0, offset_dn=100.0)
Moments = tuple[mp.mpf, mp.mpf]


def read_out(held_e: mp.mpf, pixel: Pixel) -> Moments:
    """First and second moment of the digital number, before rounding, of a number of electrons."""
    top, sigma = mp.mpf(pixel.full_scale_dn), mp.mpf(pixel.read_noise_e) * pixel.dn_per_e
    mean = held_e * pixel.dn_per_e + pixel.offset_dn
    if sigma == 0:
        held = min(max(mean, mp.mpf(0)), top)
        return held, held**2
    a, b = -mean / sigma, (top - mean) / sigma
    inside = mp.ncdf(b) - mp.ncdf(a) if a + b < 0 else mp.ncdf(-a) - mp.ncdf(-b)
    first = mean * inside + sigma * (mp.npdf(a) - mp.npdf(b)) + top * mp.ncdf(-b)
    # E[x^2; a..b] by parts: (m^2 + s^2) inside + s (m + 0) density(a) - s (m + top) density(b).
    second = (mean**2 + sigma**2) * inside + sigma * (mean * mp.npdf(a) - (mean + top) * mp.npdf(b))
    return first, second + top**2 * mp.ncdf(-b)


def stepped(held_e: mp.mpf, pixel: Pixel) -> Moments:
    """The same of the rounded number, about 0: the chance of every step within 12 deviations."""
    top, sigma = pixel.full_scale_dn, mp.mpf(pixel.read_noise_e) * pixel.dn_per_e
    mean = held_e * pixel.dn_per_e + pixel.offset_dn
    center = min(max(mp.floor(mean + mp.mpf(1) / 2), mp.mpf(0)), mp.mpf(top))
    if sigma == 0:
        return center, mp.mpf(0)
    first = second = mp.mpf(0)
    for side, room in ((1, top - center), (-1, center)):
        for step in range(1, int(min(room, 12 * sigma + 2)) + 1):
            passed = mp.ncdf((side * (mean - center) - step + mp.mpf(1) / 2) / sigma)
            first, second = first + side * passed, second + (2 * step - 1) * passed
    return center + first, second - first**2


def exact_moments(electrons: float, pixel: Pixel) -> tuple[mp.mpf, mp.mpf, mp.mpf]:
    """Mean before rounding, mean and variance after it, of Poisson electrons: the sum over their counts."""
    n = mp.mpf(electrons)
    counts = range(max(0, int(n - 10 * mp.sqrt(n) - 2)), int(n + 10 * mp.sqrt(n) + 40))
    share = mp.exp(counts[0] * mp.log(n) - n - mp.loggamma(counts[0] + 1)) if n else mp.mpf(1)
    full = read_out(mp.mpf(pixel.well_e), pixel)[0], *stepped(mp.mpf(pixel.well_e), pixel)
    terms = []
    for count in counts:
        if share > 1e-25:
            held = mp.mpf(count)
            each = full if held >= pixel.well_e else (read_out(held, pixel)[0], *stepped(held, pixel))
            terms.append((share, *each))
        share *= n / (count + 1)
    unrounded, rounded = (sum(w * t[k] for w, *t in terms) for k in (0, 1))
    return unrounded, rounded, sum(w * (t[2] + (t[1] - rounded) ** 2) for w, *t in terms)


def deep_moments(electrons: float) -> tuple[mp.mpf, mp.mpf, mp.mpf]:
    """Of the deep pixel, which 1.7 DN of read noise dither at every count: straight, or at its very end."""
    n, gain = mp.mpf(electrons), mp.mpf(DEEP.dn_per_e)
    mean = gain * n + DEEP.offset_dn
    return mean, mean, gain**2 * (n + mp.mpf(DEEP.read_noise_e) ** 2) + mp.mpf(1) / 12


def moments_result(cases: list[tuple[Pixel, float]]) -> Result:
    """Errors of means and variance against what sums over the counts within 10 deviations may lose to rounding."""
    results = []
    with mp.workdps(25):
        for pixel, electrons in cases:
            found = [float(m) for m in moments(np.array([electrons]), pixel)[:, 0]]
            exact = deep_moments(electrons) if pixel is DEEP else exact_moments(electrons, pixel)
            reach = 10 * pixel.dn_per_e * np.hypot(np.sqrt(electrons), pixel.read_noise_e) + 1
            reach = min(reach, float(pixel.full_scale_dn))
            center = min(pixel.full_scale_dn, pixel.dn_per_e * electrons + pixel.offset_dn)
            # A share is a product of ratios from the most frequent count on, a rounding each.
            terms = 240 + 10 * np.sqrt(min(electrons, 1.1 * pixel.well_e))
            allowed = terms * EPS * reach + 4 * EPS * center
            results += [(abs(float(f - e)), allowed) for f, e in zip(found[:2], exact[:2], strict=True)]
            results.append((abs(float(found[2] - exact[2])), 2 * reach * allowed))
    return worst(results)


@hard_case("electrons of 1e-3")
def few_electrons() -> Result:
    """Sum over counts and steps, 25 digits. Allowed: a rounding for each count within 10 deviations, of at most 10
    deviations, and of the value; squares for variances.
    """
    return moments_result([(pixel, 1e-3) for pixel in (*PIXELS.values(), DEEP)])


@hard_case("electrons of 9e6", slow=True)
def many_electrons() -> Result:
    """Sum over counts and steps, 25 digits; straight. Allowed: a rounding for each count within 10 deviations, of at
    most 10 deviations, and of the value; squares for variances.
    """
    return moments_result([(pixel, 9e6) for pixel in (PLAIN, PIXELS["well below the ADC"], DEEP)])


@hard_case("electrons of 0, and of half a photon")
def dark() -> Result:
    """Sum over counts and steps, 25 digits. Allowed: a rounding for each count within 10 deviations, of at most 10
    deviations, and of the value; squares for variances.
    """
    return moments_result([(pixel, n) for pixel in (PLAIN, PIXELS["hardly any read noise"], DEEP) for n in (0.0, 0.5)])


@hard_case("electrons at full well and at the ADC's end", slow=True)
def at_the_ends() -> Result:
    """Sum over counts and steps, 25 digits. Allowed: a rounding for each count within 10 deviations, of at most 10
    deviations, and of the value; squares for variances.
    """
    cases = [(PIXELS[name], 9990.0) for name in ("hardly any read noise", "no read noise")]
    return moments_result([*cases, (PIXELS["ADC first"], 6700.0), (PIXELS["well below the ADC"], 9990.0)])


def chain(pixel: Pixel) -> SceneModel:
    """A scene of noise whose table of readouts the chain uses."""
    grid = WavelengthGrid(step_nm=100)
    lights = Lights("two", ("a", "b"), ("a", "b"), np.eye(4)[:2] / 100, 1.0, "", True)
    scenario = Scene.model_validate({"noise": True, "exposure": {"kind": "fixed", "exposure_s": 1.0}})
    return SceneModel(
        Setup(Camera(grid, Mosaic.from_rows("W", [["W"]]), np.ones((1, 4)), (), np.ones(4), pixel), lights, scenario)
    )


@hard_case("one signal far brighter than the others", slow=True)
def a_blinding_signal() -> Result:
    """Sum over counts and steps, 25 digits. Allowed: cubic table at 1/32 of a deviation: 5/384 / 32^4 x 16 x 0.8 of a
    deviation; of rounding, 177 x 0.5 DN for 12.8.
    """
    electrons, results = np.array([1e-3, 10.0, 10_100.0]), []
    pixel = PLAIN
    exact, allowed = [], []
    for n in electrons:
        with mp.workdps(25):
            exact.append(exact_moments(float(n), pixel)[1])
        wide = pixel.dn_per_e * np.hypot(np.sqrt(n), pixel.read_noise_e)
        allowed.append((12.8 * wide + 177 * 0.5) * 5 / 384 / 32**4)
    model = chain(pixel)
    for brightest in (2e4, 1e8, 1e12, 1e100, 1e300, np.inf):
        found = model.readout.convert(np.append(electrons, brightest))[:-1]
        results += [(abs(float(f - e)), a) for f, e, a in zip(found, exact, allowed, strict=True)]
    return worst(results)


def steps(mean: mp.mpf, sigma: mp.mpf) -> Moments:
    """Mean and variance of round(x) about round(mean), by the probability of every integer within 15 sigma."""
    center, first, second = mp.floor(mean + mp.mpf(1) / 2), mp.mpf(0), mp.mpf(0)
    reach = int(15 * sigma) + 3
    upper = mp.ncdf((center - reach - mp.mpf(1) / 2 - mean) / sigma)
    for k in range(-reach, reach + 1):
        lower, upper = upper, mp.ncdf((center + k + mp.mpf(1) / 2 - mean) / sigma)
        first += k * (upper - lower)
        second += k**2 * (upper - lower)
    return center + first, second - first**2


@hard_case("variance of a rounded value, little and much noise", slow=True)
def rounded_variance() -> Result:
    """Probability of every integer, 50 digits. Allowed: up to 6 terms left out below exp(-2 (7 pi / 2)^2), or tails
    beyond 11 sigma; 60 roundings of a variance + 1.
    """
    results = []
    for sigma in (0.01, 0.1, 0.3, 0.4999, 0.5, 0.8, 1.4999, 1.5, 4.0):
        for mean in (0.0, 0.25, 0.5, 0.4999, 100.2, 4094.7):
            found = float(rounding(np.array([mean]), np.array([sigma]))[1][0])
            exact = steps(mp.mpf(mean), mp.mpf(sigma))[1]
            # The mean is rounded where it is taken from the nearest integer; a step is at most 1 / sigma steep.
            results.append((abs(float(found - exact)), 60 * EPS * (1 + sigma**2) + EPS * mean / sigma))
    return worst(results)


@hard_case("variance of a rounded value without noise, and of 1e14 DN^2")
def rounded_extremes() -> Result:
    """0; 1/4 halfway between integers; the variance and 1/12. Allowed: certain; a fair coin between two integers; 2
    roundings of the variance.
    """
    still = rounding(np.array([0.0, 0.3, 100.7, 4095.0, 17.5]), np.zeros(5))[1]
    results = [(abs(float(v)), 0.0) for v in still[:4]] + [(abs(float(still[4]) - 0.25), EPS)]
    found = rounding(np.array([1e7]), np.array([1e7]))[1][0]
    return worst([*results, (abs(found - 1e14 - 1 / 12) / 1e14, 2 * EPS)])


def drawn(electrons: float, pixel: Pixel) -> list[tuple[float, float]]:
    """Mean and variance of 500,000 draws against the sums."""
    draws = draws_dn(np.full(500_000, electrons), pixel, np.random.default_rng(5))
    _, mean, variance = moments(np.array([electrons]), pixel)[:, 0]
    fourth = float(((draws - draws.mean()) ** 4).mean())
    band = 4 * np.sqrt(max(fourth - variance**2, 0.0) / draws.size)
    return [
        (abs(float(draws.mean() - mean)), float(4 * np.sqrt(variance / draws.size))),
        (abs(float(draws.var() - variance)), float(band)),
    ]


@hard_case("draws of Poisson means of 1e-3 and 9e6")
def poisson_draws() -> Result:
    """500,000 simulated readouts. Allowed: 4 standard deviations of mean and variance."""
    return worst([*drawn(1e-3, PLAIN), *drawn(9e6, DEEP)])


@hard_case("everything clipped, with noise")
def all_clipped() -> Result:
    """Full scale, exactly the same for signals of 1e8 to 1e300 electrons. Allowed: beyond the full well the table
    stands still: gain x full well, rounded once; counts below it are rarer than 1e-20.
    """
    model = chain(Pixel())
    electrons = np.array([1e8, 2e8, 1e14, 1e100, 1e300, np.inf])
    found = model.readout.convert(electrons)
    spread = float(np.ptp(found) + pixel_law(Pixel()).at(0, electrons, 2)[1].max())
    return worst([(spread, 1e-20 * 4095), (float(np.abs(found - 4095).max()), EPS * 4095)])


@hard_case("noise metrics of signals that all fill the range", slow=True)
def metrics_of_the_clipped() -> Result:
    """Coincident: CSD and d' exactly 0, error 1/2. Allowed: equal means differ by exactly 0."""
    found = evaluate(chain(PLAIN), np.empty((1, 0, 4)), ["a", "b"])
    return outcome((found["csd_a_b"][0], found["dprime_a_b"][0], found["error_a_b"][0]) == (0.0, 0.0, 0.5))
