"""Image of a disc on the pixels, sharp or blurred by diffraction and defocus."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..base.cache import Cache
from ..base.types import Array, Bool, BoolArray, Float, FloatArray, IndexArray, Int, SameShape
from .psf import DiscProfile

if TYPE_CHECKING:
    from .sampling import Window

_LATTICE = 100
"""Places of the light's center from which on the pixels' light is kept: all CFAs whose tiles are of one size ask for
that of a lattice of phases."""
_LATTICES: Cache[tuple[DiscProfile, float, bytes], FloatArray] = Cache(4)


def covered(x: SameShape, y: SameShape, half: float, radius: float) -> SameShape:
    """Return the share of a square that lies in a disc around the origin, from the exact areas, 0 to 1.

    `radius`: radius of the disc; all lengths are in one unit, such as pixels.
    """
    from .disc_kernels import covered_shares  # noqa: PLC0415  (compiled: kept off the start-up path)

    x, y = np.broadcast_arrays(x, y)
    return covered_shares(x.ravel(), y.ravel(), half, radius).reshape(x.shape)


@dataclass(frozen=True)
class PixelLight:
    """Light of pixels relative to a uniform field, each distinct place once.

    `values`: functions of the light at each place; the last place is dark; `shares`: share of each function in each
    wavelength; None if all wavelengths are equal, which is then one function.
    """

    values: Float[Array, "places functions"]
    place: Int[IndexArray, "cases rows columns"]
    shares: Float[Array, "functions wavelengths"] | None

    def by_pixel(self) -> Float[Array, "cases rows columns _wavelengths"]:
        """Return the light of each pixel.

        Returns light relative to a uniform field.
        """
        by_place = self.values if self.shares is None else self.values @ self.shares
        return np.asarray(by_place[self.place])


def different(
    window: Window, requested: Bool[BoolArray, "cases rows columns"]
) -> tuple[Float[Array, "places 2"], Int[IndexArray, " requested"]]:
    """Return the distinct pixel positions around the light's center; mirrored ones are equal in a round image.

    Returns `places_px`: distances from the center along rows and columns, the shorter one first, pixels; `place`: place
    of each requested pixel.
    """
    x, y = window.dx[:, 0, :], window.dy[:, :, 0]
    along = np.round(np.abs(np.concatenate([x.ravel(), y.ravel()])), 12)
    distances, which = np.unique(along, return_inverse=True)
    case, row, column = np.nonzero(requested)
    of_x, of_y = which[: x.size].reshape(x.shape)[case, column], which[x.size :].reshape(y.shape)[case, row]
    pairs, place = np.unique(np.minimum(of_x, of_y) * distances.size + np.maximum(of_x, of_y), return_inverse=True)
    return distances[np.stack(np.divmod(pairs, distances.size), axis=1)], place


def light_on_pixels(
    window: Window,
    requested: Bool[BoolArray, "cases rows columns"],
    half_px: float,
    radius_px: float,
    profile: DiscProfile | None,
    pitch_um: float,
) -> PixelLight:
    """Return the light of the requested pixels; the others are dark.

    `radius_px`: radius of the disc, pixels; a blurred one's is its profile's; `profile`: the blurred image; None for a
    sharp one. Returns means over the pixels, relative to a uniform field.
    """
    places_px, inverse = different(window, requested)
    place = np.full(requested.shape, len(places_px))
    place[requested] = inverse
    if profile is None:
        values, shares = covered(places_px[:, 0], places_px[:, 1], half_px, radius_px)[:, None], None
    else:
        places_um, half_um, shares = places_px * pitch_um, half_px * pitch_um, profile.shares
        if len(requested) < _LATTICE:
            values = profile.pixel_means(places_um, half_um)
        else:
            key = profile, half_um, places_um.tobytes()
            values = _LATTICES.get(key, lambda: profile.pixel_means(places_um, half_um))
    return PixelLight(np.vstack([values, np.zeros((1, values.shape[1]))]), place, shares)
