"""Linear response of a scene and variance of its noise, with derivatives, for the search.

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
from ..base.errors import SweepError, ValidationIssue
from ..base.types import Array, ChannelCurves, CurvesGradient, DesignCases, DesignCurves, Float, MemberNumbers
from .brightness import LampReadings, LampSlopes, room_dn
from .exposure import relative_slope
from .forward import ForwardModel
from .pixel import Pixel, unquantized
from .pixel_curve import STEPS_DN2, groups_of, pixel_curve
from .pixel_response import SplitLight
from .readout import Readout, capture_light
from .setup import READOUT, Setup

_FIELD_POSITIONS = 9
"""Field positions at which a search looks where all field positions count; its best design is read out at more."""


class LinearModel(ForwardModel):
    """Forward model of an unclipped, unrounded readout, which is linear in a design's QE except for the exposure.

    `hdr` is the HDR pixel whose merged values have the noise; the model itself reads one of full sensitivity once.
    """

    hdr: Pixel | None = None

    def smooth(self, curves: DesignCurves) -> DesignCases:
        """Return the unquantized, unclipped response, DN."""
        return self.readout.folded(unquantized(self._expected(curves), self.readout.pixel))

    def gradient(
        self, curves: ChannelCurves, curves_gradient: CurvesGradient
    ) -> Float[Array, "parameters cases signals channels"]:
        """Return the exact derivative of `smooth` at one design, with that of its exposure; a pulse's share is held.

        Returns DN per unit of parameter.
        """
        return self.smooth_with_gradient(curves, curves_gradient)[1]

    def smooth_with_gradient(
        self, curves: ChannelCurves, curves_gradient: CurvesGradient
    ) -> tuple[Float[Array, "cases signals channels"], Float[Array, "parameters cases signals channels"]]:
        """Return `smooth` and `gradient` of one design.

        Returns `response`: response, DN; `gradient`: DN per unit of parameter.
        """
        electrons, slope = self._with_slope(curves, curves_gradient)
        response = self.readout.folded(unquantized(electrons, self.readout.pixel))
        return response, self.readout.folded(slope * self.setup.camera.pixel.dn_per_e)

    def lamps_with_gradient(
        self, curves: ChannelCurves, curves_gradient: CurvesGradient
    ) -> tuple[Float[Array, "cases signals channels"], Float[Array, "parameters cases signals channels"]]:
        """Return the response to the lamps alone, without black level, dark current and background.

        Returns `response`: response, DN; `gradient`: DN per unit of parameter.
        """
        electrons, slope = self._with_slope(curves, curves_gradient, lamps_only=True)
        dn_per_e = self.readout.pixel.dn_per_e
        return self.readout.folded(electrons * dn_per_e), self.readout.folded(slope * dn_per_e)

    def variance(self, curves: DesignCurves) -> DesignCases:
        """Return the variance of the noise, DN^2."""
        electrons, pixel = self.by_pixel._expected(curves), self.readout.pixel
        variance_e2 = electrons + (pixel.prnu * electrons) ** 2 + pixel.read_noise_e**2
        return self.by_pixel.readout.spread(pixel.dn_per_e**2 * variance_e2 + STEPS_DN2)

    def variance_gradient(
        self, curves: ChannelCurves, curves_gradient: CurvesGradient
    ) -> Float[Array, "parameters cases signals channels"]:
        """Return the exact derivative of `variance` at one design.

        Returns DN^2 per unit of parameter.
        """
        pixel = self.readout.pixel
        electrons, slope = self.by_pixel._with_slope(curves, curves_gradient)
        per_e = pixel.dn_per_e**2 * (1 + 2 * pixel.prnu**2 * electrons)
        return self.by_pixel.readout.spread(per_e * slope)

    def merged_with_gradient(
        self, curves: ChannelCurves, curves_gradient: CurvesGradient
    ) -> tuple[
        Float[Array, "cases signals channels"],
        Float[Array, "cases signals channels"],
        Float[Array, "parameters cases signals channels"],
        Float[Array, "parameters cases signals channels"],
    ]:
        """Return mean and variance of the merged values of an HDR pixel at one design, and their derivatives.

        Unlike `smooth`, the mean is that of pixels which saturate.

        Returns `mean, variance`: mean, DN of the first capture, and variance, DN^2; `mean_by, variance_by`:
        derivatives, per unit of parameter.
        """
        assert self.hdr is not None
        by_pixel = self.by_pixel
        electrons, slope = by_pixel._with_slope(curves, curves_gradient)
        light = capture_light(self.setup.with_camera(pixel=self.hdr), by_pixel.electrons.response)
        moments = np.empty((4, *electrons.shape))
        for of_exposures, which in groups_of(light):
            curve = pixel_curve(self.hdr, of_exposures, noisy=True)
            moments[..., which] = *curve.moments(electrons[..., which]), *curve.slopes(electrons[..., which])
        mean, variance, mean_per_e, variance_per_e = moments
        variance_per_e = np.where(variance > STEPS_DN2, variance_per_e, 0.0)
        variance = np.maximum(variance, STEPS_DN2)
        folded, spread = by_pixel.readout.folded, by_pixel.readout.spread
        return (
            folded(mean[None])[0],
            spread(variance[None])[0],
            folded(mean_per_e * slope),
            spread(variance_per_e * slope),
        )

    @cached_property
    def linear_over_brightness(self) -> bool:
        """True if chromatic distances of filters like the base curve have their closed form, with a margin of two."""
        base = self.setup.camera.base_qe[None]
        response, unlit = self.smooth(base)[0], self.unlit(base, self.light.exposure_s(base))[0]
        longest_dn = np.sqrt(response.shape[-1]) * (response - unlit[:, None]).max(initial=0.0)
        return self.hdr is None and bool((room_dn(self.setup, response, unlit) >= 2 * longest_dn).all())

    def lamps_over_brightness(self, curves: ChannelCurves, curves_gradient: CurvesGradient) -> list[LampSlopes]:
        """Return the readings of the lamps of one design over their brightness, one for each case, with derivatives.

        `curves`: QE of the modified channels; `curves_gradient`: its derivatives.
        """
        by_pixel = self.by_pixel
        pixel = by_pixel.readout.pixel if self.hdr is None else self.hdr
        electrons, slope = by_pixel._with_slope(curves, curves_gradient)
        lit, lit_by_u = by_pixel._with_slope(curves, curves_gradient, lamps_only=True)
        readout = Readout(by_pixel.setup.with_camera(pixel=pixel), by_pixel.electrons.response)
        light = readout.capture_light if pixel.captures else np.ones((1, electrons.shape[-1]))
        dark, dark_by_u = electrons[:, 0] - lit[:, 0], slope[:, :, 0] - lit_by_u[:, :, 0]
        moments, noisy = len(electrons) // readout.n_cases, self.setup.scene.noise is not None
        result = []
        for case in range(len(electrons)):
            here = readout.at(case // moments)
            lamps = LampReadings(lit[case] * light[:, None], dark[case] * light, light, here, noisy)
            result.append(LampSlopes(lamps, lit_by_u[:, case], dark_by_u[:, case]))
        return result

    def spread_electrons(self, curves: DesignCurves) -> DesignCases:
        """Return expected electrons of the pixels, weighted by their shares of a channel's variance."""
        return self.by_pixel.readout.spread(self.by_pixel._expected(curves))

    def spread_shares(self) -> Float[Array, "cases channels"]:
        """Return the sum of the pixels' shares of a channel's variance."""
        response = self.by_pixel.electrons.response
        repeats = self.by_pixel._expected(self.setup.camera.base_qe[None]).shape[1] // len(response.spread)
        return np.repeat(response.spread.sum(axis=1), repeats, axis=0)

    @cached_property
    def members(self) -> dict[str, MemberNumbers]:
        """Indices of the signals of each signal type."""
        return self.setup.members

    @cached_property
    def by_pixel(self) -> LinearModel:
        """Model of the same scene with single pixels; raises SweepError if they do not fit into memory."""
        setup = replace(self.setup, left_out=self.setup.left_out - {"saturation", "quantization"})
        result = _ByPixel(setup)
        if result._phase_blocks:
            most = f"at most those of {len(result._phase_blocks[0])} sampling phases: a smaller light, or a named phase"
            problem = "too many pixels for a search under noise"
            raise SweepError(ValidationIssue(problem, value=f"{result.n_cases} phases", allowed=most))
        return result

    def _expected(self, curves: DesignCurves) -> DesignCases:
        """Return expected electrons."""
        exposure_s = self.light.exposure_s(curves)
        return self.electrons.expected(curves, self.light.scales(exposure_s), exposure_s)

    def _with_slope(
        self, curves: ChannelCurves, curves_gradient: CurvesGradient, *, lamps_only: bool = False
    ) -> tuple[Float[Array, "cases signals channels"], Float[Array, "parameters cases signals channels"]]:
        """Return expected electrons and their derivative."""
        electrons, n = self.electrons, len(curves_gradient)
        design = curves[None]
        exposure_s = self.light.exposure_s(design)
        scales = self.light.scales(exposure_s)
        expected = electrons.expected(design, scales, exposure_s)[0]
        if lamps_only:
            expected = expected - np.repeat(electrons.unlit(design)[0], scales.shape[1], axis=0)[:, None] * exposure_s
        light = (electrons.rates(curves_gradient) - electrons.fixed)[:, :, None] * scales[0][None, None, :, None, None]
        uniform = electrons.through_filters(electrons.of_background(curves_gradient))
        uniform = np.zeros_like(uniform) if lamps_only else uniform
        slope = (light + uniform[:, :, None, None, :]).reshape(n, *expected.shape) * exposure_s
        relative = relative_slope(self.setup, self.light.white, curves, curves_gradient)
        return expected, np.asarray(slope + relative[:, None, None, None] * expected, dtype=float)

    def per_qe(
        self, modified: int, curves: ChannelCurves, *, lamps_only: bool = False
    ) -> Float[Array, "cases signals pixels wavelengths"]:
        """Return the response per unit of QE of one modified channel at every wavelength.

        The smooth response is linear in it if the channel does not set the exposure.

        Returns DN per unit of QE.
        """
        response, channel = self.electrons.response, self.setup.camera.modified[modified]
        uniform = response.uniform[:, :, channel] * (not lamps_only)
        rates = self._per_qe(modified, curves, response.light[:, :, channel], uniform)
        return rates * self.setup.camera.pixel.dn_per_e

    def spread_per_qe(self, modified: int, curves: ChannelCurves) -> Float[Array, "cases signals wavelengths"]:
        """Return electrons per unit of QE of one modified channel in its pixels, weighted by shares of variance."""
        by_pixel, channel = self.by_pixel, self.setup.camera.modified[modified]
        response = by_pixel.electrons.response
        share = response.spread[:, :, channel]
        split = response.source
        if isinstance(split, SplitLight):
            light = split.folded(share, channel)
        else:
            light = np.einsum("xu,xuw->xw", share, split[:, :, channel])
        uniform = (share * response.uniform[:, :, channel]).sum(axis=1)
        return by_pixel._per_qe(modified, curves, light[:, None], uniform[:, None])[:, :, 0]

    def _per_qe(
        self,
        modified: int,
        curves: ChannelCurves,
        light: Float[Array, "_ channels wavelengths"],
        uniform: Float[Array, "rows channels"],
    ) -> Float[Array, "_cases _signals channels wavelengths"]:
        """Return electrons per unit of QE of one modified channel, from light and uniform weights of its elements."""
        electrons, channel = self.electrons, self.setup.camera.modified[modified]
        exposure_s = self.light.exposure_s(curves[None])
        scales = self.light.scales(exposure_s)[0]
        signal_light = light[:, None, None] * self.light.signals[:, None, :]
        signal_light = electrons.at_each_position(signal_light[..., None, :], [channel])[..., 0, :]
        background = electrons.background[electrons.position, modified][:, None, None, None]
        total = signal_light * scales[None, :, None, None, None] + uniform[:, None, None, :, None] * background
        return np.asarray(total.reshape(-1, *total.shape[2:]) * exposure_s[0], dtype=float)


class _ByPixel(LinearModel):
    """Linear model of single pixels, those of all field positions together."""

    together = True


_models: Cache[bytes, LinearModel] = Cache(16)


def linear_model(setup: Setup) -> LinearModel:
    """Return the linear model of a setup; recent models are cached.

    `setup`: camera, lights, scene and accuracy; at most 9 field positions and 2 moments of a pulse are used.
    """
    coarse = setup.accuracy.model_copy(
        update={"field_positions": min(setup.accuracy.field_positions, _FIELD_POSITIONS), "pwm_moments": 2}
    )
    hdr = setup.camera.pixel if setup.camera.pixel.captures else None
    setup = setup if hdr is None else setup.with_camera(pixel=hdr.read_once)
    without_readout = replace(setup, left_out=setup.left_out | READOUT, accuracy=coarse)

    def build() -> LinearModel:
        model = LinearModel(without_readout)
        model.hdr = hdr
        return model

    return _models.get(hashlib.sha256(pickle.dumps((without_readout, hdr))).digest(), build)
