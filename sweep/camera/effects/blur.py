"""Diffraction and defocus: a disc seen through a lens without aberrations, exact.

The image of a disc of radius R is a function of the distance r from its center,
  h(r) = 2 pi R integral_0^(1 / lambda N) J1(2 pi R nu) J0(2 pi r nu) OTF(nu) dnu,
since the transfer function ends at nu = 1 / (lambda N), the cutoff of a cone with sin = 1 / 2N (the irradiance, as
ISETCam's, is that of tan = 1 / 2N; they differ by 0.8 % at f/4). OTF with defocus W20 (Hopkins), s = lambda N nu:
  OTF = (4 / pi) integral_0^acos(s) sin^2 p cos(8 pi W20 N nu (cos p - s)) dp.
"""

from __future__ import annotations

import math
from functools import cached_property, lru_cache
from itertools import pairwise

import numpy as np

from ...base.cache import Cache
from ...base.types import FloatArray
from .. import legendre
from ..bessel import FewRadii, sums_of_j0
from ..pixel import Pixel
from ..scene import Scene
from ..shot import Shot
from ..splines import spline_through
from .base import Change, Chosen, Designs, KernelChange, KernelEffect, Load, Part, Stage

COARSE = "every 10 nm"
"""The interpolated method on whose wavelengths kernels are compared when a plan is made."""
_SPACING_NM = {"every 10 nm": 10.0, "every 5 nm": 5.0, "every 2 nm": 2.0}
_SHORTEST_UM = 0.4
PROFILE_S, WHOLE_IMAGE_S = 7e-11, 3.2e-6
"""Seconds: of a radius, a frequency and a wavelength of the image, and of a wavelength of its mean over a readout
without pixels; `tests/bench_work.py` measures them."""
_PANEL_NODES = 32
_CYCLES_PER_PANEL = 4.0
_SPLINE_PER_CYCLE = 24
"""Nodes of the table of h(r) per period of the highest frequency."""
_ROUNDING = 2e-13
"""No value of the table is further from the sum of its functions, relative to a uniform field."""


def defocus_um(scenario: Scene, pitch_um: float) -> float:
    """W20, the wavefront's defocus at the edge of the pupil, micrometers: image shift / (8 N^2)."""
    target, focus_m = scenario.target, scenario.optics.focus_m
    if target is None or focus_m is None:
        return 0.0
    f = target.focal_length_um(pitch_um)
    image = [f * d / (d - f) for d in (target.distance_m * 1e6, focus_m * 1e6)]
    return abs(image[0] - image[1]) / (8 * scenario.optics.f_number**2)


_MOST_PX = 128.0
_MOST_PERIODS = 400.0


def too_much(scenario: Scene, pixel: Pixel) -> tuple[tuple[str, ...], str, str, str] | None:
    """Why a target's image is not computed: where it is set, problem, value, what is allowed; None when it is."""
    target, optics = scenario.target, scenario.optics
    if target is None:
        return None
    across = target.object_resolution_px
    if across > _MOST_PX:
        uniform = f"at most {_MOST_PX:g} px (a larger light fills the field: leave out `target`)"
        return ("target",), "the light is too large", f"{across:.6g} px", uniform
    f_m = target.focal_length_um(pixel.pitch_um) * 1e-6
    for key, distance_m in ((("target", "distance_m"), target.distance_m), (("optics", "focus_m"), optics.focus_m)):
        if distance_m is not None and distance_m <= 2 * f_m:
            return (
                key,
                "too near for this lens",
                f"{distance_m:g} m",
                f"more than {2 * f_m:.4g} m, twice its focal length",
            )
    # The image shift over the f-number is the diameter of the blur circle.
    circle_px = defocus_um(scenario, pixel.pitch_um) * 8 * optics.f_number / pixel.pitch_um
    if circle_px > _MOST_PX:
        return ("optics", "focus_m"), "too far out of focus", f"{circle_px:.4g} px of blur", f"at most {_MOST_PX:g} px"
    periods = (across + 4) * pixel.pitch_um / (_SHORTEST_UM * optics.f_number)
    if periods > _MOST_PERIODS:
        allowed = f"at most {_MOST_PERIODS:g} periods of the finest detail across the light"
        return ("optics", "f_number"), "the image is too fine", f"{periods:.4g} periods", allowed
    return None


