"""Effects of the camera: when each is active, and a closed-form bound on the change of any CSD without it.

A CSD is a distance of two points with a coordinate for each channel, or, by pixel, for each of four pixels. If leaving
an effect out moves each coordinate of their difference by at most d, the distance changes by at most d times the root
of their number.

Bounds hold for every design of a box, in DN. Readings of all lights that move by between m and M move their
differences by at most M - m, of all in the same sense by at most M. A readout that clips moves no more than its input,
in the same sense. One that rounds without noise may move by a whole step more for each pixel; with Gaussian read noise
sigma (DN) the mean of the rounded value is steeper by at most 1 + 2 sum over k of exp(-2 (pi k sigma)^2).

Light of all signals times one factor takes that factor of every distance, if the readout is linear: then a gray loss
changes no CSD by more than its share of it, and a CSD is no more than the distance of any two lights of its types.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..base.types import Array, ChannelCurves, Float
from . import pwm
from .angular import AngularResponse, known_at
from .exposure import exposure_times, white_irradiance
from .irradiance import air_transmittance, background_irradiance, relative_illumination, signal_irradiance
from .noise import gaussian, tails
from .setup import READOUT, Setup

_STEEPEST_TERMS = 50


@dataclass(frozen=True)
class Box:
    """Designs of a scene, with bounds on the QE of each channel."""

    setup: Setup
    low: Float[Array, "channels wavelengths"]
    high: Float[Array, "channels wavelengths"]

    @cached_property
    def _exposures_s(self) -> tuple[float, float]:
        """Shortest and longest exposure time, s."""
        setup = self.setup
        white = white_irradiance(setup) * setup.camera.area_bins_m2_nm
        modified = list(setup.camera.modified)
        ends = [exposure_times(setup, (qe[modified] @ white)[None])[0] for qe in (self.high, self.low)]
        return float(ends[0]), float(ends[1])

    @cached_property
    def light_range(self) -> tuple[float, float]:
        """Least and most light of any exposure, relative to its mean."""
        drive = self.setup.scene.drive
        if drive is None:
            return 1.0, 1.0
        return pwm.smallest(drive, *self._exposures_s), pwm.largest(drive, *self._exposures_s)

    @cached_property
    def _sharp(self) -> Setup:
        return replace(self.setup, left_out=self.setup.left_out | {"veiling glare"})

    @cached_property
    def signals(self) -> Float[Array, "signals wavelengths"]:
        """Photon irradiance of each signal without glare, photons/s/m2/nm: the most that it may be."""
        return signal_irradiance(self._sharp)

    @cached_property
    def backgrounds(self) -> Float[Array, "two wavelengths"]:
        """Photon irradiance of the background with and without glare, photons/s/m2/nm."""
        return np.stack([background_irradiance(self.setup), background_irradiance(self._sharp)])

    @cached_property
    def _highest(self) -> ChannelCurves:
        """Upper bound on the curves in the cone of rays.

        The transmission of an interference filter is nowhere above its maximum.
        """
        highest = self.high.copy()
        for channel in self.setup.camera.moving:
            base_transmission = self.setup.camera.base_transmission(channel)
            known = known_at(base_transmission)
            highest[channel] = base_transmission * (self.high[channel, known] / base_transmission[known]).max()
        return highest

    @cached_property
    def brightest_signal_dn(self) -> float:
        """Largest unclipped response of any channel to a signal whose image is whole, without pedestal, DN."""
        return self.most_dn(self.signals)

    @cached_property
    def brightest_pixel_dn(self) -> float:
        """`brightest_signal_dn` with background and dark current, DN."""
        setup, time_s = self.setup, self._exposures_s[1]
        camera = setup.camera
        background = (self._highest @ (self.backgrounds.max(axis=0) * camera.area_bins_m2_nm)).max()
        return self.brightest_signal_dn + float(background + camera.pixel.dark_e_per_s) * time_s * camera.pixel.dn_per_e

    @property
    def _sqrt_channels(self) -> float:
        """Root of the number of coordinates of a CSD: its channels, or four pixels."""
        return math.sqrt(max(len(self.setup.camera.mosaic.channels), 4))

    @cached_property
    def _dn(self) -> Float[Array, " wavelengths"]:
        """Most DN of photons/s/m2/nm on a QE of 1 in each bin of the grid."""
        camera = self.setup.camera
        most_s = self._exposures_s[1] * self.light_range[1]
        return np.asarray(camera.area_bins_m2_nm * (most_s * camera.pixel.dn_per_e), dtype=float)

    def most_dn(self, light: Float[Array, "lights wavelengths"]) -> float:
        """Largest reading of any channel of some light, DN."""
        return float((light * self._dn @ self._highest.T).max(initial=0.0))

    @cached_property
    def largest_csd_dn(self) -> float:
        """Bound on every CSD: the distance of the first two lights of its types, DN."""
        members, light = self.setup.lights.members, self.signals * self._dn
        first = np.stack([light[numbers[0]] for numbers in members.values()])
        differences = first[:, None] - first[None]
        most = np.maximum(differences, 0.0) @ self._highest.T  # of a and b, and exchanged: of either sign
        return float(np.maximum(most, most.swapaxes(0, 1)).max()) * self._sqrt_channels


def any_filter(setup: Setup) -> Box:
    """Return the box of all filters in the modified channels, up to the largest QE of the sensor, at least 1."""
    low, high = setup.camera.qe.copy(), setup.camera.qe.copy()
    low[list(setup.camera.modified)] = 0.0
    high[list(setup.camera.modified)] = max(1.0, float(setup.camera.qe.max()))
    return Box(setup, low, high)


@dataclass(frozen=True)
class Effect:
    """One effect.

    `inactive`: from a box to the reason why the effect changes nothing in it; None if it may; `bound_dn`: from a box
    and the effects of the readout that are computed to the bound, DN. Left out, no closed form is known, and an active
    effect is computed.
    """

    name: str
    inactive: Callable[[Box], str | None]
    bound_dn: Callable[[Box, frozenset[str]], float] | None = None


def _read_dn(box: Box, moved_dn: float, readout: frozenset[str]) -> float:
    """Return the bound for differences of readings that move by an amount before they are rounded."""
    result = moved_dn * box._sqrt_channels
    if "quantization" not in readout:
        return result
    if box.setup.scene.noise is None:
        return result + 2 * box._sqrt_channels * (moved_dn > 0)
    return result * _steepness(box.setup.camera.pixel.dn_per_e * box.setup.camera.pixel.read_noise_e)


def _dimmed_dn(box: Box, kept: Float[Array, " #wavelengths"], readout: frozenset[str], added_dn: float = 0.0) -> float:
    """Return the bound for signals that are dimmed by a factor of each wavelength.

    `added_dn`: what is added to all pixels alike, of either sign; it counts where the readout is not linear.
    """
    lost = box.signals * (1 - kept)
    if readout & READOUT:
        return _read_dn(box, box.most_dn(lost) + added_dn, readout)
    gray = float(1 - kept.max())
    colored = (kept.max() - kept) * box.signals
    of_factor = gray * box.largest_csd_dn + box.most_dn(colored) * box._sqrt_channels
    return min(_read_dn(box, box.most_dn(lost), readout), of_factor)


def _steepness(sigma_dn: float) -> float:
    """Return the largest slope of the mean rounded value under read noise."""
    k = np.arange(1, _STEEPEST_TERMS)
    terms = np.exp(-2 * (math.pi * k * sigma_dn) ** 2)
    return math.inf if terms[-1] > 1e-17 else 1 + 2 * float(terms.sum())


def _no_noise(box: Box) -> str | None:
    return "no noise asked for" if box.setup.scene.noise is None else None


def _noise_bound_dn(box: Box, _: frozenset[str]) -> float:
    """Return the bound on the shift of the mean of noisy readouts by the full well and the ends of the ADC.

    The dark end adds most in the dark. The loss at the others grows with the signal up to the first of them, and falls
    beyond it, where the readout of the mean is constant.
    """
    pixel = box.setup.camera.pixel
    gain, read_e = pixel.dn_per_e, pixel.read_noise_e
    at_e, end_e = min(box.brightest_pixel_dn / gain, pixel.saturation_e), (pixel.full_scale_dn - pixel.offset_dn) / gain
    lost_e = tails.mean_above(pixel.well_e, at_e, pixel, 0.0) + tails.mean_above(end_e, at_e, pixel, read_e)
    sigma = gain * read_e
    added_dn = sigma * float(gaussian.ramp(np.array(-pixel.offset_dn / sigma))) if sigma else 0.0
    return (2 * added_dn + gain * lost_e) * box._sqrt_channels


def _rounding_bound_dn(box: Box, _: frozenset[str]) -> float:
    """Return the bound for a step of rounding, which read noise dithers.

    The k-th harmonic of the mean rounding error is 1 / (pi k) exp(-2 (pi k sigma)^2) for any number of electrons. At
    the end of the ADC's range at most half a DN is missing in the readouts beyond.
    """
    pixel = box.setup.camera.pixel
    sigma = pixel.dn_per_e * pixel.read_noise_e
    if box.setup.scene.noise is None or sigma == 0:
        return box._sqrt_channels
    first = math.exp(-2 * (math.pi * sigma) ** 2)
    below = float(gaussian.share_below(np.array(-pixel.offset_dn / sigma)))
    above_e = (pixel.full_scale_dn - pixel.offset_dn) / pixel.dn_per_e
    beyond = below + tails.share_above(above_e, box.brightest_pixel_dn / pixel.dn_per_e, pixel, pixel.read_noise_e)
    return min(1.0, 2 * (first / (math.pi * (1 - first)) + beyond / 2)) * box._sqrt_channels


def _not_saturated(box: Box) -> str | None:
    pixel = box.setup.camera.pixel
    if (
        pixel.captures
        or box.setup.scene.noise is not None
        or box.brightest_pixel_dn / pixel.dn_per_e > pixel.saturation_e
    ):
        return None
    return f"the brightest signal has at most {box.brightest_signal_dn:.0f} DN"


def _saturation_bound_dn(box: Box, _: frozenset[str]) -> float:
    pixel = box.setup.camera.pixel
    excess_e = max(0.0, box.brightest_pixel_dn / pixel.dn_per_e - pixel.saturation_e)
    return excess_e * pixel.dn_per_e * box._sqrt_channels


def _without_target(box: Box) -> str | None:
    return "a patch that fills the field" if box.setup.scene.target is None else None


def _not_moving(box: Box) -> str | None:
    if box.setup.camera.moving:
        return None
    stated = any(technology is not None for technology in box.setup.camera.technologies)
    return "pigments do not move with the angle" if stated else "no technology is stated: filters as on axis"


def _one_phase(box: Box) -> str | None:
    return _without_target(box) or (None if box.setup.all_phases else "the scene names the sampling phase")


def _one_field_position(box: Box) -> str | None:
    field = box.setup.scene.field
    if field is None:
        return "one field position"
    return None if box.setup.positions_differ else "all field positions have the same light"


def _averaged(box: Box) -> str | None:
    target = box.setup.scene.target
    averaged = target is not None and target.readout == "mean"
    return _without_target(box) or ("the raw pixels are averaged" if averaged else None)


def _unpulsed(box: Box) -> str | None:
    drive = box.setup.scene.drive
    return "direct current" if drive is None or drive.duty == 1 else None


def _pwm_bound_dn(box: Box, readout: frozenset[str]) -> float:
    least, most = box.light_range
    share = max(1 - least, most - 1) / most
    return _read_dn(box, 2 * share * box.brightest_pixel_dn, readout)


def _air_bound_dn(box: Box, readout: frozenset[str]) -> float:
    return _dimmed_dn(box, air_transmittance(box.setup.scene, box.setup.camera.grid.nodes_nm), readout)


def _illumination_bound_dn(box: Box, readout: frozenset[str]) -> float:
    kept = relative_illumination(box.setup.scene)
    return _dimmed_dn(box, np.array([kept]), readout, box.most_dn(box.backgrounds * (1 - kept)))


def _glare_bound_dn(box: Box, readout: frozenset[str]) -> float:
    glare = box.setup.scene.veiling_glare
    assert glare is not None
    added = np.abs(box.backgrounds[:1] - box.backgrounds[1:])
    return _dimmed_dn(box, np.array([1 - glare.share]), readout, box.most_dn(added))


def _crosstalk_bound_dn(box: Box, readout: frozenset[str]) -> float:
    """Return the bound for light that pixels exchange; in a uniform field neighbors of one kind change nothing."""
    mosaic, share = box.setup.camera.mosaic, box.setup.camera.pixel.crosstalk
    if box.setup.scene.target is None:
        at = mosaic.indices
        others = np.mean([np.roll(at, step, axis) != at for axis in (0, 1) for step in (-1, 1)], axis=0)
        share *= max(float(others[at == channel].mean()) for channel in range(len(mosaic.channels)))
    return _read_dn(box, 2 * share * box.brightest_pixel_dn, readout)


def _angle_bound_dn(box: Box, readout: frozenset[str]) -> float:
    """Return the bound for filters that move, of a patch at one place: as if the light moved the other way."""
    setup = box.setup
    if setup.scene.target is not None or setup.scene.field is not None:
        return math.inf
    # A background moves all readings alike, which cancels in differences of a linear readout alone.
    common = box.backgrounds if readout & READOUT else np.zeros((1, box.signals.shape[1]))
    light = (box.signals[:, None] + common).reshape(-1, box.signals.shape[1]) * box._dn
    matrices = AngularResponse(setup.with_all_effects).matrices
    moved = [0.0]
    for channel, matrix in matrices.items():
        change = (matrix.T @ light.T).T - light
        most, least = (
            np.maximum(sign * change, 0) @ box.high[channel] - np.maximum(-sign * change, 0) @ box.low[channel]
            for sign in (1, -1)
        )
        moved.append(max(float(most.max()), 0.0) + max(float(least.max()), 0.0))
    return _read_dn(box, max(moved), readout)


EFFECTS: dict[str, Effect] = {
    effect.name: effect
    for effect in (
        Effect("noise", _no_noise, _noise_bound_dn),
        Effect("quantization", lambda _: None, _rounding_bound_dn),
        Effect("saturation", _not_saturated, _saturation_bound_dn),
        Effect("pedestal", lambda box: None if box.setup.camera.pixel.offset_dn else "no pedestal"),
        Effect("sampling", _without_target),
        Effect("phase", _one_phase),
        Effect("demosaic", _averaged),
        Effect("blur", _without_target),
        Effect(
            "crosstalk",
            lambda box: None if box.setup.camera.pixel.crosstalk else "no crosstalk",
            _crosstalk_bound_dn,
        ),
        Effect("angle", _not_moving, _angle_bound_dn),
        Effect(
            "illumination",
            lambda box: None if box.setup.scene.off_axis_deg else "on axis",
            _illumination_bound_dn,
        ),
        Effect("field", _one_field_position),
        Effect(
            "extinction",
            lambda box: "clear air" if box.setup.scene.visibility_m is None else None,
            _air_bound_dn,
        ),
        Effect(
            "veiling glare",
            lambda box: "no veiling glare" if box.setup.scene.veiling_glare is None else None,
            _glare_bound_dn,
        ),
        Effect("flicker", _unpulsed, _pwm_bound_dn),
    )
}
"""Each effect by its name: those of the readout first, which determine the bounds of the others."""
