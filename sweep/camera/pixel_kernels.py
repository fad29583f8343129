"""Compiled sums over the parts of pixels, and over the pixels of a channel. They release the GIL."""

from __future__ import annotations

from ..base.machine_code import njit
from ..base.types import FloatArray, IndexArray


@njit(cache=True, nogil=True)
def gather(light: FloatArray, shares: FloatArray, place: IndexArray, through: IndexArray, out: FloatArray) -> None:
    """Add the light of pixels in place.

    `light`: light behind each channel's filter at each place; `shares`: weight of each part of a pixel; `through`: row
    of `light`, or -1 for a channel that does not count; `out`: array that is changed.
    """
    for pixel in range(out.shape[0]):
        for part in range(shares.size):
            row, share, at = through[part, pixel], shares[part], place[part, pixel]
            if row >= 0:
                for column in range(out.shape[1]):
                    out[pixel, column] += share * light[row, at, column]


@njit(cache=True, nogil=True)
def fold(values: FloatArray, row: IndexArray, pixel: IndexArray, weight: FloatArray, out: FloatArray) -> None:
    """Add the weighted values of pixels to rows in place."""
    for entry in range(row.size):
        to, of, share = row[entry], pixel[entry], weight[entry]
        for column in range(out.shape[1]):
            out[to, column] += share * values[of, column]