def transfer(nu_per_um: FloatArray, wavelength_um: FloatArray, f_number: float, w20_um: float) -> FloatArray:
    """OTF, ndarray[n_nu, n_wavelengths]."""
    s = np.minimum(nu_per_um[:, None] * wavelength_um * f_number, 1.0)
    angle = np.arccos(s)
    if w20_um == 0:
        return np.asarray((2 / math.pi) * (angle - s * np.sqrt((1 - s) * (1 + s))), dtype=float)
    phase = 8 * math.pi * w20_um * f_number * nu_per_um
    panels = 1 + int(phase.max(initial=0.0) / _PANEL_NODES)
    nodes, weights = legendre.rule(_PANEL_NODES)
    shares = ((np.arange(panels)[:, None] + (nodes + 1) / 2) / panels).ravel()
    found = np.zeros_like(s)
    for node, weight in zip(shares, np.tile(weights / 2 / panels, panels), strict=True):
        p = node * angle
        found += weight * np.sin(p) ** 2 * np.cos(phase[:, None] * (np.cos(p) - s))
    return np.asarray((4 / math.pi) * angle * found, dtype=float)


def _frequencies(reach_um: float, wavelength_um: FloatArray, f_number: float) -> tuple[FloatArray, FloatArray]:
    """Nodes and weights up to the highest frequency, for phases up to 2 pi nu reach: Gauss-Legendre on panels."""
    highest = 1 / (wavelength_um.min() * f_number)
    panels = 8 + int(highest * reach_um / _CYCLES_PER_PANEL)
    nodes, weights = legendre.rule(_PANEL_NODES)
    starts = np.arange(panels)[:, None]
    nu = (starts + (nodes + 1) / 2) * (highest / panels)
    return nu.ravel(), np.tile(weights / 2 * (highest / panels), panels)


class Profile:
    """h(r) of one disc for some wavelengths, as a table to look up: a sum of fewer functions of the radius.

    `spectrum`: frequencies, 1/um, and the factor of J0(2 pi r nu) at each, ndarray[n_frequencies, n_wavelengths];
    `highest_per_um`: the highest of them. `shares`: how much of each function is in each wavelength,
    ndarray[n_functions, n_wavelengths], the first ones the most.
    """

    def __init__(
        self, radius_um: float, reach_um: float, wavelength_um: FloatArray, f_number: float, w20_um: float
    ) -> None:
        from scipy.interpolate import BSpline  # noqa: PLC0415  (slow to import: kept off the start-up path)
        from scipy.linalg import qr  # noqa: PLC0415  (slow to import: kept off the start-up path)
        from scipy.special import j1  # noqa: PLC0415  (slow to import: kept off the start-up path)

        nu, weight = _frequencies(radius_um + reach_um, wavelength_um, f_number)
        step = 1 / (_SPLINE_PER_CYCLE * nu[-1])
        r = np.linspace(0.0, reach_um + step, max(8, 2 + int(reach_um / step)))
        disc = (2 * math.pi * radius_um * j1(2 * math.pi * radius_um * nu) * weight)[:, None]
        self.spectrum = nu, disc * transfer(nu, wavelength_um, f_number, w20_um)
        few = FewRadii(r, float(nu[-1]))
        values = sums_of_j0(few.nodes, *self.spectrum)
        # What the first columns leave of any row is at most the size of the next one's entry on the diagonal.
        basis, triangle, _ = qr(values.T, mode="economic", pivoting=True)
        self._left = few.growth * np.abs(np.diag(triangle))
        self.shares = np.ascontiguousarray(basis[:, : self.n_functions(_ROUNDING)].T)
        self._table = few.to_all(values @ self.shares.T)
        self._spline = BSpline(*spline_through(r, self._table, 3), 3)
        self.r_um = r
        self.highest_per_um = float(nu[-1])
        self.work = r.size * nu.size * wavelength_um.size

    def n_functions(self, residual: float) -> int:
        """How many of the functions leave no more than this of any value, relative to a uniform field."""
        return max(1, int((self._left > residual).sum()))

    def order(self, width_um: float) -> int:
        """Order of a Gauss-Legendre rule that integrates h over `width_um`."""
        return 5 + math.ceil(2.5 * self.highest_per_um * width_um)

    def at(self, r_um: FloatArray) -> FloatArray:
        """h, ndarray[..., n_wavelengths]."""
        return np.asarray(self._spline(r_um) @ self.shares, dtype=float)

    def sums(self, r_um: FloatArray, weights: FloatArray) -> FloatArray:
        """Sums of the functions over the last axis of `r_um`, by their weights: ndarray[n, m], ndarray[m] -> [n,
        n_functions]; times `shares` those of h.

        The weights go to the spline's coefficients first, so that no more is done for each function than one product.
        """
        from ..compiled_splines import sums_of_cubic  # noqa: PLC0415  (compiled: kept off the start-up path)

        found = np.empty((len(r_um), len(self.shares)))
        sums_of_cubic(r_um, weights, self._spline.t, self._spline.c, found)
        return found

    @cached_property
    def values(self) -> FloatArray:
        """h at the radii `r_um`, ndarray[n_radii, n_wavelengths]."""
        return np.asarray(self._table @ self.shares)

    @cached_property
    def slopes(self) -> FloatArray:
        """Derivative of h at the radii `r_um`, 1/um, ndarray[n_radii, n_wavelengths]."""
        return np.asarray(self._spline.derivative()(self.r_um) @ self.shares, dtype=float)


