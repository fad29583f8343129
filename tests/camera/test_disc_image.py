"""The image of a disc and what pixels see of it, against integrals, areas and what a pupil's autocorrelation says."""

from __future__ import annotations

import math

import numpy as np
import pytest

from sweep.base.types import FloatArray
from sweep.camera import psf
from sweep.camera.disc_image import light_on_pixels
from sweep.camera.pixel import Optics, Pixel
from sweep.camera.sampling import Window
from sweep.camera.scene import Scene, Target

_VISIBLE_UM = np.arange(400, 701, 10) * 1e-3


_IMAGE = 16 * 3e-7
"""Error of h(r): that of a cubic spline grows by 16 where its nodes are 12 per period of the finest detail, not 24."""
_PIXEL_MEAN = 3e-7
"""Error of a pixel's mean, of a uniform field: over periods that are finer than a pixel the spline's error cancels."""


def window_around(places_px: list[tuple[float, float]], reach: int) -> Window:
    """All pixels of which one is at most `reach` rows and columns from the origin."""
    at = np.arange(-reach, reach + 1.0)
    shape = len(places_px), at.size, at.size
    x, y = np.array(places_px).T[..., None, None]
    dx, dy = np.broadcast_to(at - x, shape), np.broadcast_to(at[:, None] - y, shape)
    return Window(np.zeros(shape[1:], dtype=np.intp), dx, dy)


def pixel_light(window: Window, profile: psf.DiscProfile | None, radius_px: float, pitch_um: float) -> FloatArray:
    wanted = np.ones(window.dx.shape, dtype=bool)
    return light_on_pixels(window, wanted, 0.5, radius_px, profile, pitch_um).by_pixel()


@pytest.mark.parametrize(("f_number", "allowed"), [(1.4, _PIXEL_MEAN), (8.0, _IMAGE), (64.0, _IMAGE)])
@pytest.mark.parametrize("radius_um", [1.5, 6.2])
def test_pixel_means_are_those_of_the_integral(radius_um: float, f_number: float, allowed: float) -> None:
    """Also in the middle of the light and at the table's end; slow lenses have no detail that is finer than a pixel."""
    from scipy.special import j0

    pitch_um, wavelength_um = 2.1, np.array([0.4, 0.55, 0.7])
    window = window_around([(0.0, 0.0), (0.5, 0.2)], 2)
    reach_um = 2**0.5 * 3.0 * pitch_um
    profile = psf.DiscProfile(radius_um, reach_um, wavelength_um, f_number, 0.0)
    found = pixel_light(window, profile, radius_um / pitch_um, pitch_um)
    nodes, weights = psf.gauss_legendre(24)
    u, v = np.meshgrid(nodes / 2, nodes / 2)
    frequency, spectrum = profile.spectrum
    for row, column in ((2, 2), (2, 3), (1, 3), (0, 0), (0, 2)):
        x, y = window.dx[:, row, column], window.dy[:, row, column]
        r_um = np.hypot(x[:, None] + u.ravel(), y[:, None] + v.ravel()) * pitch_um
        exact = [
            (np.outer(weights, weights).ravel() / 4) @ (j0(2 * math.pi * np.outer(r, frequency)) @ spectrum)
            for r in r_um
        ]
        np.testing.assert_allclose(found[:, row, column], exact, rtol=0, atol=allowed)


def test_pixels_that_are_not_wanted_are_dark() -> None:
    radius_px, pitch_um = 2.0, 2.1
    window = window_around([(0.0, 0.0), (0.25, 0.5)], 3)
    wanted = np.hypot(window.dx, window.dy) < 2.5
    profile = psf.DiscProfile(radius_px * pitch_um, 6 * pitch_um, _VISIBLE_UM, 4.0, 0.0)
    light = light_on_pixels(window, wanted, 0.5, radius_px, profile, pitch_um)
    by_pixel = light.by_pixel()
    assert np.all(by_pixel[~wanted] == 0)
    assert np.all(by_pixel[wanted] > 0)


def test_defocus_is_the_image_shift() -> None:
    target = Target(distance_m=20.0, fov_deg=60.0)
    assert psf.defocus_um(Scene(target=target), 2.1) == 0
    assert psf.defocus_um(Scene(optics=Optics(focus_m=5.0)), 2.1) == 0
    focal_m = target.focal_length_um(2.1) * 1e-6
    shift_um = (1 / (1 / focal_m - 1 / 5.0) - 1 / (1 / focal_m - 1 / 20.0)) * 1e6
    scene = Scene(target=target, optics=Optics(focus_m=5.0, f_number=2.0))
    assert psf.defocus_um(scene, 2.1) == pytest.approx(shift_um / (8 * 2.0**2), rel=1e-9)


def test_images_are_made_at_every_step_and_at_the_end() -> None:
    grid = np.arange(400.0, 696.0)
    np.testing.assert_array_equal(psf.psf_knots_nm(grid, 10.0), [*range(400, 700, 10), 695.0])
    assert psf.psf_knots_nm(grid, 1.0) is grid
    assert psf.psf_knots_nm(grid, 0.0) is grid


@pytest.mark.parametrize(
    ("distance_m", "diameter_m", "optics", "place"),
    [
        (0.01, 1e-4, Optics(), ("target", "distance_m")),
        (20.0, 0.2, Optics(focus_m=0.01), ("optics", "focus_m")),
        (20.0, 0.2, Optics(focus_m=0.1, f_number=0.5), ("optics", "focus_m")),
    ],
)
def test_an_image_that_is_too_much_is_named(
    distance_m: float, diameter_m: float, optics: Optics, place: tuple[str, ...] | None
) -> None:
    target = Target(distance_m=distance_m, diameter_m=diameter_m, fov_deg=60.0)
    result = psf.image_fault(Scene(target=target, optics=optics), Pixel())
    assert (None if result is None else result.path) == place
