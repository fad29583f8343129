"""Hard cases of noise: a few photons and ten million, clipped ends, rounding, one signal far brighter than the others."""

from __future__ import annotations

import mpmath as mp
import numpy as np

from sweep.datasets.lights import Lights
from sweep.effects.noise import draws_dn, moments_dn
from sweep.effects.quantization import variance_of_rounded
from sweep.evaluate import evaluate
from sweep.imaging import Imager
from sweep.mosaics import Mosaic
from sweep.scenes import Scenario
from sweep.sensor import Pixel
from sweep.setup import Setup
from sweep.spectra import WavelengthGrid

from .hard_cases import EPS, Result, hard_case, outcome, worst

PLAIN = Pixel(read_noise_e=2.0, offset_dn=64.0, prnu=0.01)
PIXELS = {
    "plain": PLAIN,
    "no pedestal": Pixel(read_noise_e=3.0),
    "hardly any read noise": Pixel(read_noise_e=0.05),
    "no read noise": Pixel(offset_dn=10.0),
    "ADC first": Pixel(read_noise_e=0.5, gain_dn_per_e=0.6),
    "much PRNU": Pixel(read_noise_e=2.0, prnu=0.4),
}
DEEP = Pixel(well_e=2e7, bits=24, read_noise_e=2.0, offset_dn=100.0)
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


def exact_moments(electrons: float, pixel: Pixel) -> Moments:
    """Mean and variance of the readout of Gaussian electrons, by integration over their deviation z."""
    n, well = mp.mpf(electrons), mp.mpf(pixel.well_e)
    sigma = mp.sqrt(n + (mp.mpf(pixel.prnu) * n) ** 2)
    base = read_out(min(n, well), pixel)[0]

    def around(held_e: mp.mpf) -> mp.mpc:
        first, second = read_out(held_e, pixel)
        return mp.mpc(first - base, second - 2 * first * base + base**2)

    if sigma == 0:
        moments = around(n)
        return base + moments.real, moments.imag - moments.real**2
    end = (well - n) / sigma
    moments = mp.ncdf(-end) * around(well)
    last, cuts = min(mp.mpf(13), end), {mp.mpf(-13)}
    bends = [((at - pixel.offset_dn) / mp.mpf(pixel.dn_per_e) - n) / sigma for at in (0, pixel.full_scale_dn)]
    cuts |= {bend + k * pixel.read_noise_e / sigma for bend in bends for k in (-9, -3, 0, 3, 9)}
    cuts |= {mp.mpf(k) for k in (-6, -3, -1, 1, 3, 6)}
    if last > -13:
        ends = sorted({cut for cut in cuts if -13 <= cut < last} | {last})
        moments += mp.quad(lambda z: mp.npdf(z) * around(n + z * sigma), ends, method="gauss-legendre")
    return base + moments.real, moments.imag - moments.real**2


def moments_result(cases: list[tuple[Pixel, float]]) -> Result:
    """Errors of mean and variance against what 240 weighed terms over 9 sigma may lose to rounding."""
    results = []
    with mp.workdps(25):
        for pixel, electrons in cases:
            mean, variance = (float(m[0]) for m in moments_dn(np.array([electrons]), pixel))
            exact = exact_moments(electrons, pixel)
            reach = (
                9 * pixel.dn_per_e * np.hypot(np.sqrt(electrons + (pixel.prnu * electrons) ** 2), pixel.read_noise_e)
            )
            reach = min(reach, float(pixel.full_scale_dn))
            center = min(pixel.full_scale_dn, pixel.dn_per_e * electrons + pixel.offset_dn)
            allowed = 240 * EPS * reach + 4 * EPS * center
            results.append((abs(float(mean - exact[0])), allowed))
            results.append((abs(float(variance - exact[1])), 2 * reach * allowed))
    return worst(results)


WHY = "panels without a corner, so 240 terms of at most 9 sigma and the rounding of the value itself; squares for variances"


@hard_case("electrons of 1e-3", oracle="integral over the deviation, 25 digits", why=WHY)
def few_electrons() -> Result:
    return moments_result([(pixel, 1e-3) for pixel in (*PIXELS.values(), DEEP)])


@hard_case("electrons of 1e7", oracle="integral over the deviation, 25 digits", why=WHY)
def many_electrons() -> Result:
    return moments_result([(pixel, 1e7) for pixel in (*PIXELS.values(), DEEP)])


@hard_case("electrons of 0, and of half a photon", oracle="integral over the deviation, 25 digits", why=WHY)
def dark() -> Result:
    return moments_result([(pixel, n) for pixel in (PLAIN, PIXELS["hardly any read noise"], DEEP) for n in (0.0, 0.5)])


@hard_case("electrons at full well and at the ADC's end", oracle="integral over the deviation, 25 digits", why=WHY)
def at_the_ends() -> Result:
    cases = [(PIXELS[name], 9990.0) for name in ("plain", "no pedestal", "hardly any read noise", "no read noise")]
    return moments_result([*cases, (PIXELS["ADC first"], 6700.0), (PIXELS["much PRNU"], 9990.0), (DEEP, 2e7)])


def chain(pixel: Pixel) -> Imager:
    """A scene of noise whose table of readouts the chain uses."""
    grid = WavelengthGrid(step_nm=100)
    lights = Lights("two", ("a", "b"), ("a", "b"), np.eye(4)[:2] / 100, 1.0, "", True)
    scenario = Scenario.model_validate({"noise": True, "exposure": {"kind": "fixed", "exposure_s": 1.0}})
    return Imager(Setup(grid, Mosaic.from_rows("W", [["W"]]), np.ones((1, 4)), (), np.ones(4), lights, pixel, scenario))


