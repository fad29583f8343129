"""Signal head on the pixels: light of each part on every pixel, blurred, at each wavelength and place.

Round lenses stand one above the other in a housing before a backplate (all rectangles), as EN 12368's heads of 200 mm:
lenses 1.5 diameters apart, the housing of three 1.6 x 4.6 diameters, the backplate 3 x 6.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...base.cache import Cache
from ...base.types import Array, Float, PerKnot
from ...camera import psf
from ...camera.disc_image import light_on_pixels
from ...camera.mosaic import Mosaic
from ...camera.sampling import Window
from ...camera.scene import Target
from ...camera.setup import Setup
from .keys import Vision

SPACING = 1.5
"""From lens to lens, in diameters."""
_HOUSING, _BACKPLATE = (1.6, 1.6), (3.0, 3.0)
"""Width and height around one lens, in diameters."""
_PSF_STEP_NM = 10.0
MARGIN = 1
"""Pixels around the image whose light crosstalk brings into it."""
_PERIOD_PX = 160
"""A rectangle's image is a Fourier series of this period."""


@dataclass(frozen=True)
class HeadMaps:
    """Light of each part relative to a uniform field of its radiance."""

    knots_nm: PerKnot
    lenses: Float[Array, "places lenses side side knots"]
    housing: Float[Array, "places side side knots"]
    backplate: Float[Array, "places side side knots"]


def heights(vision: Vision) -> Float[Array, " lenses"]:
    """Return the positions of the lenses' centers below the head's center."""
    n = len(vision.lenses)
    return np.asarray(SPACING * (np.arange(n) - (n - 1) / 2), dtype=float)


def housing_diameters(vision: Vision) -> tuple[float, float]:
    """Return the width and height of the housing."""
    return _HOUSING[0], _HOUSING[1] + SPACING * (len(vision.lenses) - 1)


