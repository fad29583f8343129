"""Hard cases of a light's image: discs smaller than a pixel and nearly filling the frame, f-numbers from 0.5 to 1000."""

from __future__ import annotations

import math
from functools import cache

import mpmath as mp
import numpy as np

from sweep.camera import sampling
from sweep.camera.disc_image import covered, light_on_pixels
from sweep.camera.mosaic import Mosaic
from sweep.camera.pixel import Pixel
from sweep.camera.psf import DiscProfile, image_fault, otf
from sweep.camera.scene import Scene
from sweep.metrics.smooth import smooth_response

from .cases_chain import FIXED, PAIR, RED, SHARP, YELLOW, lights_of, lines, made, plain, random_qe
from .registry import EPS, Result, hard_case, outcome, relative, worst

WIDTH_UM = 2.1
ONE_LIGHT = np.array([0.55])
NODES, LEAST_PANELS = 32, 8
"""Of the quadrature over frequencies: nodes of a panel, and panels at least."""


def exact_share(x: float, y: float, half: float, radius: float) -> mp.mpf:
    """Share of a square in a disc, as the integral of the height that both have in common."""
    across, along, h, r = mp.mpf(x), mp.mpf(y), mp.mpf(half), mp.mpf(radius)
    low, high = max(across - h, -r), min(across + h, r)
    if low >= high:
        return mp.mpf(0)

    def common(u: mp.mpf) -> mp.mpf:
        height = mp.sqrt(max(mp.mpf(0), r * r - u * u))
        return max(mp.mpf(0), min(along + h, height) - max(along - h, -height))

    bends = [s * mp.sqrt(r * r - e * e) for e in (along - h, along + h) if abs(e) < r for s in (-1, 1)]
    return mp.quad(common, sorted({low, high, *(b for b in bends if low < b < high)})) / (4 * h * h)


def share_result(cases: list[tuple[float, float, float, float]]) -> Result:
    results = []
    for x, y, half, radius in cases:
        found = float(covered(np.array([x]), np.array([y]), half, radius)[0])
        error = abs(float(found - exact_share(x, y, half, radius)))
        results.append((error, 4 * 8 * EPS * radius**2 / (4 * half**2) + EPS))
    return worst(results)


@hard_case("discs smaller than a pixel")
def small_discs() -> Result:
    """Integral of the common height, 50 digits. Allowed: four areas of at most the disc's quarter, 16 roundings each
    (well-conditioned in the place of the edges), over the square.
    """
    places = [(0.0, 0.0), (0.5, 0.0), (0.5, 0.5), (0.48, 0.0), (0.3, 0.47), (1.0, 0.0)]
    return share_result([(x, y, 0.5, r) for x, y in places for r in (1e-6, 0.01, 0.05, 0.3, 0.5)])


@hard_case("discs that just touch a pixel's edge", slow=True)
def touching_discs() -> Result:
    """Integral of the common height, 50 digits. Allowed: four areas of at most the disc's quarter, 16 roundings each
    (well-conditioned in the place of the edges), over the square.
    """
    radii = [0.5, 1.5, 2.5, math.sqrt(0.5), math.sqrt(4.5), 10.5]
    near = [float(v) for r in radii for v in (np.nextafter(r, 0), r, np.nextafter(r, 99), r * (1 + 1e-12))]
    return share_result(
        [(x, y, 0.5, r) for r in near for x, y in ((float(round(r)), 0.0), (1.0, 1.0), (0.0, float(round(r - 0.5))))]
    )


@hard_case("discs half a pixel off, up to 64 pixels of radius")
def whole_discs() -> Result:
    """The disc's area, from the sum over all pixels. Allowed: in each of (2 r + 5)^2 pixels 4 areas of at most the
    quarter disc with 16 roundings each, over the disc.
    """
    results = []
    for radius in (0.05, 0.5, 3.7, 31.5, 63.9, 64.0):
        for off in (0.0, 0.5, 0.25, 1e-9):
            n = math.ceil(radius) + 2
            x, y = np.meshgrid(np.arange(-n, n + 1) - off, np.arange(-n, n + 1) - 0.5)
            total = math.fsum(covered(x, y, 0.5, radius).ravel())
            area = mp.pi * mp.mpf(radius) ** 2
            results.append((relative(total, area), (2 * n + 1) ** 2 * 8 * EPS / math.pi + 4 * EPS))
    return worst(results)


