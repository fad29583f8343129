"""The smooth response of a scene and the variance of its noise, with their derivatives: what a search sees.

Nothing is clipped or rounded. The noise is that of a pixel far from both ends of its range, whose steps of rounding
are dithered: gain^2 (n + (PRNU n)^2 + read noise^2) + 1/12 for n expected electrons (EMVA 1288).
"""

from __future__ import annotations

import hashlib
import pickle
from dataclasses import replace
from functools import cached_property

import numpy as np

from ..base.cache import Cache
from ..base.errors import Fault, SweepError
from ..base.types import FloatArray, IndexArray
from .exposure import relative_slope
from .forward import ForwardModel
from .pixel import unquantized
from .pixel_response import SplitLight
from .setup import READOUT, Setup

_STEPS_DN2 = 1 / 12
"""Variance of rounding to whole digital numbers, DN^2."""
_FIELD_POSITIONS = 9
"""Field positions at which a search looks where all places of the sensor count; its best design is read out at more."""


class LinearModel(ForwardModel):
    """The forward model of an unclipped, unrounded readout: linear in a design's QE but for the exposure."""

    def smooth(self, curves: FloatArray) -> FloatArray:
        """Unquantized, unclipped response, DN, ndarray[n_designs, n_cases, n_signals, n_channels]."""
        return self.readout.folded(unquantized(self._expected(curves), self.readout.pixel))

    def gradient(self, curves: FloatArray, curves_gradient: FloatArray) -> FloatArray:
        """Exact derivative of `smooth` at one design, with that of its exposure; a pulse's share of it is held.

        `curves`: ndarray[n_modified, n_wavelengths]; `curves_gradient`: ndarray[n_parameters, n_modified,
        n_wavelengths]. Returns DN per unit of parameter, ndarray[n_parameters, n_cases, n_signals, n_channels].
        """
        return self.smooth_with_gradient(curves, curves_gradient)[1]

    def smooth_with_gradient(self, curves: FloatArray, curves_gradient: FloatArray) -> tuple[FloatArray, FloatArray]:
        """`smooth` of one design, ndarray[n_cases, n_signals, n_channels], and its `gradient`."""
        whole, slope = self._with_slope(curves, curves_gradient)
        response = self.readout.folded(unquantized(whole, self.readout.pixel))
        return response, self.readout.folded(slope * self.setup.camera.pixel.dn_per_e)

    def variance(self, curves: FloatArray) -> FloatArray:
        """Variance of the noise, DN^2, of the shape of `smooth`."""
        electrons, pixel = self.by_pixel._expected(curves), self.readout.pixel
        own = electrons + (pixel.prnu * electrons) ** 2 + pixel.read_noise_e**2
        return self.by_pixel.readout.spread(pixel.dn_per_e**2 * own + _STEPS_DN2)

    def variance_gradient(self, curves: FloatArray, curves_gradient: FloatArray) -> FloatArray:
        """Exact derivative of `variance` at one design, DN^2 per unit of parameter; see `gradient`."""
        pixel = self.readout.pixel
        whole, slope = self.by_pixel._with_slope(curves, curves_gradient)
        per_e = pixel.dn_per_e**2 * (1 + 2 * pixel.prnu**2 * whole)
        return self.by_pixel.readout.spread(per_e * slope)

    def spread_electrons(self, curves: FloatArray) -> FloatArray:
        """Expected electrons of the pixels, each with its share of a channel's variance, of the shape of `smooth`."""
        return self.by_pixel.readout.spread(self.by_pixel._expected(curves))

    def spread_shares(self) -> FloatArray:
        """Sum of the shares that the pixels have in a channel's variance, ndarray[n_cases, n_channels]."""
        response = self.by_pixel.electrons.response
        repeats = self.by_pixel._expected(self.setup.camera.base_qe[None]).shape[1] // len(response.spread)
        return np.repeat(response.spread.sum(axis=1), repeats, axis=0)

    @cached_property
    def members(self) -> dict[str, IndexArray]:
        """Signal type -> indices of its signals."""
        return self.setup.members

    @cached_property
    def by_pixel(self) -> LinearModel:
        """The same scene with its pixels kept apart, whose variances are not those of their mean.

        Raises SweepError where the pixels of all places of the light do not fit into memory.
        """
        setup = replace(self.setup, left_out=self.setup.left_out - {"saturation", "quantization"})
        result = _ByPixel(setup)
        if result._phase_blocks:
            most = f"at most those of {len(result._phase_blocks[0])} places: a smaller light, or a named place"
            problem = "too many pixels for a search under noise"
            raise SweepError(Fault(problem, value=f"{result.n_cases} places", allowed=most))
        return result

    def _expected(self, curves: FloatArray) -> FloatArray:
        """Expected electrons of the units, ndarray[n_designs, n_cases, n_signals, n_units]."""
        exposure_s = self.light.exposure_s(curves)
        return self.electrons.expected(curves, self.light.scales(exposure_s), exposure_s)

    def _with_slope(self, curves: FloatArray, curves_gradient: FloatArray) -> tuple[FloatArray, FloatArray]:
        """`_expected` of one design, and its exact derivative, electrons per unit of parameter; see `gradient`."""
        own, n = self.electrons, len(curves_gradient)
        one = curves[None]
        exposure_s = self.light.exposure_s(one)
        scales = self.light.scales(exposure_s)
        whole = own.expected(one, scales, exposure_s)[0]
        light = (own.rates(curves_gradient) - own.fixed)[:, :, None] * scales[0][None, None, :, None, None]
        uniform = own.through_filters(own.of_background(curves_gradient))
        slope = (light + uniform[:, :, None, None, :]).reshape(n, *whole.shape) * exposure_s
        relative = relative_slope(self.setup, self.light.white, curves, curves_gradient)
        return whole, np.asarray(slope + relative[:, None, None, None] * whole, dtype=float)

    def per_qe(self, modified: int, curves: FloatArray) -> FloatArray:
        """DN per QE of one modified channel at every wavelength, with the exposure of the design `curves`.

        ndarray[n_cases, n_signals, n_units, n_wavelengths]; the smooth response is linear in it where N does not set
        the exposure.
        """
        response, channel = self.electrons.response, self.setup.camera.modified[modified]
        rates = self._per_qe(modified, curves, response.light[:, :, channel], response.uniform[:, :, channel])
        return rates * self.setup.camera.pixel.dn_per_e

    def spread_per_qe(self, modified: int, curves: FloatArray) -> FloatArray:
        """Electrons per QE of one modified channel in its pixels, each with its share of the channel's variance.

        ndarray[n_cases, n_signals, n_wavelengths]; see `per_qe`.
        """
        own, channel = self.by_pixel, self.setup.camera.modified[modified]
        response = own.electrons.response
        share = response.spread[:, :, channel]
        split = response.source
        if isinstance(split, SplitLight):
            light = split.folded(share, channel)
        else:
            light = np.einsum("xu,xuw->xw", share, split[:, :, channel])
        uniform = (share * response.uniform[:, :, channel]).sum(axis=1)
        return own._per_qe(modified, curves, light[:, None], uniform[:, None])[:, :, 0]

    def _per_qe(self, modified: int, curves: FloatArray, light: FloatArray, uniform: FloatArray) -> FloatArray:
        """Electrons per QE of one modified channel, ndarray[n_cases, n_signals, n_units, n_wavelengths].

        `light`, `uniform`: what units get through it, see `PixelResponse`, without the axis of the channels.
        """
        own, channel = self.electrons, self.setup.camera.modified[modified]
        exposure_s = self.light.exposure_s(curves[None])
        scales = self.light.scales(exposure_s)[0]
        seen = light[:, None, None] * self.light.signals[:, None, :]
        seen = own.at_each_position(seen[..., None, :], [channel])[..., 0, :]
        background = own.background[own.position, modified][:, None, None, None]
        both = seen * scales[None, :, None, None, None] + uniform[:, None, None, :, None] * background
        return np.asarray(both.reshape(-1, *both.shape[2:]) * exposure_s[0], dtype=float)


class _ByPixel(LinearModel):
    """A linear model whose pixels are kept apart, those of all field positions together."""

    together = True


_models: Cache[bytes, LinearModel] = Cache(16)


def linear_model(setup: Setup) -> LinearModel:
    """The linear model of a setup: what a search sees.

    The latest ones are kept, so that a response is made once in a process. All places of the sensor are seen at few
    field positions.
    """
    few = setup.accuracy.model_copy(
        update={"field_positions": min(setup.accuracy.field_positions, _FIELD_POSITIONS), "pwm_moments": 2}
    )
    seen = replace(setup, left_out=setup.left_out | READOUT, accuracy=few)
    return _models.get(hashlib.sha256(pickle.dumps(seen)).digest(), lambda: LinearModel(seen))
