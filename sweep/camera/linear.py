"""Linear response of a scene and variance of its noise, with derivatives, for the search.

Nothing is clipped or rounded. The noise is that of a pixel far from both ends of its range, whose steps of rounding
are dithered: gain^2 (n + (PRNU n)^2 + read noise^2) + 1/12 for n expected electrons (EMVA 1288).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from functools import cached_property, lru_cache

import numpy as np

from ..base.types import Array, ChannelCurves, CurvesGradient, DesignCases, DesignCurves, Float, FloatArray
from .brightness import LampReadings, LampSlopes, room_dn
from .exposure import relative_slope
from .memory import blocks
from .model import SceneModel, View, too_many
from .noise.law import STEPS_DN2, groups_of, pixel_law
from .pixel import unquantized
from .readout import Readout
from .response import SplitLight
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
        self._views = [*self.scene.views()]

    @cached_property
    def _by_pixel(self) -> list[View]:
        """Views of single pixels; raises SweepError if they do not fit into memory."""
        if self.scene.phases is not None and len([*blocks(self.setup, self.scene.phases)]) > 1:
            raise too_many(self.scene, "too many pixels for a search under noise")
        return [*self.scene.views(by_pixel=True)]

    def smooth(self, curves: DesignCurves) -> DesignCases:
        """Return the unquantized, unclipped response, DN."""
        expected = self._expected(self._views, curves)
        parts = zip(self._views, expected, strict=True)
        return _joined(view.readout.folded(unquantized(e, self.pixel)) for view, e in parts)

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
        values, slopes = [], []
        for view in self._views:
            electrons, by_u = self._with_slope(view, curves, curves_gradient, lamps_only=lamps_only)
            values.append(view.readout.folded(electrons[None] * gain + offset)[0])
            slopes.append(view.readout.folded(by_u * gain))
        return np.concatenate(values), np.concatenate(slopes, axis=1)

    def noisy_with_gradient(
        self, curves: ChannelCurves, curves_gradient: CurvesGradient
    ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return mean, DN, and variance, DN^2, of one design under noise, and their derivatives.

        The mean is `smooth`; of an HDR pixel it is that of its merged values, DN of the first capture, which saturate.
        """
        parts = []
        for view in self._by_pixel:
            electrons, by_u = self._with_slope(view, curves, curves_gradient)
            mean, variance, mean_per_e, variance_per_e = self._moments(view, electrons)
            folded, spread = view.readout.folded, view.readout.spread
            values = folded(mean[None])[0], spread(variance[None])[0]
            parts.append((*values, folded(mean_per_e * by_u), spread(variance_per_e * by_u)))
        mean, variance, mean_by_u, variance_by_u = zip(*parts, strict=True)
        slopes = np.concatenate(mean_by_u, axis=1), np.concatenate(variance_by_u, axis=1)
        return np.concatenate(mean), np.concatenate(variance), *slopes

    def variance(self, curves: DesignCurves) -> DesignCases:
        """Return the variance of the noise, DN^2."""
        none = np.empty((0, *curves.shape[1:]))
        return np.stack([self.noisy_with_gradient(design, none)[1] for design in curves])

    def _moments(self, view: View, electrons: FloatArray) -> Float[Array, "4 cases signals pixels"]:
        """Return mean and variance of pixels, and their derivatives by the electrons."""
        moments, pixel = np.empty((4, *electrons.shape)), self.pixel
        if self.hdr is None:
            variance_e2 = electrons + (pixel.prnu * electrons) ** 2 + pixel.read_noise_e**2
            moments[0], moments[1] = unquantized(electrons, pixel), pixel.dn_per_e**2 * variance_e2 + STEPS_DN2
            moments[2], moments[3] = pixel.dn_per_e, pixel.dn_per_e**2 * (1 + 2 * pixel.prnu**2 * electrons)
            return moments
        for of_exposures, which in groups_of(self._read(view).capture_light):
            moments[..., which] = pixel_law(self.hdr, (of_exposures,), noisy=True).at(0, electrons[..., which])
        moments[3] = np.where(moments[1] > STEPS_DN2, moments[3], 0.0)
        moments[1] = np.maximum(moments[1], STEPS_DN2)
        return moments

    def _read(self, view: View) -> Readout:
        """Return the readout of a view by the pixel itself."""
        pixel = self.pixel if self.hdr is None else self.hdr
        return Readout.of(self.setup.with_camera(pixel=pixel), view.electrons.response)

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
            readout = self._read(view)
            electrons, slope = self._with_slope(view, curves, curves_gradient)
            lit, lit_by_u = self._with_slope(view, curves, curves_gradient, lamps_only=True)
            light = readout.capture_light if readout.pixel.captures else np.ones((1, electrons.shape[-1]))
            dark, dark_by_u = electrons[:, 0] - lit[:, 0], slope[:, :, 0] - lit_by_u[:, :, 0]
            moments = len(electrons) // readout.n_cases
            for case in range(len(electrons)):
                here = readout.subset(slice(case // moments, case // moments + 1))
                lamps = LampReadings(lit[case] * light[:, None], dark[case] * light, light, here, noisy, lit.shape[-1])
                result.append(LampSlopes(lamps, lit_by_u[:, case], dark_by_u[:, case]))
        return result

    def spread_electrons(self, curves: DesignCurves) -> DesignCases:
        """Return expected electrons of the pixels, weighted by their shares of a channel's variance."""
        expected = self._expected(self._by_pixel, curves)
        return _joined(view.readout.spread(e) for view, e in zip(self._by_pixel, expected, strict=True))

    def spread_shares(self) -> Float[Array, "cases channels"]:
        """Return the sum of the pixels' shares of a channel's variance."""
        base = self.setup.camera.base_qe[None]
        repeats = self.scene.scales(self.scene.exposure_s(base)).shape[1]
        shares = np.concatenate([view.electrons.response.spread.sum(axis=1) for view in self._by_pixel])
        return np.repeat(shares, repeats, axis=0)

    def _expected(self, views: list[View], curves: DesignCurves) -> list[DesignCases]:
        """Return expected electrons in each view."""
        exposure_s = self.scene.exposure_s(curves)
        scales = self.scene.scales(exposure_s)
        return [view.electrons.expected(curves, scales, exposure_s) for view in views]

    def _with_slope(
        self, view: View, curves: ChannelCurves, curves_gradient: CurvesGradient, *, lamps_only: bool = False
    ) -> Slopes:
        """Return expected electrons and their derivative."""
        electrons, design = view.electrons, curves[None]
        exposure_s = self.scene.exposure_s(design)
        scales = self.scene.scales(exposure_s)
        expected = electrons.expected(design, scales, exposure_s)[0]
        if lamps_only:
            expected = expected - np.repeat(electrons.unlit(design)[0], scales.shape[1], axis=0)[:, None] * exposure_s
        rates = (electrons.rates(curves_gradient) - electrons.fixed)[:, :, None] * scales[0][:, None, None]
        if not lamps_only:
            rates = rates + electrons.of_background(curves_gradient)[:, :, None, None]
        slope = rates.reshape(len(curves_gradient), *expected.shape) * exposure_s
        relative = relative_slope(self.setup, self.scene.white, curves, curves_gradient)
        return expected, np.asarray(slope + relative[:, None, None, None] * expected, dtype=float)

    def per_qe(
        self, modified: int, curves: ChannelCurves, *, lamps_only: bool = False
    ) -> Float[Array, "cases signals pixels wavelengths"]:
        """Return the response per unit of QE of one modified channel at every wavelength, DN.

        The smooth response is linear in it if the channel does not set the exposure.
        """
        channel, parts = self.setup.camera.modified[modified], []
        for view in self._views:
            response = view.electrons.response
            uniform = response.uniform[:, :, channel] * (not lamps_only)
            parts.append(self._per_qe(view, modified, curves, response.light[:, :, channel], uniform))
        return np.concatenate(parts) * self.pixel.dn_per_e

    def spread_per_qe(self, modified: int, curves: ChannelCurves) -> Float[Array, "cases signals wavelengths"]:
        """Return electrons per unit of QE of one modified channel in its pixels, weighted by shares of variance."""
        channel, parts = self.setup.camera.modified[modified], []
        for view in self._by_pixel:
            response = view.electrons.response
            share, source = response.spread[:, :, channel], response.source
            if isinstance(source, SplitLight):
                light = source.folded(share, channel)
            else:
                light = np.einsum("xu,xuw->xw", share, source[:, :, channel])
            uniform = (share * response.uniform[:, :, channel]).sum(axis=1, keepdims=True)
            parts.append(self._per_qe(view, modified, curves, light[:, None], uniform)[:, :, 0])
        return np.concatenate(parts)

    def _per_qe(
        self,
        view: View,
        modified: int,
        curves: ChannelCurves,
        light: Float[Array, "_ channels _wavelengths"],
        uniform: Float[Array, "rows channels"],
    ) -> Float[Array, "_cases _signals channels wavelengths"]:
        """Return electrons per unit of QE of one modified channel, from light and uniform weights of its elements."""
        position, channel = view.electrons.position, self.setup.camera.modified[modified]
        exposure_s = self.scene.exposure_s(curves[None])
        scales = self.scene.scales(exposure_s)[0]
        signal_light = light[:, None, None] * position.signals[:, None, :]
        signal_light = position.angular.light(signal_light[..., None, :], [channel])[..., 0, :]
        background = uniform[:, None, None, :, None] * position.background[modified]
        total = signal_light * scales[None, :, None, None, None] + background
        return np.asarray(total.reshape(-1, *total.shape[2:]) * exposure_s[0], dtype=float)


def _joined(parts: Iterable[DesignCases]) -> DesignCases:
    return np.concatenate([*parts], axis=1)


@lru_cache(maxsize=16)
def linear_model(setup: Setup) -> LinearModel:
    """Return the linear model of a setup; recent ones are kept."""
    return LinearModel(setup)