def encircled(radius_um: float, wavelength_um: float, f_number: float) -> mp.mpf:
    """Energy of a point's image within a radius, 1 - J0^2 - J1^2 (Rayleigh)."""
    v = mp.pi * mp.mpf(radius_um) / (mp.mpf(wavelength_um) * mp.mpf(f_number))
    return 1 - mp.besselj(0, v) ** 2 - mp.besselj(1, v) ** 2


@cache
def rule_error(at_end: bool) -> float:
    """Largest error of the panel's rule for a root (x0 - x)^(3/2) that ends at x0, at the panel's end or anywhere."""
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    ends = np.array([1.0]) if at_end else np.linspace(-1, 1, 4001)
    found = (np.maximum(ends[:, None] - nodes, 0.0) ** 1.5) @ weights
    return float(np.abs(found - (ends + 1) ** 2.5 / 2.5).max())


def kink_bound(radius_um: float, reach_um: float, shortest_um: float, wavelength_um: float, f_number: float) -> float:
    """Twice what the rule misses where the transfer function ends, as 8 sqrt(2) / (3 pi) (1 - s)^(3/2), in one panel.

    Elsewhere a panel holds at most 4 cycles, for which 32 nodes are exact to rounding.
    """
    highest = 1 / (shortest_um * f_number)
    panels = LEAST_PANELS + int(highest * (radius_um + reach_um) / 4.0)
    half = highest / panels / 2
    ends = 1 / (wavelength_um * f_number)
    x = 2 * math.pi * radius_um * ends
    before = max(x - 4 * math.pi * radius_um * half, 1e-300)
    bessel = min(x / 2, 0.582, 0.826 / math.sqrt(before))  # |J1| is at most x / 2, its maximum, 0.826 / sqrt(x)
    root = (half / ends) ** 1.5 * 8 * math.sqrt(2) / (3 * math.pi)
    return 2 * 2 * math.pi * radius_um * bessel * root * half * rule_error(wavelength_um == shortest_um)


NUMBERS = (0.5, 1.0, 2.0, 4.0, 16.0, 100.0, 1000.0)
ROUNDINGS = 2e3 * EPS
"""Of a sum of up to 4000 terms that alternate and are of the order of 1 together, added pairwise."""


@hard_case("encircled energy at the center, f/0.5 to f/1000")
def at_the_center() -> Result:
    """1 - J0^2 - J1^2, 50 digits. Allowed: the panel in which the transfer function ends, a root of power 3/2: the
    rule's own error for it; 2000 eps of rounding.
    """
    results = []
    for f_number in NUMBERS:
        for radius in (0.01, 1.0, 12.0):
            found = DiscProfile(radius, 0.1 * radius, ONE_LIGHT, f_number, 0.0).at(np.zeros(1))[0, 0]
            allowed = kink_bound(radius, 0.1 * radius, 0.55, 0.55, f_number) + ROUNDINGS
            results.append((abs(float(found - encircled(radius, 0.55, f_number))), allowed))
    return worst(results)


@hard_case("several wavelengths on one grid of frequencies")
def many_wavelengths() -> Result:
    """1 - J0^2 - J1^2, 50 digits. Allowed: the panel in which the transfer function ends, a root of power 3/2: the
    rule's own error for it; 2000 eps of rounding.
    """
    waves, results = np.array([0.4, 0.473, 0.55, 0.61, 0.7]), []
    for f_number in NUMBERS:
        for radius in (1.0, 12.0):
            found = DiscProfile(radius, radius, waves, f_number, 0.0).at(np.zeros(1))[0]
            for value, wave in zip(found, waves, strict=True):
                allowed = kink_bound(radius, radius, 0.4, float(wave), f_number) + ROUNDINGS
                results.append((abs(float(value - encircled(radius, float(wave), f_number))), allowed))
    return worst(results)