def head_places_px(vision: Vision, mosaic: Mosaic) -> Float[Array, "places 2"]:
    """Return the positions of the head's center from the image's first pixel."""
    rows, columns = mosaic.indices.shape
    n = vision.places_per_pixel
    middle = [(vision.crop_px // 2 // size) * size - size / 2 for size in (columns, rows)]
    x, y = np.meshgrid(np.arange(columns * n) / n + middle[0], np.arange(rows * n) / n + middle[1])
    return np.stack([x.ravel(), y.ravel()], axis=1)


_maps: Cache[tuple[object, ...], HeadMaps] = Cache(12)


def head_maps(setup: Setup, vision: Vision) -> HeadMaps:
    """Return the maps of the setup's target, which do not depend on filters; recent ones are cached."""
    target, pixel = setup.scene.target, setup.camera.pixel
    assert target is not None
    optics = vision.optics
    key = (
        target,
        optics,
        pixel.pitch_um,
        pixel.fill_factor,
        setup.camera.grid,
        vision.crop_px,
        vision.places_per_pixel,
    )
    return _maps.get(
        (*key, setup.camera.mosaic.indices.shape, len(vision.lenses)), lambda: _made(setup, vision, target)
    )


def lamp_maps(setup: Setup, vision: Vision) -> tuple[PerKnot, Float[Array, "places side side knots"]]:
    """Return the light of a disc as wide as a lens in the head's middle, relative to a uniform field of its radiance.

    Returns `knots_nm`: wavelengths, nm.
    """
    knots_nm = psf.psf_knots_nm(setup.camera.grid.nodes_nm, _PSF_STEP_NM)
    return knots_nm, _disc(setup, vision, head_places_px(vision, setup.camera.mosaic), knots_nm)


def _made(setup: Setup, vision: Vision, target: Target) -> HeadMaps:
    knots = psf.psf_knots_nm(setup.camera.grid.nodes_nm, _PSF_STEP_NM)
    places, across = head_places_px(vision, setup.camera.mosaic), target.object_resolution_px
    lenses = [_disc(setup, vision, places + np.array([0, across * height]), knots) for height in heights(vision)]
    more = SPACING * (len(vision.lenses) - 1)
    housing, backplate = (
        _rectangle(setup, vision, places, (wide * across, (high + more) * across), knots)
        for wide, high in (_HOUSING, _BACKPLATE)
    )
    return HeadMaps(knots, np.stack(lenses, axis=1), housing, backplate)


def _apart(
    vision: Vision, centers: Float[Array, "places 2"]
) -> tuple[Float[Array, "places columns"], Float[Array, "places columns"]]:
    """Return columns and rows of the pixels (with margin) from each center."""
    at = np.arange(-MARGIN, vision.crop_px + MARGIN)
    return at - centers[:, :1], at - centers[:, 1:]


def _disc(
    setup: Setup, vision: Vision, centers: Float[Array, "places 2"], knots_nm: PerKnot
) -> Float[Array, "places side side knots"]:
    """Return a lens by `disc_image`."""
    target, pixel = setup.scene.target, setup.camera.pixel
    assert target is not None
    dx, dy = _apart(vision, centers)
    shape = (len(centers), dy.shape[1], dx.shape[1])
    window = Window(
        np.zeros(shape[1:], dtype=np.intp), np.broadcast_to(dx[:, None], shape), np.broadcast_to(dy[..., None], shape)
    )
    radius = target.object_resolution_px / 2
    furthest = (float(np.hypot(np.abs(dx).max(), np.abs(dy).max())) + 2) * pixel.pitch_um
    defocus = psf.defocus_um(setup.scene, pixel.pitch_um)
    wave = tuple(knots_nm * 1e-3)
    profile = psf.profile(radius * pixel.pitch_um, furthest, wave, vision.optics.f_number, defocus)
    every = np.ones(shape, dtype=bool)
    return light_on_pixels(window, every, pixel.fill_factor**0.5 / 2, radius, profile, pixel.pitch_um).by_pixel()


def _rectangle(
    setup: Setup, vision: Vision, centers: Float[Array, "places 2"], size_px: tuple[float, float], knots_nm: PerKnot
) -> Float[Array, "places side side knots"]:
    """Return a rectangle through the same lens onto the same pixels.

    The spectrum of rectangle and pixel times the transfer function, which ends at 1 / (lambda N): a cosine series of a
    period that leaves its neighbors far away.
    """
    pixel, pitch = setup.camera.pixel, setup.camera.pixel.pitch_um
    defocus = psf.defocus_um(setup.scene, pitch)
    highest = 1 / (knots_nm[0] * 1e-3 * vision.optics.f_number) * pitch  # per pixel
    orders = np.arange(math.ceil(highest * _PERIOD_PX) + 1)
    nu = orders / _PERIOD_PX
    twice = np.where(orders == 0, 1.0, 2.0)
    side = pixel.fill_factor**0.5
    series = [twice * width / _PERIOD_PX * np.sinc(nu * width) * np.sinc(nu * side) for width in size_px]
    radial = np.hypot(nu[:, None], nu[None, :]) / pitch
    distinct, which = np.unique(np.round(radial, 12), return_inverse=True)
    transfer = psf.otf(distinct, knots_nm * 1e-3, vision.optics.f_number, defocus)
    waves = [np.cos(2 * math.pi * nu * x[..., None]) * s for x, s in zip(_apart(vision, centers), series, strict=True)]
    columns, of_column = np.unique(waves[0].reshape(-1, nu.size), axis=0, return_inverse=True)
    rows, of_row = np.unique(waves[1].reshape(-1, nu.size), axis=0, return_inverse=True)
    shape = waves[0].shape[:2]
    of_column, of_row = of_column.reshape(shape), of_row.reshape(shape)
    pixels = np.empty((*shape, shape[1], knots_nm.size))
    for knot in range(knots_nm.size):
        otf = transfer[:, knot][which.reshape(radial.shape)]  # [nu of columns, nu of rows]
        image = rows @ otf.T @ columns.T
        pixels[..., knot] = image[of_row[:, :, None], of_column[:, None, :]]
    return pixels