_Sizes = tuple[float, float, tuple[float, ...], float, float]
PROFILES: Cache[_Sizes, Profile] = Cache(8)
"""The latest profiles: CFAs with tiles of one size share theirs."""


def profile(
    radius_um: float, reach_um: float, wavelengths_um: tuple[float, ...], f_number: float, w20_um: float
) -> Profile:
    """A profile, kept."""
    key = (radius_um, reach_um, wavelengths_um, f_number, w20_um)
    return PROFILES.get(key, lambda: Profile(radius_um, reach_um, np.array(wavelengths_um), f_number, w20_um))


def mean_over_disc(
    radius_um: float, readout_um: float, wavelength_um: FloatArray, f_number: float, w20_um: float
) -> FloatArray:
    """Mean of h over a concentric disc of radius `readout_um`, ndarray[n_wavelengths]; 1 is no light lost.

    (2 R / R') integral J1(2 pi R nu) J1(2 pi R' nu) OTF(nu) / nu dnu; at the very center the encircled energy.
    """
    from scipy.special import j1  # noqa: PLC0415  (slow to import: kept off the start-up path)

    nu, weight = _frequencies(radius_um + readout_um, wavelength_um, f_number)
    inner = j1(2 * math.pi * radius_um * nu) * weight
    inner *= (2 * radius_um / readout_um) * j1(2 * math.pi * readout_um * nu) / nu
    return np.asarray(inner @ transfer(nu, wavelength_um, f_number, w20_um), dtype=float)


def _envelope(x: FloatArray) -> FloatArray:
    """|J1(x)| is at most this: x / 2, its maximum 0.5819, and 0.8251 / sqrt(x) (its supremum of sqrt(x) |J1|)."""
    return np.asarray(np.minimum(np.minimum(x / 2, 0.58187), 0.8251 / np.sqrt(np.maximum(x, 1e-300))), dtype=float)