@hard_case("transfer in focus, f/0.5 to f/1000")
def transfer_in_focus() -> Result:
    """(2 / pi)(acos s - s sqrt(1 - s^2)), 50 digits; 0 beyond the cutoff. Allowed: its slope by s is at most 4 / pi,
    with 3 roundings of s, and two terms of at most pi / 2: 4 eps.
    """
    results = []
    for f_number in NUMBERS:
        for share in (0.0, 1e-9, 0.1, 0.5, 0.9, 0.999999, 1 - 1e-12, 1 - 1e-15, 1.0, 1.5):
            nu = share / (0.55 * f_number)
            s = min(mp.mpf(nu) * mp.mpf(0.55) * mp.mpf(f_number), mp.mpf(1))
            exact = 2 / mp.pi * (mp.acos(s) - s * mp.sqrt(1 - s * s))
            found = otf(np.array([nu]), ONE_LIGHT, f_number, 0.0)[0, 0]
            results.append((abs(float(found - exact)), 4 * EPS))
            if share > 1:
                results.append((abs(float(found)), 0.0))
    return worst(results)


@hard_case("transfer out of focus, up to 1000 waves of blur", slow=True)
def transfer_out_of_focus() -> Result:
    """Autocorrelation of the pupil: (4 / pi) integral of cos(8 pi W s x / lambda) sqrt(1 - (x + s)^2), 50 digits.
    Allowed: 8 roundings of a phase p that is passed to a cosine, and a pairwise sum of terms of at most 1: (8 p + 40)
    eps.
    """
    results = []
    for w20 in (1e-9, 0.1, 3.0, 67.0):
        for share in (0.01, 0.3, 0.9, 0.999):
            f_number = 2.0
            nu = share / (0.55 * f_number)
            s = mp.mpf(nu) * mp.mpf(0.55) * f_number
            k = 8 * mp.pi * mp.mpf(w20) * s / mp.mpf(0.55)

            def along(x: mp.mpf, s: mp.mpf = s, k: mp.mpf = k) -> mp.mpf:
                return mp.cos(k * x) * mp.sqrt(max(mp.mpf(0), 1 - (x + s) ** 2))

            with mp.workdps(25):
                pieces = mp.linspace(0, 1 - s, 2 + int(k * (1 - s) / 20))
                exact = 4 / mp.pi * mp.quad(along, pieces)
            found = otf(np.array([nu]), ONE_LIGHT, f_number, w20)[0, 0]
            results.append((abs(float(found - exact)), (8 * float(k) + 40) * EPS))
    return worst(results)


def disc_scene(across_px: float, **target: object) -> dict[str, object]:
    """A light of so many pixels: 2 atan(d / 2D) of 1 rad per 1000 px, in a scene of fixed exposure."""
    distance = 0.1 / math.tan(across_px / 1000 / 2)
    geometry = {"distance_m": distance, "fov_deg": math.degrees(1.0), "width_px": 1000, **target}
    return FIXED | {"target": geometry}


def response_of(scenario: dict[str, object], cfa: str = "RGGB") -> np.ndarray:
    qe = random_qe(21, len(Mosaic.from_name(cfa).channels))
    setup = made(qe, lights_of(PAIR, lines(YELLOW, RED)), scenario, cfa=cfa, left_out=SHARP)
    return smooth_response(setup, plain(setup))[0, 0]


