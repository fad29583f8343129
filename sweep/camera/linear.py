"""The smooth response of a scene, neither clipped nor rounded, with its derivatives: what a search sees."""

from __future__ import annotations

import hashlib
import pickle
from dataclasses import replace

import numpy as np

from ..cache import Cache
from ..types import FloatArray
from .exposure import relative_slope
from .imager import Imager
from .pixel import unquantized
from .view import View


class LinearImager(Imager):
    """An imager whose electrons are taken for digital numbers, linear in a design's QE but for the exposure."""

    def smooth(self, curves: FloatArray) -> FloatArray:
        """Unquantized, unclipped response, DN, ndarray[n_designs, n_cases, n_signals, n_channels]."""
        exposure_s = self.electrons.exposure_s(curves)
        expected = self.electrons.expected(curves, self.electrons.scales(exposure_s), exposure_s)
        return self.readout.folded(unquantized(expected, self.readout.pixel))

    def gradient(self, curves: FloatArray, curves_gradient: FloatArray) -> FloatArray:
        """Exact derivative of `smooth` at one design, with that of its exposure; a pulse's share of it is held.

        `curves`: ndarray[n_modified, n_wavelengths]; `curves_gradient`: ndarray[n_parameters, n_modified,
        n_wavelengths]. Returns DN per unit of parameter, ndarray[n_parameters, n_cases, n_signals, n_channels].
        """
        own, n = self.electrons, len(curves_gradient)
        one = curves[None]
        exposure_s = own.exposure_s(one)
        scales = own.scales(exposure_s)
        whole = own.expected(one, scales, exposure_s)[0]
        light = (own.rates(curves_gradient) - own.fixed)[:, :, None] * scales[0][None, None, :, None, None]
        uniform = own.through_filters(own.of_background(curves_gradient))
        slope = (light + uniform[:, :, None, None, :]).reshape(n, *whole.shape) * exposure_s
        relative = relative_slope(self.view, curves, curves_gradient)
        slope = slope + relative[:, None, None, None] * whole
        return self.readout.folded(np.asarray(slope, dtype=float) * self.view.pixel.dn_per_e)

    def per_qe(self, modified: int, curves: FloatArray) -> FloatArray:
        """DN per QE of one modified channel at every wavelength, with the exposure of the design `curves`.

        ndarray[n_cases, n_signals, n_units, n_wavelengths]; the smooth response is linear in it where N does not set
        the exposure.
        """
        own, channel = self.electrons, self.view.modified[modified]
        exposure_s = own.exposure_s(curves[None])
        scales = own.scales(exposure_s)[0]
        light = own.kernel.light[:, None, None, :, channel] * own.signals[:, None, :]
        light = own.at_each_place(light[..., None, :], [channel])[..., 0, :]
        background = own.background[own.place, modified][:, None, None, None]
        uniform = own.kernel.uniform[:, None, None, :, channel, None] * background
        both = light * scales[None, :, None, None, None] + uniform
        return np.asarray(both.reshape(-1, *both.shape[2:]) * (exposure_s[0] * self.view.pixel.dn_per_e), dtype=float)


_imagers: Cache[bytes, LinearImager] = Cache(16)


def smooth_imager(view: View) -> LinearImager:
    """The imager of a view without clipping and rounding, on every wavelength: what a search sees.

    The latest ones are kept, so that a kernel is made once in a process.
    """
    straight = {"saturation": "skip", "quantization": "skip", "noise": "skip", "quadrature": "grid"}
    if view.methods.flicker == "fine":  # of a straight response the ends are the extremes
        straight["flicker"] = "ends"
    seen = replace(view, methods=replace(view.methods, **straight))
    return _imagers.get(hashlib.sha256(pickle.dumps(seen)).digest(), lambda: LinearImager(seen))
