"""Diffraction and defocus: the image of a uniform disc through a lens without other aberrations.

The image of a disc of radius R, relative to that of a uniform field, is a function of the distance r from its center.
It is the Hankel transform of the disc's spectrum, R J1(2 pi R nu) / nu, times the optical transfer function (OTF),
  h(r) = 2 pi R integral_0^(1 / lambda N) J1(2 pi R nu) J0(2 pi r nu) OTF(nu) dnu,
with nu the spatial frequency in the image, lambda the wavelength and N the f-number. Of incoherent light the OTF is
the normalized autocorrelation of the pupil; it ends at nu = 1 / (lambda N) (J. W. Goodman, Introduction to Fourier
Optics, 3rd edition, chapter 6), the cutoff of a cone with sin = 1 / 2N. The irradiance elsewhere in the package is,
like ISETCam's, that of tan = 1 / 2N; they differ by 0.8 % at f/4.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from ..base.cache import Cache
from ..base.errors import Fault
from ..base.types import Array, Float, PerKnot, PerWavelength, SameShape

if TYPE_CHECKING:
    from .pixel import Pixel
    from .scene import Scene

_SHORTEST_UM = 0.4
"""Wavelength of whose finest detail `image_fault` counts the periods."""
_MOST_PX = 128.0
_MOST_PERIODS = 400.0
_PANEL_NODES = 32
"""Nodes of a Gauss-Legendre rule; an integral is a sum of such rules over panels side by side."""
_CYCLES_PER_PANEL = 4.0
_PHASE_PER_PANEL = 20.0
"""Radians by which the phase changes over a panel, on average; at most it is about twice that."""
_NODES_PER_CYCLE = 12
"""Nodes of the table of h(r) per period of the highest frequency."""
_BEYOND = 6
"""Nodes of the table below 0 and beyond the reach."""
_RESIDUAL = 1e-10
"""Functions that change h(r) by less at each of its samples are left out, relative to a uniform field."""
_MOST_AT_ONCE = 2_000_000
"""Values of Bessel functions that are held at once."""


@lru_cache(maxsize=64)
def gauss_legendre(order: int) -> tuple[Float[Array, " order"], Float[Array, " order"]]:
    """Return nodes and weights of a Gauss-Legendre rule; cached, since long rules take milliseconds.

    Returns nodes between -1 and 1, and weights that add up to 2.
    """
    nodes, weights = np.polynomial.legendre.leggauss(order)
    return nodes, weights


def defocus_um(scenario: Scene, pitch_um: float) -> float:
    """Return W20, the optical path error at the edge of the pupil of a lens that is not focused on the target.

    W20 = dz / (8 N^2), with dz the distance between the images of the target and of what is in focus (Goodman, 3rd
    edition, section 6.4, on a focusing error; here for an image close to the focal plane).

    `scenario`: its target and optics; without a target, or a distance that is in focus, there is no defocus;
    `pitch_um`: pixel pitch, which gives the focal length, micrometers.
    """
    target, focus_m = scenario.target, scenario.optics.focus_m
    if target is None or focus_m is None:
        return 0.0
    focal_um = target.focal_length_um(pitch_um)
    target_image_um, focus_image_um = (
        focal_um * distance_um / (distance_um - focal_um) for distance_um in (target.distance_m * 1e6, focus_m * 1e6)
    )
    return abs(target_image_um - focus_image_um) / (8 * scenario.optics.f_number**2)


def image_fault(scenario: Scene, pixel: Pixel) -> Fault | None:
    """Return the reason why a target's image is not computed.

    None if it is computed.
    """
    target, optics = scenario.target, scenario.optics
    if target is None:
        return None
    across_px = target.object_resolution_px
    if across_px > _MOST_PX:
        uniform = f"at most {_MOST_PX:g} px (a larger light fills the field: leave out `target`)"
        return Fault(("target",), "the light is too large", f"{across_px:.6g} px", uniform)
    focal_m = target.focal_length_um(pixel.pitch_um) * 1e-6
    for key, distance_m in ((("target", "distance_m"), target.distance_m), (("optics", "focus_m"), optics.focus_m)):
        if distance_m is not None and distance_m <= 2 * focal_m:
            allowed = f"more than {2 * focal_m:.4g} m, twice its focal length"
            return Fault(key, "too near for this lens", f"{distance_m:g} m", allowed)
    # The image shift over the f-number is the diameter of the blur circle.
    circle_px = defocus_um(scenario, pixel.pitch_um) * 8 * optics.f_number / pixel.pitch_um
    if circle_px > _MOST_PX:
        blur, most = f"{circle_px:.4g} px of blur", f"at most {_MOST_PX:g} px"
        return Fault(("optics", "focus_m"), "too far out of focus", blur, most)
    periods = (across_px + 4) * pixel.pitch_um / (_SHORTEST_UM * optics.f_number)
    if periods > _MOST_PERIODS:
        allowed = f"at most {_MOST_PERIODS:g} periods of the finest detail across the light"
        return Fault(("optics", "f_number"), "the image is too fine", f"{periods:.4g} periods", allowed)
    return None


def otf(
    frequency_per_um: Float[Array, " frequencies"], wavelength_um: PerWavelength, f_number: float, w20_um: float
) -> Float[Array, "frequencies wavelengths"]:
    """Return the optical transfer function of a circular pupil with defocus.

    With s = lambda N nu, which is 1 at the cutoff,
      OTF = (4 / pi) integral_0^acos(s) sin^2 p cos(8 pi W20 N nu (cos p - s)) dp
    (H. H. Hopkins, The frequency response of a defocused optical system, Proc. R. Soc. A 231, 91, 1955); in focus
      OTF = (2 / pi) (acos s - s sqrt(1 - s^2))
    (Goodman, chapter 6).

    `w20_um`: defocus, micrometers: see `defocus_um`. 1 at frequency 0, 0 from the cutoff on, negative where the
    contrast is reversed.
    """
    s = np.minimum(frequency_per_um[:, None] * wavelength_um * f_number, 1.0)
    limit = np.arccos(s)
    if w20_um == 0:
        return np.asarray((2 / math.pi) * (limit - s * np.sqrt((1 - s) * (1 + s))), dtype=float)
    phase = (8 * math.pi * w20_um * f_number * frequency_per_um)[:, None]
    panels = 1 + int((phase * (1 - s)).max(initial=0.0) / _PHASE_PER_PANEL)
    nodes, weights = gauss_legendre(_PANEL_NODES)
    shares = ((np.arange(panels)[:, None] + (nodes + 1) / 2) / panels).ravel()
    result = np.zeros_like(s)
    for share, weight in zip(shares, np.tile(weights / 2 / panels, panels), strict=True):
        cosine = np.cos(share * limit)
        result += weight * (1 - cosine**2) * np.cos(phase * (cosine - s))
    return np.asarray((4 / math.pi) * limit * result, dtype=float)


def _frequency_rule(
    reach_um: float, wavelength_um: PerWavelength, f_number: float
) -> tuple[Float[Array, " frequencies"], Float[Array, " frequencies"]]:
    """Return Gauss-Legendre rules side by side, up to the cutoff of the shortest wavelength.

    Returns nodes, ascending, and weights, both in cycles per micrometer.
    """
    cutoff = 1 / (wavelength_um.min() * f_number)
    panels = 8 + int(cutoff * reach_um / _CYCLES_PER_PANEL)
    nodes, weights = gauss_legendre(_PANEL_NODES)
    frequency = (np.arange(panels)[:, None] + (nodes + 1) / 2) * (cutoff / panels)
    return frequency.ravel(), np.tile(weights / 2 * (cutoff / panels), panels)


def _hankel_sums(
    radius_um: Float[Array, " radii"],
    frequency_per_um: Float[Array, " frequencies"],
    spectrum: Float[Array, "frequencies functions"],
) -> Float[Array, "radii functions"]:
    """Sum J0(2 pi r nu) times a spectrum over the frequencies."""
    from scipy.special import j0  # noqa: PLC0415  (slow to import)

    angular = 2 * math.pi * frequency_per_um
    blocks = np.array_split(radius_um, 1 + radius_um.size * angular.size // _MOST_AT_ONCE)
    return np.concatenate([j0(np.outer(block, angular)) @ spectrum for block in blocks])


def _chebyshev_nodes(reach_um: float, highest_per_um: float) -> Float[Array, " nodes"]:
    """Return the Chebyshev nodes in r^2 whose polynomial is h(r) from 0 to a reach, to 1e-15.

    J0(z x) has 2 J_k(z / 2)^2 of the Chebyshev polynomial of order k in 2 x^2 - 1, but for its sign (Graf's addition
    theorem, Abramowitz and Stegun, 9.1.79), which falls fast from k = z / 2 on.

    Returns 2 (r / reach)^2 - 1, the largest first.
    """
    finest = math.pi * highest_per_um * reach_um
    n_nodes = math.ceil(finest + 6 * finest ** (1 / 3) + 8)
    return np.asarray(np.cos(math.pi * (np.arange(n_nodes) + 0.5) / n_nodes))


class DiscProfile:
    """Image h(r) of a disc at many wavelengths, as a table of fewer functions of the radius.

    The images at neighboring wavelengths are nearly the same, so that some tens of functions of r make those at
    hundreds of wavelengths, but for rounding: a QR decomposition with pivoting finds them. Each is a cubic spline.

    `w20_um`: defocus, micrometers: see `defocus_um`; `spectrum`: frequencies, ascending, 1/um, and the factor of J0(2
    pi r nu) at each: h is the sum of their products; `shares`: how much of each function is in h at each wavelength;
    the first functions matter most.
    """

    def __init__(
        self, radius_um: float, reach_um: float, wavelength_um: PerWavelength, f_number: float, w20_um: float
    ) -> None:
        from scipy.fft import dct  # noqa: PLC0415  (slow to import)
        from scipy.interpolate import make_interp_spline  # noqa: PLC0415  (slow to import)
        from scipy.linalg import qr  # noqa: PLC0415  (slow to import)
        from scipy.special import j1  # noqa: PLC0415  (slow to import)

        frequency, weight = _frequency_rule(radius_um + reach_um, wavelength_um, f_number)
        disc = 2 * math.pi * radius_um * j1(2 * math.pi * radius_um * frequency) * weight
        spectrum = disc[:, None] * otf(frequency, wavelength_um, f_number, w20_um)
        self.spectrum = frequency, spectrum
        self.highest_per_um = float(frequency[-1])

        step_um = 1 / (_NODES_PER_CYCLE * self.highest_per_um)
        n_nodes = max(8, 2 + int(reach_um / step_um))
        # A spline is off tenfold near its ends: they lie below 0, where h goes on evenly, and beyond the reach.
        table_um = np.arange(-_BEYOND, n_nodes + _BEYOND) * ((reach_um + step_um) / (n_nodes - 1))
        nodes = _chebyshev_nodes(table_um[-1], self.highest_per_um)
        samples = _hankel_sums(table_um[-1] * np.sqrt((1 + nodes) / 2), frequency, spectrum)
        # The rest of any sample beyond the first columns is at most the size of the next entry on the diagonal.
        basis, triangle, _ = qr(samples.T, mode="economic", pivoting=True)
        n_functions = max(1, int((np.abs(np.diag(triangle)) > _RESIDUAL).sum()))
        self.shares = np.ascontiguousarray(basis[:, :n_functions].T)

        coefficients = dct(samples @ self.shares.T, axis=0) / nodes.size
        coefficients[0] /= 2
        squares = 2 * (table_um / table_um[-1]) ** 2 - 1
        table = np.polynomial.chebyshev.chebvander(squares, nodes.size - 1) @ coefficients
        self._spline = make_interp_spline(table_um, table, k=3)
        self._coefficients = np.ascontiguousarray(self._spline.c)  # by columns, from some versions of SciPy

    def at(self, r_um: SameShape) -> Float[Array, "*batch wavelengths"]:
        """Return the image at distances from the disc's center.

        `r_um`: distances, micrometers, up to the table's reach. Returns h, relative to a uniform field.
        """
        return np.asarray(self._spline(r_um) @ self.shares, dtype=float)

    def pixel_means(self, places_um: Float[Array, "places 2"], half_um: float) -> Float[Array, "places functions"]:
        """Return means of the functions of the radius over square pixels, by a Gauss-Legendre rule along each side.

        `places_um`: centers of the pixels from the disc's center, micrometers; within the table's reach. Times `shares`
        those of h.
        """
        from .disc_kernels import means_of_cubic  # noqa: PLC0415  (compiled: kept off the start-up path)

        nodes, weights = gauss_legendre(3 + math.ceil(4 * self.highest_per_um * half_um))  # 2 for each finest period
        result = np.empty((len(places_um), len(self.shares)))
        places_um = np.ascontiguousarray(places_um)
        means_of_cubic(places_um, nodes * half_um, weights / 2, self._spline.t, self._coefficients, result)
        return result


PROFILES: Cache[tuple[float, float, tuple[float, ...], float, float], DiscProfile] = Cache(8)
"""The latest profiles: CFAs with tiles of one size share theirs."""


def profile(
    radius_um: float, reach_um: float, wavelengths_um: tuple[float, ...], f_number: float, w20_um: float
) -> DiscProfile:
    """Return the image of a disc; recent ones are cached.

    `radius_um`, `reach_um`: radius of the disc's sharp image, and largest distance from its center, micrometers.
    """
    key = (radius_um, reach_um, wavelengths_um, f_number, w20_um)
    return PROFILES.get(key, lambda: DiscProfile(radius_um, reach_um, np.array(wavelengths_um), f_number, w20_um))


def psf_knots_nm(wavelength_nm: PerWavelength, step_nm: float) -> PerKnot:
    """Return the wavelengths at which images are computed; between them they are interpolated linearly.

    `step_nm`: distance of the wavelengths, nm; 0 asks for all of the grid. Returns every `step_nm` from the first
    wavelength on, and the last one.
    """
    if wavelength_nm.size < 3 or wavelength_nm[1] - wavelength_nm[0] >= step_nm:
        return wavelength_nm
    return np.append(np.arange(wavelength_nm[0], wavelength_nm[-1], step_nm), wavelength_nm[-1])
