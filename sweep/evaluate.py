"""Pure evaluation: a block of designs in a scene -> response, color separation distances, sensitivities."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .arrays import FloatArray, IndexArray
from .datasets.lights import Lights
from .metrics import cfa_sensitivity, channel_sensitivity, class_pairs, csd_name, separations
from .mosaics import Mosaic
from .scenes import Scenario, WhitePatchExposure
from .sensor import Pixel, digital_numbers, electron_rate, irradiance_factor, unquantized
from .spectra import WavelengthGrid

DESIGNED = ("sensitivity", "cfa_sensitivity", "slope_per_nm", "min_transmission")
"""Quantities of a design that do not depend on the lights."""
WORST = "worst_"
"""Prefix of a quantity that is the smallest over the shifts of the edges in production."""


def quantities(lights: Lights) -> tuple[str, ...]:
    """Names of the columns that `evaluate` gives."""
    distances = (csd_name(pair) for pair in class_pairs(lights.classes))
    return (*distances, *DESIGNED, "exposure_s")


def shiftable(lights: Lights) -> tuple[str, ...]:
    """Quantities whose worst case over an edge shift is known: all CSDs and both sensitivities."""
    distances = (csd_name(pair) for pair in class_pairs(lights.classes))
    return (*distances, "sensitivity", "cfa_sensitivity")


@dataclass(frozen=True)
class Setup:
    """All that a block of designs shares.

    `qe`: ndarray[n_channels, n_wavelengths] of the mosaic's channels, electrons per photon; the rows of `modified`
    (channel indices, one per curve that a family makes) hold the base curve. `clear_qe`: the reference of the CFA's
    sensitivity, ndarray[n_wavelengths].
    """

    grid: WavelengthGrid
    mosaic: Mosaic
    qe: FloatArray
    modified: tuple[int, ...]
    clear_qe: FloatArray
    lights: Lights
    pixel: Pixel
    scenario: Scenario

    @property
    def base_qe(self) -> FloatArray:
        """Curves that the modified channels replace, ndarray[n_modified, n_wavelengths]."""
        return self.qe[list(self.modified)]

    @property
    def longest_distance_dn(self) -> float:
        """No two points of the unclipped response that fit into the range are further apart; DN."""
        return float(2 * self.pixel.full_scale_dn * np.sqrt(len(self.mosaic.channels)))

    @property
    def members(self) -> dict[str, IndexArray]:
        """Signal type -> indices of its signals."""
        return self.lights.members


def all_channels(setup: Setup, curves: FloatArray) -> FloatArray:
    """Put the modified channels among the fixed ones.

    `curves`: ndarray[n_designs, n_modified, n_wavelengths]. Returns ndarray[n_designs, n_channels, n_wavelengths].
    """
    qe = np.repeat(setup.qe[None], len(curves), axis=0)
    qe[:, list(setup.modified)] = curves
    return qe


def _patches(setup: Setup) -> tuple[FloatArray, FloatArray]:
    """Photon irradiance of the signals, ndarray[n_signals, n_wavelengths], and of the white patch, ndarray[1, ...]."""
    scenario, grid = setup.scenario, setup.grid
    factor = irradiance_factor(scenario.optics)
    signals = setup.lights.photons * (scenario.photon_radiance * factor)
    ratio = setup.lights.photon_ratio
    if isinstance(scenario.exposure, WhitePatchExposure) and scenario.exposure.photon_ratio is not None:
        ratio = scenario.exposure.photon_ratio
    white = np.full((1, grid.size), scenario.photon_radiance * factor / (ratio * grid.size * grid.step_nm))
    return signals, white


def electrons(setup: Setup, qe: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Electrons before the full well, ndarray[n_designs, n_signals, n_channels], and exposure, s, ndarray[n_designs].

    `qe`: ndarray[n_designs, n_channels, n_wavelengths]. A white-patch exposure is set per design, so that its
    brightest channel on the white patch reaches the level of full scale.
    """
    signals, white = _patches(setup)
    rate = electron_rate(signals, qe, setup.grid.step_nm, setup.pixel)
    exposure = setup.scenario.exposure
    if isinstance(exposure, WhitePatchExposure):
        brightest = electron_rate(white, qe, setup.grid.step_nm, setup.pixel).max(axis=(1, 2))
        full_e = exposure.level * setup.pixel.full_scale_dn / setup.pixel.dn_per_e
        exposure_s = np.divide(full_e, brightest, out=np.full(len(qe), np.inf), where=brightest > 0)
    else:
        exposure_s = np.full(len(qe), exposure.exposure_s)
    return rate * exposure_s[:, None, None], exposure_s