@hard_case("a light of a tenth of a pixel, on a pixel, between two and between four", slow=True)
def tiny_light() -> Result:
    """Exact overlaps of disc, readout and pixels by integration, 50 digits. Allowed: shares of a pixel within 8 eps
    each, a sum over at most 25 pixels, 16 roundings of the response: 64 eps of full light.
    """
    whole, results, r = response_of(FIXED), [], 0.05
    readout = math.hypot(2, 2) / 2
    for place in ((0.0, 0.0), (0.5, 0.0), (0.5, 0.5), (1.25, 0.5)):
        found = response_of(disc_scene(0.1, phase_px=list(place)))
        for channel, at in enumerate(([(0, 0)], [(0, 1), (1, 0)], [(1, 1)])):
            light, weight = mp.mpf(0), mp.mpf(0)
            for row, column in at:
                for y in np.arange(row - 4, row + 6, 2) - place[1]:
                    for x in np.arange(column - 4, column + 6, 2) - place[0]:
                        taken = exact_share(float(x), float(y), 0.5, readout) if math.hypot(x, y) < 3 else mp.mpf(0)
                        light += taken * exact_share(float(x), float(y), 0.5, r) if taken else 0
                        weight += taken
            for signal in (0, 1):
                full = float(whole[signal, channel])
                results.append((abs(float(found[signal, channel] - full * light / weight)), 64 * EPS * full))
    return worst(results)


@hard_case("a light that nearly fills the largest frame, read at its center")
def nearly_filled_frame() -> Result:
    """The response to a light without an edge. Allowed: every pixel of the readout is inside the disc by 60 pixels:
    shares within 16 eps of 64^2, as a rounding of areas.
    """
    whole, results = response_of(FIXED, "RYYC"), []
    for across in (100.0, 127.99):
        for place in ([0.0, 0.0], [0.5, 0.5]):
            found = response_of(disc_scene(across, readout="center", phase_px=place), "RYYC")
            off = float(np.abs(found / whole - 1).max())
            results.append((off, 16 * EPS * (across / 2) ** 2 + 16 * EPS))
    return worst(results)


@hard_case("lights on both sides of the 128 pixel limit")
def size_limit() -> Result:
    """Allowed up to the limit, refused beyond. Allowed: the limit is on the diameter; what is refused names it."""

    def refusal(across_px: float, f_number: float) -> str | None:
        scenario = Scene.model_validate(disc_scene(across_px) | {"optics": {"f_number": f_number}})
        found = image_fault(scenario, Pixel())
        return None if found is None else found.problem

    sizes = [refusal(across, 4.0) for across in (1e-3, 127.99, 128.01, 1000.0)]
    numbers = [refusal(30.0, f_number) for f_number in (0.4, 0.5, 1000.0)]
    return outcome(
        sizes == [None, None, *["the light is too large"] * 2] and numbers == ["the image is too fine", None, None]
    )


@hard_case("a pixel in the middle of a blurred light, f/2 and f/1000")
def blurred_pixels() -> Result:
    """1 - J0^2 - J1^2 at the middle of a pixel of a tenth, 50 digits. Allowed: the image bends by at most k^2 / 4, k =
    2 pi / (lambda N), over the pixel; the rule's error as at the center.
    """
    results = []
    for f_number in (2.0, 1000.0):
        radius = 6.2
        profile = DiscProfile(radius, 14.0, ONE_LIGHT, f_number, 0.0)
        seen = sampling.window(Mosaic.from_name("RGGB"), np.array([[0.0, 0.0]]), 1.0)
        wanted = np.hypot(seen.dx, seen.dy) < 0.1
        light = light_on_pixels(seen, wanted, 0.05, radius / WIDTH_UM, profile, WIDTH_UM).by_pixel()[wanted][0, 0]
        exact = float(encircled(radius, 0.55, f_number))
        bend = (2 * math.pi / (0.55 * f_number)) ** 2 / 4 * (0.05 * WIDTH_UM) ** 2 * 2 / 3 / 2
        allowed = kink_bound(radius, 14.0, 0.55, 0.55, f_number) + ROUNDINGS + bend * min(1.0, exact)
        results.append((abs(float(light - exact)), allowed))
    return worst([*results, (relative(float(otf(np.zeros(1), ONE_LIGHT, 2.0, 0.0)[0, 0]), mp.mpf(1)), EPS)])
