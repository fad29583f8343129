"""A channel as a weighted sum of red, green and blue: what a simulator of CFAs does that starts from RGB images."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..base.types import FloatArray


@dataclass(frozen=True)
class RgbWeights:
    """The least-squares fit of channels by red, green and blue, every wavelength counted alike.

    `weights`: ndarray[n_channels, 3], of any sign. `residual`: ndarray[n_channels], root mean square of what the fit
    leaves over that of the channel's curve: 0 where the sum is the channel, 1 where it has nothing of it.
    `light_error`: ndarray[n_channels], the largest error of a channel's electrons over the lights, as a share of those
    of its brightest light; infinite where it sees none of them.
    """

    channels: tuple[str, ...]
    weights: FloatArray
    residual: FloatArray
    light_error: FloatArray

    def as_csv(self) -> str:
        """A row per channel; every float comes back as it is."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(["channel", "red", "green", "blue", "residual", "largest_error_of_a_light"])
        rows = zip(self.channels, self.weights, self.residual, self.light_error, strict=True)
        for channel, weights, residual, error in rows:
            writer.writerow([channel, *(repr(float(number)) for number in (*weights, residual, error))])
        return text.getvalue()


def rgb_weights(qe: Mapping[str, FloatArray], rgb: FloatArray, photons: FloatArray) -> RgbWeights:
    """Fit channels, ndarray[n_wavelengths] each, by the curves `rgb`, ndarray[3, n_wavelengths].

    `photons`: ndarray[n_lights, n_wavelengths]. A channel whose curve is 0 has weights and a residual of 0.
    """
    curves = np.stack(list(qe.values()))
    weights = np.asarray(np.linalg.lstsq(rgb.T, curves.T, rcond=None)[0].T, dtype=float)
    fit = weights @ rgb
    left, whole = (np.asarray(np.sqrt((part**2).mean(axis=1)), dtype=float) for part in (curves - fit, curves))
    brightest, off = (curves @ photons.T).max(axis=1), np.abs((fit - curves) @ photons.T).max(axis=1)
    errors = np.divide(off, brightest, out=np.full_like(off, np.inf), where=brightest > 0)
    residual = np.divide(left, whole, out=np.zeros_like(left), where=whole > 0)
    return RgbWeights(tuple(qe), weights, residual, errors)
