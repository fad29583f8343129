"""Raw image as planes: one per pixel of the tile, or one per channel after demosaicking."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import convolve1d

from ...base.types import Array, Float
from ...camera.mosaic import Mosaic
from ...camera.pixel import Pixel

_LEAST_PRNU = 1e-6


def in_noise(raw: NDArray[np.generic], pixel: Pixel) -> Float[Array, " ..."]:
    """Return raw values on a scale on which their noise is 1.

    With e electrons above the pedestal, (1/p) ln(1 + 2 p (sqrt(s^2 + e + p^2 e^2) + p e)) has a slope of 1 over the
    noise, of shot noise, PRNU p and the rest s.

    `raw`: values, DN.
    """
    gain, prnu = pixel.dn_per_e, max(pixel.prnu, _LEAST_PRNU)
    rest = pixel.read_noise_e**2 + 1 / (12 * gain**2) + 3 / 8  # 3/8: Anscombe's, of few photons
    electrons = np.maximum((raw.astype(float) - pixel.offset_dn) / gain, -rest / 2)
    root = np.sqrt(rest + electrons + (prnu * electrons) ** 2)
    return np.asarray(np.log1p(2 * prnu * (root + prnu * electrons)) / prnu, dtype=float)


def demosaicked(
    images: Float[Array, "*batch rows columns"], mosaic: Mosaic
) -> Float[Array, "... rows columns channels"]:
    """Return every channel at every pixel, for a tile of any size.

    Normalized convolution with a tent as wide as the tile, as in `camera.sampling.center_weights`.
    """
    tile = mosaic.indices
    high, wide = images.shape[-2:]
    channel = tile[np.ix_(*(np.arange(side) % size for side, size in zip((high, wide), tile.shape, strict=True)))]
    tents = [1 - np.abs(np.arange(-size + 1, size)) / size for size in tile.shape]
    channels = np.empty((*images.shape, len(mosaic.channels)))
    for number in range(len(mosaic.channels)):
        in_channel = (channel == number).astype(float)
        # Beyond the border is nothing; at a border one channel may lack a neighbor, and never all of them.
        channels[..., number] = _convolved(in_channel * images, tents) / np.maximum(
            _convolved(in_channel, tents), 1e-12
        )
    return channels


def _convolved(images: Float[Array, "... rows columns"], tents: list[Float[Array, " _taps"]]) -> Float[Array, " ..."]:
    """Convolve with the product of a tent along the rows' axis and one along the columns'."""
    result = images
    for axis, tent in zip((-2, -1), tents, strict=True):
        result = convolve1d(result, tent, axis=axis, mode="constant")
    return result