def smooth_response(setup: Setup, curves: FloatArray) -> FloatArray:
    """Unquantized, unclipped response, DN: ndarray[n_designs, n_signals, n_channels]; `curves` as in `all_channels`."""
    return unquantized(electrons(setup, all_channels(setup, curves))[0], setup.pixel)


def response_gradient(setup: Setup, curves: FloatArray, curves_gradient: FloatArray) -> FloatArray:
    """Exact derivative of `smooth_response` at one design, with that of the exposure.

    `curves`: ndarray[n_modified, n_wavelengths]; `curves_gradient`: ndarray[n_parameters, n_modified, n_wavelengths].
    Returns DN per unit of parameter, ndarray[n_parameters, n_signals, n_channels].
    """
    signals, white = _patches(setup)
    step_nm, pixel = setup.grid.step_nm, setup.pixel
    qe = all_channels(setup, curves[None])[0]
    slope = np.zeros((len(curves_gradient), *qe.shape))
    slope[:, list(setup.modified)] = curves_gradient
    raw, exposure_s = electrons(setup, qe[None])
    by_parameter = electron_rate(signals, slope, step_nm, pixel) * exposure_s[0]
    if isinstance(setup.scenario.exposure, WhitePatchExposure):
        white_rate = electron_rate(white, qe, step_nm, pixel)[0]
        top = int(np.argmax(white_rate))
        relative = electron_rate(white, slope, step_nm, pixel)[:, 0, top] / white_rate[top]
        by_parameter = by_parameter - relative[:, None, None] * raw
    return np.asarray(by_parameter * pixel.dn_per_e, dtype=float)


def designed_quantities(setup: Setup, curves: FloatArray) -> dict[str, FloatArray]:
    """What a design gives without any light, each ndarray[n_designs]; `curves` as in `all_channels`.

    `sensitivity`: total QE of the modified channels over that of the curves they replace; of several modified channels
    it is that of their sum. `cfa_sensitivity`: see `metrics.cfa_sensitivity`. `slope_per_nm`: the steepest slope of a
    modified channel's QE. `min_transmission`: the smallest ratio of a modified channel to the curve it replaces.
    Without a modified channel all but `cfa_sensitivity` are NaN.
    """
    none = np.full(len(curves), np.nan)
    qe = all_channels(setup, curves)
    found = dict.fromkeys(DESIGNED, none)
    found["cfa_sensitivity"] = cfa_sensitivity(qe, setup.mosaic.counts, setup.clear_qe)
    if setup.modified:
        found["sensitivity"] = channel_sensitivity(curves.sum(axis=1), setup.base_qe.sum(axis=0))
        found["slope_per_nm"] = np.abs(np.diff(curves, axis=-1)).max(axis=(1, 2)) / setup.grid.step_nm
        ratio = np.divide(curves, setup.base_qe, out=np.ones_like(curves), where=setup.base_qe > 0)
        found["min_transmission"] = ratio.min(axis=(1, 2))
    return found


def sensitivities_gradient(setup: Setup, curves_gradient: FloatArray) -> dict[str, FloatArray]:
    """Exact derivatives of `sensitivity` and `cfa_sensitivity`, ndarray[n_parameters]; see `response_gradient`."""
    total = curves_gradient.sum(axis=-1)
    counts = setup.mosaic.counts
    return {
        "sensitivity": total.sum(axis=1) / setup.base_qe.sum(),
        "cfa_sensitivity": total @ counts[list(setup.modified)] / (counts.sum() * setup.clear_qe.sum()),
    }


def readout(setup: Setup, curves: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Digital numbers as read out, ndarray[n_designs, n_signals, n_channels], and exposure, s, ndarray[n_designs].

    `curves` as in `all_channels`.
    """
    raw, exposure_s = electrons(setup, all_channels(setup, curves))
    return digital_numbers(raw, setup.pixel), exposure_s


def evaluate(setup: Setup, curves: FloatArray) -> dict[str, FloatArray]:
    """Evaluate a block of designs as the camera reads them out (clipped and quantized).

    `curves` as in `all_channels`. Returns columns, each ndarray[n_designs]: `csd_<a>_<b>` (DN) of every pair of
    signal types, those of `designed_quantities` and `exposure_s`.
    """
    response, exposure_s = readout(setup, curves)
    distances = separations(response, setup.members)
    columns = {csd_name(pair): values for pair, values in distances.items()}
    return columns | designed_quantities(setup, curves) | {"exposure_s": exposure_s}
