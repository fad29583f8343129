"""Colors after a matrix: how error and noise trade as it trusts noisy channels more or less; areas of a picture."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...base.types import FloatArray
from ...curves.tasks import Chart, Conditions
from .color import ChannelNoise, color_matrix, luminance_noise
from .judge import color_errors
from .looks import Looks

REGULARIZATIONS = np.geomspace(1e-3, 1e4, 29)
"""How much the noise counts in the matrix; 1 is the noise-optimal one."""


class ErrorAndNoise(NamedTuple):
    """Mean CIEDE2000 of the chart, and luminance SNR of 18 % gray, for each regularization, ndarray[n] each."""

    delta_e: FloatArray
    snr: FloatArray


class AreaColors(NamedTuple):
    """Colors of areas of a picture over its white: XYZ, ndarray[n_areas, 3], and covariances, ndarray[n_areas, 3, 3].

    The noise is that of four pixels.
    """

    xyz: FloatArray
    covariance: FloatArray


def traded(looks: Looks, chart: Chart, case: int, conditions: Conditions) -> ErrorAndNoise:
    """Color error against noise of one design under one light of a chart."""
    noise = looks.noise(conditions.read_noise_e)
    patches = _seen(looks, chart.photons[case], conditions)
    gray = _seen(looks, chart.gray[case], conditions)
    found = []
    for regularization in REGULARIZATIONS:
        matrix = color_matrix(patches, chart.xyz[case], chart.white[case], noise, float(regularization))
        errors = color_errors(patches, matrix, chart, case)
        found.append((float(errors.mean()), float(luminance_noise(matrix, gray, noise)[0])))
    delta_e, snr = np.array(found).T
    return ErrorAndNoise(delta_e, snr)


def rendered_areas(looks: Looks, chart: Chart, case: int, photons: FloatArray, conditions: Conditions) -> AreaColors:
    """Areas through the noise-optimal matrix for a chart under a light; `photons`: ndarray[n_areas, n_wavelengths]."""
    noise = looks.noise(conditions.read_noise_e)
    patches = _seen(looks, chart.photons[case], conditions)
    matrix = color_matrix(patches, chart.xyz[case], chart.white[case], noise)[0]
    electrons = looks.electrons(photons, conditions.exposure_s)[0]
    return AreaColors(electrons @ matrix, _covariance(matrix, electrons, noise))


def _seen(looks: Looks, photons: FloatArray, conditions: Conditions) -> FloatArray:
    return looks.electrons(photons * conditions.illuminance_lx, conditions.exposure_s)


def _covariance(matrix: FloatArray, electrons: FloatArray, noise: ChannelNoise) -> FloatArray:
    return np.asarray(np.einsum("ck,ac,cj->akj", matrix, noise.of(electrons), matrix), dtype=float)