@lru_cache(64)
def interpolation_bound(
    radius_um: float, aperture_um: float, knots_um: tuple[float, ...], f_number: float, w20_um: float
) -> float:
    """No kernel of this disc differs by more than this from its linear interpolation between the knots.

    In focus |d2h/dlambda2| step^2 / 8, else |dh/dlambda| step / 2 (a derivative of the OTF by lambda at given nu is
    never larger with defocus than without). Both derivatives are bounded by the integral of the absolute integrand,
    with an envelope of |J1|; for s = lambda N nu fixed that falls with lambda, so each interval's shorter end counts,
    but for the pixel aperture, whose transfer falls with nu, where the longer end does. In focus the bound falls from
    one interval to the next: its factors change by lambda^-3, by lambda^(1/2) at most (the envelope), and by lambda^2
    at most (the aperture); so of intervals that are no longer than one before, none counts.
    """
    u, weight = legendre.rule(200)
    u, weight = (u + 1) * math.pi / 4, weight * math.pi / 4
    s = np.sin(u)
    theta = (np.arange(32) + 0.5) / 64 * (math.pi / 2)  # what is beyond 45 degrees is a mirror image
    axes = np.cos(theta), np.sin(theta)
    worst = longest = 0.0
    for short, long in pairwise(knots_um):
        if w20_um == 0 and long - short <= longest * (1 + 1e-9):
            continue
        longest = long - short
        nu = s / (short * f_number)
        aperture = 1.0
        if aperture_um > 0:
            across = math.pi * aperture_um * s[:, None] / (long * f_number)
            falls = [np.maximum(1.0, across * axis) for axis in axes]
            aperture = (1 / (falls[0] * falls[1])).mean(axis=1)
        common = 2 * math.pi * radius_um * _envelope(2 * math.pi * radius_um * nu) * aperture / (short * f_number)
        step = long - short
        if w20_um == 0:
            second = float(weight @ (common * (s / short) ** 2 * (4 / math.pi) * s))
            worst = max(worst, second * step**2 / 8)
        else:
            first = float(weight @ (common * (s / short) * (4 / math.pi) * np.cos(u) ** 2))
            worst = max(worst, first * step / 2)
    return worst


def knots(wavelength_nm: FloatArray, method: str) -> FloatArray:
    """Wavelengths at which a method makes its kernels: equidistant ones and the end; all, where the grid is coarser."""
    spacing = _SPACING_NM.get(method, 0.0)
    if wavelength_nm.size < 3 or wavelength_nm[1] - wavelength_nm[0] >= spacing:
        return wavelength_nm
    inner = np.arange(wavelength_nm[0], wavelength_nm[-1], spacing)
    return np.append(inner, wavelength_nm[-1])


class Blur(KernelEffect):
    """An image that is not sharp."""

    name = "blur"
    methods = ("skip", *_SPACING_NM, "every wavelength")
    stage = Stage.OPTICS
    order = 0
    part = Part.LIGHT

    def exact(self, shot: Shot) -> str | None:
        """Without an edge nothing is blurred."""
        return "a patch that fills the field" if shot.scenario.target is None else None

    def kernel_method(self, method: str) -> str:
        """Kernels are compared at given wavelengths, where all methods but one are the same."""
        return method if method == self.off else self.reference

    def change(self, shot: Shot, before: str, after: str, designs: Designs, *, straight: bool) -> Change:
        """A sharp image, or what the kernel is between its wavelengths."""
        return KernelChange(self.part, knots=None if after == self.off else after)

    def work(self, shot: Shot, methods: Chosen, load: Load) -> Load:
        """An image at every wavelength of the method."""
        if shot.scenario.target is None or methods.blur == "skip":
            return load
        n_knots = knots(shot.grid.nodes_nm, methods.blur).size
        if methods.sampling == "skip":
            return load._replace(own_s=load.own_s + WHOLE_IMAGE_S * n_knots)
        highest = 1e3 / (shot.grid.nodes_nm[0] * shot.scenario.optics.f_number)
        across_um = (shot.scenario.target.object_resolution_px + 4) * shot.pixel.pitch_um
        radii = max(8.0, _SPLINE_PER_CYCLE * highest * across_um)
        frequencies = _PANEL_NODES * (8 + highest * across_um / _CYCLES_PER_PANEL)
        return load._replace(knots=n_knots, shared_s=load.shared_s + PROFILE_S * radii * frequencies * n_knots)
