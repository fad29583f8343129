"""What filters change that rays see in another way: not by how much their curves change, but what the light does.

At any one wavelength a band that moves may change by all of itself. But the light that it sees is smooth, and moves by
little; see `seen` for why the one may be moved instead of the other.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...base.types import FloatArray
from ..effects.base import FilterChange
from ..seen import known_at
from ..view import background_irradiance, per_photon
from .bounds import Amounts, Box, Reach


def _middle(box: Box) -> tuple[FloatArray, FloatArray]:
    """Middle and half width, ndarray[n_channels, n_wavelengths] each."""
    return (box.low + box.high) / 2, (box.high - box.low) / 2


def amounts_of_filters(reach: Reach, factor: FloatArray, change: FilterChange) -> Amounts:
    """`Reach.amounts` of what the filters of a box change, behind a factor per wavelength."""
    (middle, half), light = _middle(reach.box), reach.signals_dn * factor
    first, second = reach.first, reach.second
    shape = (len(middle), len(reach.hats))
    centers, each = np.zeros((len(light), *shape)), np.zeros((len(light), *shape))
    halves, most = np.zeros((len(first), *shape)), np.zeros(middle.shape)
    for channel, matrix in change.matrices.items():
        most[channel] = np.abs(matrix @ middle[channel]) + abs(matrix) @ half[channel]
        of_light = matrix.T
        for knot, hat in enumerate(reach.hats):
            moved = (of_light @ (light * hat).T).T
            centers[:, channel, knot] = moved @ middle[channel]
            each[:, channel, knot] = np.abs(moved) @ half[channel]
            halves[:, channel, knot] = np.abs(moved[first] - moved[second]) @ half[channel]
    apart = np.abs(light[first] - light[second])
    largest = np.abs(centers[first] - centers[second]) + halves
    return Amounts(centers, halves, each, largest, apart @ most.T, np.abs(light) @ most.T)


def background_of_filters(reach: Reach, factor: FloatArray, change: FilterChange) -> tuple[FloatArray, FloatArray]:
    """By how much the response to a background behind a factor changes with the filters; see `Reach.background`."""
    (middle, half), view = _middle(reach.box), reach.box.view
    dn = per_photon(view) * reach.longest_s * view.pixel.dn_per_e
    irradiance, found = background_irradiance(view) * factor * dn, np.zeros((2, len(middle)))
    for channel, matrix in change.matrices.items():
        moved = matrix.T @ irradiance
        found[:, channel] = moved @ middle[channel], np.abs(moved) @ half[channel]
    return found[0], found[1]


def at_any_height(box: Box) -> Box:
    """The box with curves that no ray sees a filter of it exceed, at any place of the sensor.

    What an interference filter lets through of its carrier is nowhere more than where it lets most through.
    """
    high, view = box.high.copy(), box.view
    for channel in range(len(high)):
        if np.isfinite(view.effective_index(channel)):
            carrier = view.carrier(channel)
            known = known_at(carrier)
            high[channel] = carrier * (high[channel, known] / carrier[known]).max()
    return replace(box, high=high)
