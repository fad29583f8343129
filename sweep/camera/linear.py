"""Linear response of a scene and variance of its noise, with derivatives, for the search.

Nothing is clipped or rounded. The noise is that of a pixel far from both ends of its range, whose steps of rounding
are dithered: gain^2 (n + (PRNU n)^2 + read noise^2) + 1/12 for n expected electrons (EMVA 1288).
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property, lru_cache

import numpy as np

from ..base.types import Array, ChannelCurves, CurvesGradient, DesignCases, DesignCurves, Float, FloatArray
from .brightness import LampReadings, LampSlopes, room_dn
from .electrons import View
from .exposure import relative_slope
from .model import SceneModel
from .noise.law import STEPS_DN2, groups_of, pixel_law
from .pixel import unquantized
from .readout import CaptureLight, exposures_of
from .setup import READOUT, Setup

_FIELD_POSITIONS = 9
"""Field positions at which a search looks where all field positions count; its best design is read out at more."""
ElementSlopes = tuple[Float[Array, "elements moments signals"], Float[Array, "elements parameters moments signals"]]
Slopes = tuple[Float[Array, "cases signals channels"], Float[Array, "parameters cases signals channels"]]
"""Values of one design, and their exact derivatives with that of its exposure; a pulse's share is held."""


class LinearModel:
    """Unclipped, unrounded readout of a scene, which is linear in a design's QE except for the exposure.

    `hdr`: HDR pixel whose merged values have the noise; what is linear is one of full sensitivity that is read once. At
    most 9 field positions and 2 moments of a pulse are used.
    """

    def __init__(self, setup: Setup) -> None:
        pixel, positions = setup.camera.pixel, min(setup.accuracy.field_positions, _FIELD_POSITIONS)
        self.hdr = pixel if pixel.captures else None
        coarse = setup.accuracy.model_copy(update={"field_positions": positions, "pwm_moments": 2})
        self.setup = replace(setup, left_out=setup.left_out | READOUT, accuracy=coarse)
        if self.hdr is not None:
            self.setup = self.setup.with_camera(pixel=pixel.read_once)
        self.pixel, self.members = self.setup.camera.pixel, self.setup.members
        self.scene = SceneModel(self.setup)
        self.n_cases = self.scene.n_cases
        self._exposure = self.scene.exposures[0]

    @cached_property
    def _by_pixel(self) -> list[View]:
        """Views of single pixels."""
        return [*self.scene.views(by_pixel=True)]

    def smooth(self, curves: DesignCurves) -> DesignCases:
        """Return the unquantized, unclipped response, DN."""
        return self.scene.read(curves)[0]

    def unlit(self, curves: DesignCurves) -> Float[Array, "designs cases channels"]:
        """Return the response without the lamps, DN."""
        return self.scene.unlit(curves, self.scene.exposure_s(curves))

    def smooth_with_gradient(
        self, curves: ChannelCurves, curves_gradient: CurvesGradient, *, lamps_only: bool = False
    ) -> Slopes:
        """Return the response of one design, DN, and its derivative per unit of parameter.

        `lamps_only`: without black level, dark current and background.
        """
        gain, offset = self.pixel.dn_per_e, 0.0 if lamps_only else self.pixel.offset_dn
        parts = []
        for view in self.scene.own_views:
            electrons, by_u = self._with_slope(view, curves, curves_gradient, lamps_only=lamps_only)
            folded = _of_cases(view.image.folded(np.concatenate([electrons[:, None], by_u], axis=1)))
            parts.append(folded * gain)
        values = np.concatenate(parts, axis=1)
        return values[0] + offset, values[1:]

    def noisy_with_gradient(
        self, curves: ChannelCurves, curves_gradient: CurvesGradient
    ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return mean, DN, and variance, DN^2, of one design under noise, and their derivatives.

        The mean is `smooth`; of an HDR pixel it is that of its merged values, DN of the first capture, which saturate.
        """
        means, variances = [], []
        for view in self._by_pixel:
            electrons, by_u = self._with_slope(view, curves, curves_gradient)
            mean, variance, mean_per_e, variance_per_e = (of[:, None] for of in self._moments(view, electrons))
            means.append(_of_cases(view.image.folded(np.concatenate([mean, mean_per_e * by_u], axis=1))))
            variances.append(_of_cases(view.image.spread(np.concatenate([variance, variance_per_e * by_u], axis=1))))
        mean, variance = (np.concatenate(parts, axis=1) for parts in (means, variances))
        return mean[0], variance[0], mean[1:], variance[1:]

    def variance(self, curves: DesignCurves) -> DesignCases:
        """Return the variance of the noise, DN^2."""
        none = np.empty((0, *curves.shape[1:]))
        return np.stack([self.noisy_with_gradient(design, none)[1] for design in curves])

    def _moments(self, view: View, electrons: FloatArray) -> Float[Array, "4 elements moments signals"]:
        """Return mean and variance of pixels, and their derivatives by the electrons."""
        moments, pixel = np.empty((4, *electrons.shape)), self.pixel
        if self.hdr is None:
            variance_e2 = electrons + (pixel.prnu * electrons) ** 2 + pixel.read_noise_e**2
            moments[0], moments[1] = unquantized(electrons, pixel), pixel.dn_per_e**2 * variance_e2 + STEPS_DN2
            moments[2], moments[3] = pixel.dn_per_e, pixel.dn_per_e**2 * (1 + 2 * pixel.prnu**2 * electrons)
            return moments
        for of_exposures, which in groups_of(self._capture_light(view)):
            moments[:, which] = pixel_law(self.hdr, (of_exposures,), noisy=True).at(0, electrons[which])
        moments[3] = np.where(moments[1] > STEPS_DN2, moments[3], 0.0)
        moments[1] = np.maximum(moments[1], STEPS_DN2)
        return moments

    def _capture_light(self, view: View) -> CaptureLight:
        """Return the light of the exposures of the pixel itself."""
        pixel = self.pixel if self.hdr is None else self.hdr
        return view.capture_light(exposures_of(self.setup.with_camera(pixel=pixel)))

    @cached_property
    def linear_over_brightness(self) -> bool:
        """True if chromatic distances of filters like the base curve have their closed form, with a margin of two."""
        base = self.setup.camera.base_qe[None]
        response, unlit = self.smooth(base)[0], self.unlit(base)[0]
        longest_dn = np.sqrt(response.shape[-1]) * (response - unlit[:, None]).max(initial=0.0)
        return self.hdr is None and bool((room_dn(self.setup, response, unlit) >= 2 * longest_dn).all())

    def lamps_over_brightness(self, curves: ChannelCurves, curves_gradient: CurvesGradient) -> list[LampSlopes]:
        """Return the readings of the lamps of one design over their brightness, one for each case, with derivatives.

        `curves`: QE of the modified channels; `curves_gradient`: its derivatives.
        """
        noisy, result = self.setup.scene.noise is not None, []
        pixel = self.pixel if self.hdr is None else self.hdr
        for view in self._by_pixel:
            lit, lit_by_u = self._with_slope(view, curves, curves_gradient, lamps_only=True)
            dark, dark_by_u = self._dark_with_slope(view, curves, curves_gradient)
            light = self._capture_light(view)
            for case in range(view.image.n_cases):
                used, weights, spread, n_pixels = view.image.of_case(case)
                of_light, n = light[:, used], n_pixels
                for moment in range(lit.shape[1]):
                    of_lamps = lit[used, moment].T * of_light[:, None], dark[used] * of_light, of_light, weights, spread
                    lamps = LampReadings(*of_lamps, pixel, noisy, proportional=True, n_pixels=n)
                    slopes = np.swapaxes(lit_by_u[used, :, moment], 0, 1)
                    result.append(LampSlopes(lamps, np.swapaxes(slopes, 1, 2), dark_by_u[used].T))
        return result

    def spread_electrons(self, curves: DesignCurves) -> DesignCases:
        """Return expected electrons of the pixels, weighted by their shares of a channel's variance."""
        return np.concatenate([self._of_design(curves[at]) for at in range(len(curves))])

    def _of_design(self, curves: ChannelCurves) -> DesignCases:
        none, parts = np.empty((0, *curves.shape)), []
        for view in self._by_pixel:
            electrons = self._with_slope(view, curves, none)[0]
            parts.append(_of_cases(view.image.spread(electrons[:, None])))
        return np.concatenate(parts, axis=1)

    def spread_shares(self) -> Float[Array, "cases channels"]:
        """Return the sum of the pixels' shares of a channel's variance."""
        base = self.setup.camera.base_qe[None]
        repeats = self.scene.scales(self.scene.exposure_s(base)).shape[2]
        shares = [view.image.spread(np.ones((view.image.channel.size, 1)))[..., 0] for view in self._by_pixel]
        return np.repeat(np.concatenate(shares), repeats, axis=0)

    def _with_slope(
        self, view: View, curves: ChannelCurves, curves_gradient: CurvesGradient, *, lamps_only: bool = False
    ) -> ElementSlopes:
        """Return expected electrons and their derivative."""
        exposure_s = self.scene.exposure_s(curves[None])
        scales = self.scene.scales(exposure_s)[0, 0]
        both = np.concatenate([curves[None], curves_gradient])
        lit, dark = view.added(both, self._exposure, self.setup.camera.modified)
        fixed_lit, fixed_dark = view.fixed_rates(self._exposure)
        lit[:, 0] += fixed_lit
        dark[:, :1] += fixed_dark
        rates = lit[:, :, None] * scales[:, None]
        if not lamps_only:
            rates += dark[:, :, None, None]
        rates *= exposure_s
        relative = relative_slope(self.setup, self.scene.white, curves, curves_gradient)
        rates[:, 1:] += relative[:, None, None] * rates[:, :1]
        return rates[:, 0], rates[:, 1:]

    def _dark_with_slope(
        self, view: View, curves: ChannelCurves, curves_gradient: CurvesGradient
    ) -> tuple[Float[Array, " elements"], Float[Array, "elements parameters"]]:
        """Return expected electrons without lamps, and their derivative."""
        exposure_s = self.scene.exposure_s(curves[None])[0]
        both = np.concatenate([curves[None], curves_gradient])
        dark = view.added(both, self._exposure, self.setup.camera.modified)[1] * exposure_s
        dark[:, :1] += view.fixed_rates(self._exposure)[1] * exposure_s
        relative = relative_slope(self.setup, self.scene.white, curves, curves_gradient)
        return dark[:, 0], dark[:, 1:] + relative * dark[:, :1]

    def per_qe(
        self, modified: int, curves: ChannelCurves, *, lamps_only: bool = False
    ) -> Float[Array, "cases signals pixels wavelengths"]:
        """Return the response per unit of QE of one modified channel at every wavelength, DN.

        The smooth response is linear in it if the channel does not set the exposure.
        """
        every, parts = np.ones((1, 1)), []
        for view in self.scene.own_views:
            own, image = self.setup.camera.modified[modified], view.image
            light = image.folded(image.lit(self._every(view), [own], self._exposure.crosstalk))
            uniform = image.folded(image.uniform(every, [own], self._exposure.crosstalk))[..., 0]
            parts.append(self._per_qe(view, modified, curves, light, uniform * (not lamps_only)))
        return np.concatenate(parts) * self.pixel.dn_per_e

    def spread_per_qe(self, modified: int, curves: ChannelCurves) -> Float[Array, "cases signals wavelengths"]:
        """Return electrons per unit of QE of one modified channel in its pixels, weighted by shares of variance."""
        own, parts = self.setup.camera.modified[modified], []
        for view in self._by_pixel:
            image = view.image
            light = image.spread(image.lit(self._every(view), [own], self._exposure.crosstalk))
            uniform = image.spread(image.uniform(np.ones((1, 1)), [own], self._exposure.crosstalk))[..., 0]
            parts.append(self._per_qe(view, modified, curves, light[:, [own]], uniform[:, [own]])[:, :, 0])
        return np.concatenate(parts)

    @staticmethod
    def _every(view: View) -> Float[Array, "1 functions functions"]:
        """Return the light of each function alone."""
        return np.eye(1 if view.image.shares is None else len(view.image.shares))[None]

    def _per_qe(
        self,
        view: View,
        modified: int,
        curves: ChannelCurves,
        light: Float[Array, "rows channels functions"],
        uniform: Float[Array, "rows channels"],
    ) -> Float[Array, "cases signals channels wavelengths"]:
        """Return electrons per unit of QE of one modified channel, from light and uniform weights of the channels."""
        position, channel, shares = view.position, self.setup.camera.modified[modified], view.image.shares
        exposure_s = self.scene.exposure_s(curves[None])
        scales = self.scene.scales(exposure_s)[0, 0]
        whole = light if shares is None else light @ shares
        lit = position.per_qe(whole[:, None] * position.signals[:, None], channel)
        background = uniform[:, None, None, :, None] * position.per_qe(position.background, channel)
        total = lit[:, None] * scales[:, None, None, None] + background
        return np.asarray(total.reshape(-1, *total.shape[2:]) * exposure_s[0], dtype=float)


def _of_cases(
    folded: Float[Array, "places channels rows moments signals"],
) -> Float[Array, "rows cases signals channels"]:
    """Return values of channels in the order of rows, cases, signals and channels."""
    ordered = np.transpose(folded, (2, 0, 3, 4, 1))
    return ordered.reshape(len(ordered), -1, *ordered.shape[3:])


@lru_cache(maxsize=16)
def linear_model(setup: Setup) -> LinearModel:
    """Return the linear model of a setup; recent ones are kept."""
    return LinearModel(setup)
