"""Linear response of a scene and variance of its noise, with derivatives, for the search.

Nothing is clipped or rounded. The noise is that of a pixel far from both ends of its range, whose steps of rounding
are dithered: gain^2 (n + (PRNU n)^2 + read noise^2) + 1/12 for n expected electrons (EMVA 1288).
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property, lru_cache

import numpy as np

from ..base.types import Array, ChannelCurves, CurvesGradient, DesignCases, DesignCurves, Float, FloatArray, SameShape
from .brightness import LampReadings, LampSlopes, room_dn
from .electrons import View
from .exposure import relative_slope
from .image import in_cases
from .model import SceneModel
from .noise.law import STEPS_DN2, groups_of, pixel_law
from .pixel import unquantized
from .readout import CaptureLight, exposures_of, light_of_elements
from .setup import READOUT, Setup

_FIELD_POSITIONS = 9
"""Field positions at which a search looks where all field positions count; its best design is read out at more."""
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
        parts = []
        for view in self.scene.own_views:
            electrons = self._electrons(view, curves, curves_gradient, lamps_only=lamps_only)
            parts.append(in_cases(view.image.folded(electrons)))
        values = np.concatenate(parts, axis=1) * self.pixel.dn_per_e
        return values[0] + (0.0 if lamps_only else self.pixel.offset_dn), values[1:]

    def noisy_with_gradient(
        self, curves: ChannelCurves, curves_gradient: CurvesGradient
    ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return mean, DN, and variance, DN^2, of one design under noise, and their derivatives.

        The mean is `smooth`; of an HDR pixel it is that of its merged values, DN of the first capture, which saturate.
        """
        means, variances = [], []
        for view in self._by_pixel:
            electrons = self._electrons(view, curves, curves_gradient)
            by_u, moments = electrons[:, 1:], self._moments(view, electrons[:, 0])
            mean, variance, mean_per_e, variance_per_e = (of[:, None] for of in moments)
            means.append(in_cases(view.image.folded(np.concatenate([mean, mean_per_e * by_u], axis=1))))
            variances.append(in_cases(view.image.spread(np.concatenate([variance, variance_per_e * by_u], axis=1))))
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
        exposures = exposures_of(self.setup.with_camera(pixel=self.hdr or self.pixel))
        return light_of_elements(exposures, view.image.channel)

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
        for view in self._by_pixel:
            lit = self._electrons(view, curves, curves_gradient, lamps_only=True)
            rows = self._unlit(view, np.concatenate([curves[None], curves_gradient]))[:, :, None, None]
            dark = self._exposed(rows, curves, curves_gradient)[:, :, 0, 0]
            light = self._capture_light(view)
            for case in range(view.image.n_cases):
                used, weights, spread, n_pixels = view.image.of_case(case)
                of_light = light[:, used]
                for moment in range(lit.shape[2]):
                    lit_e = np.moveaxis(lit[used, :, moment], 0, 2)  # [rows, signals, elements]
                    of_lamps = lit_e[0] * of_light[:, None], dark[used, 0] * of_light, of_light, weights, spread
                    lamps = LampReadings(*of_lamps, self.hdr or self.pixel, noisy, proportional=True, n_pixels=n_pixels)
                    result.append(LampSlopes(lamps, lit_e[1:], dark[used, 1:].T))
        return result

    def spread_electrons(self, curves: DesignCurves) -> DesignCases:
        """Return expected electrons of the pixels, weighted by their shares of a channel's variance."""
        none, parts = np.empty((0, *curves.shape[1:])), []
        for view in self._by_pixel:
            of_designs = [view.image.spread(self._electrons(view, design, none)) for design in curves]
            parts.append(in_cases(np.concatenate(of_designs, axis=2)))
        return np.concatenate(parts, axis=1)

    def spread_shares(self) -> Float[Array, "cases channels"]:
        """Return the sum of the pixels' shares of a channel's variance."""
        base = self.setup.camera.base_qe[None]
        repeats = self.scene.scales(self.scene.exposure_s(base)).shape[2]
        shares = [view.image.spread(np.ones((view.image.channel.size, 1)))[..., 0] for view in self._by_pixel]
        return np.repeat(np.concatenate(shares), repeats, axis=0)

    def _electrons(
        self, view: View, curves: ChannelCurves, curves_gradient: CurvesGradient, *, lamps_only: bool = False
    ) -> Float[Array, "elements rows moments signals"]:
        """Return expected electrons of one design, and in further rows their derivatives."""
        rows, modified = np.concatenate([curves[None], curves_gradient]), self.setup.camera.modified
        lit = view.lit(rows, modified, self._exposure)
        lit[:, :1] += view.fixed(self._exposure)[0]
        rates = lit[:, :, None] * self.scene.scales(self.scene.exposure_s(curves[None]))[0, 0][:, None]
        if not lamps_only:
            rates += self._unlit(view, rows)[:, :, None, None]
        return self._exposed(rates, curves, curves_gradient)

    def _unlit(self, view: View, rows: DesignCurves) -> Float[Array, "elements rows"]:
        """Return electrons/s of one design without lamps, and in further rows their derivatives."""
        dark = view.background(rows, self.setup.camera.modified, self._exposure)
        dark[:, :1] += view.fixed(self._exposure)[1]
        return dark

    def _exposed(
        self, rates: SameShape, curves: ChannelCurves, curves_gradient: CurvesGradient
    ) -> Float[Array, "elements rows moments signals"]:
        """Return electrons from electrons/s, both with derivatives in further rows."""
        rates *= self.scene.exposure_s(curves[None])
        relative = relative_slope(self.setup, self.scene.white, curves, curves_gradient)
        rates[:, 1:] += relative[:, None, None] * rates[:, :1]
        return rates

    def per_qe(
        self, modified: int, curves: ChannelCurves, *, lamps_only: bool = False
    ) -> Float[Array, "cases signals pixels wavelengths"]:
        """Return the response per unit of QE of one modified channel at every wavelength, DN.

        The smooth response is linear in it if the channel does not set the exposure.
        """
        parts = []
        for view in self.scene.own_views:
            light, uniform = self._weights(view, modified)
            of_channels = view.image.folded(light), view.image.folded(uniform) * (not lamps_only)
            parts.append(self._per_qe(view, modified, curves, *of_channels))
        return np.concatenate(parts) * self.pixel.dn_per_e

    def spread_per_qe(self, modified: int, curves: ChannelCurves) -> Float[Array, "cases signals wavelengths"]:
        """Return electrons per unit of QE of one modified channel in its pixels, weighted by shares of variance."""
        own, parts = [self.setup.camera.modified[modified]], []
        for view in self._by_pixel:
            light, uniform = (view.image.spread(weights)[:, own] for weights in self._weights(view, modified))
            parts.append(self._per_qe(view, modified, curves, light, uniform)[:, :, 0])
        return np.concatenate(parts)

    def _weights(
        self, view: View, modified: int
    ) -> tuple[Float[Array, "elements functions"], Float[Array, "elements 1"]]:
        """Return the light of elements behind the filter of a modified channel, of an image and of a uniform field."""
        image, crosstalk, own = view.image, self._exposure.crosstalk, [self.setup.camera.modified[modified]]
        every = np.eye(1 if image.shares is None else len(image.shares))
        return image.lit(every[None], own, crosstalk), image.uniform(np.ones((1, 1)), own, crosstalk)

    def _per_qe(
        self,
        view: View,
        modified: int,
        curves: ChannelCurves,
        light: Float[Array, "rows channels functions"],
        uniform: Float[Array, "rows channels 1"],
    ) -> Float[Array, "cases signals channels wavelengths"]:
        """Return electrons per unit of QE of one modified channel, from light and uniform weights of the channels."""
        position, channel, shares = view.position, self.setup.camera.modified[modified], view.image.shares
        exposure_s = self.scene.exposure_s(curves[None])
        scales = self.scene.scales(exposure_s)[0, 0]
        whole = light if shares is None else light @ shares
        lit = position.per_qe(whole[:, None] * position.signals[:, None], channel)
        background = uniform[:, None, None] * position.per_qe(position.background, channel)
        total = lit[:, None] * scales[:, None, None, None] + background
        return np.asarray(total.reshape(-1, *total.shape[2:]) * exposure_s[0], dtype=float)


@lru_cache(maxsize=16)
def linear_model(setup: Setup) -> LinearModel:
    """Return the linear model of a setup; recent ones are kept."""
    return LinearModel(setup)