@hard_case(
    "one signal far brighter than the others",
    oracle="integral over the deviation, 25 digits",
    why="cubic table at 1/128 sigma: sigma x 0.8 x 5/384 / 128^4 of the mean, and its rounding, times the dither's slope 3",
)
def a_blinding_signal() -> Result:
    electrons, results = np.array([1e-3, 10.0, 9900.0, 10_100.0]), []
    for pixel in (PLAIN, PIXELS["much PRNU"]):
        exact, allowed = [], []
        for n in electrons:
            with mp.workdps(25):
                mean = exact_moments(float(n), pixel)[0]
                wide = mp.sqrt(n + (pixel.prnu * mp.mpf(n)) ** 2 + pixel.read_noise_e**2) * pixel.dn_per_e
                exact.append(mean + dither(mean, wide))
            allowed.append(3 * (float(wide) * 0.8 * 5 / 384 / 128**4 + 500 * EPS * float(mean + 9 * wide)))
        imager = chain(pixel)
        for brightest in (2e4, 1e8, 1e12, 1e100, 1e300, np.inf):
            found = imager.transfer(np.append(electrons, brightest))[:-1]
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


def dither(mean: mp.mpf, sigma: mp.mpf) -> mp.mpf:
    """What rounding adds to a mean; less than 1e-8000 DN from 30 DN of noise on."""
    return mp.mpf(0) if sigma > 30 else steps(mean, sigma)[0] - mean


@hard_case(
    "variance of a rounded value, little and much noise",
    oracle="probability of every integer, 50 digits",
    why="up to 6 terms left out below exp(-2 (7 pi / 2)^2), or tails beyond 11 sigma; 60 roundings of a variance + 1",
)
def rounded_variance() -> Result:
    results = []
    for sigma in (0.01, 0.1, 0.3, 0.4999, 0.5, 0.8, 1.4999, 1.5, 4.0):
        for mean in (0.0, 0.25, 0.5, 0.4999, 100.2, 4094.7):
            found = float(variance_of_rounded(np.array([mean]), np.array([sigma**2]))[0])
            exact = steps(mp.mpf(mean), mp.sqrt(mp.mpf(sigma**2)))[1]
            # The mean is rounded where it is taken from the nearest integer; a step is at most 1 / sigma steep.
            results.append((abs(float(found - exact)), 60 * EPS * (1 + sigma**2) + EPS * mean / sigma))
    return worst(results)


@hard_case(
    "variance of a rounded value without noise, and of 1e14 DN^2",
    oracle="0; 1/4 halfway between integers; the variance and 1/12",
    why="certain; a fair coin between two integers; 2 roundings of the variance",
)
def rounded_extremes() -> Result:
    still = variance_of_rounded(np.array([0.0, 0.3, 100.7, 4095.0, 17.5]), np.zeros(5))
    results = [(abs(float(v)), 0.0) for v in still[:4]] + [(abs(float(still[4]) - 0.25), EPS)]
    found = variance_of_rounded(np.array([1e7]), np.array([1e14]))[0]
    return worst([*results, (abs(found - 1e14 - 1 / 12) / 1e14, 2 * EPS)])


def drawn(electrons: float, pixel: Pixel, poisson: float) -> list[tuple[float, float]]:
    """Mean and variance of 500,000 draws against the moments with rounding; `poisson`: how far the Gaussian is off."""
    draws = draws_dn(np.full(500_000, electrons), pixel, np.random.default_rng(5))
    mean, variance = moments_dn(np.array([electrons]), pixel)
    rounded = float(variance_of_rounded(mean, variance)[0])
    spread = 4 * np.sqrt(rounded / draws.size)
    fourth = float(((draws - draws.mean()) ** 4).mean())
    band = 4 * np.sqrt(max(fourth - rounded**2, 0.0) / draws.size)
    shift = float(dither(mp.mpf(float(mean[0])), mp.sqrt(float(variance[0]))))
    return [
        (abs(float(draws.mean() - mean[0]) - shift), float(spread) + poisson),
        (abs(float(draws.var()) - rounded), float(band) + poisson),
    ]


@hard_case(
    "draws of Poisson means of 1e-3 and 1e7",
    oracle="500,000 simulated readouts",
    why="4 standard deviations of mean and variance; of 1e-3 photons, a Gaussian's third moment in place of a Poisson's: 1e-3",
)
def poisson_draws() -> Result:
    return worst([*drawn(1e-3, PLAIN, 1e-3 * PLAIN.dn_per_e), *drawn(1e7, DEEP, 0.0)])


@hard_case(
    "everything clipped, with noise",
    oracle="full scale, exactly the same for signals of 1e8 to 1e300 electrons",
    why="tails 100 sigma away are 0 in float64, so all are gain x full well, rounded once; their variance is 0",
)
def all_clipped() -> Result:
    imager = chain(Pixel())
    electrons = np.array([1e8, 2e8, 1e14, 1e100, 1e300, np.inf])
    found = imager.transfer(electrons)
    spread = float(np.ptp(found) + imager.variance_dn(electrons).max())
    return worst([(spread, 0.0), (float(np.abs(found - 4095).max()), EPS * 4095)])


@hard_case(
    "noise metrics of signals that all fill the range",
    oracle="coincident: CSD, contrast and d' exactly 0, error 1/2, bound 1",
    why="equal means differ by exactly 0",
)
def metrics_of_the_clipped() -> Result:
    found = evaluate(chain(PLAIN), np.empty((1, 0, 4)), ["a", "b"])
    bright = found["csd_a_b"][0], found["dprime_a_b"][0], found["cnr_a_b"][0]
    return outcome((*bright, found["error_a_b"][0], found["error_bound_a_b"][0]) == (0.0, 0.0, 0.0, 0.5, 1.0))
