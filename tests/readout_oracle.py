"""A pixel's digital number by brute force: every number of electrons, every step of the ADC, gains by quadrature."""

from __future__ import annotations

import math

import numpy as np
from scipy.special import ndtr
from scipy.stats import poisson

from sweep.camera.image import Pixels
from sweep.camera.model import SceneModel
from sweep.camera.pixel import Pixel
from sweep.camera.readout import light_of_elements


def digital_numbers(electrons: float, pixel: Pixel) -> tuple[np.ndarray, np.ndarray]:
    """The numbers that occur and how often, for a pixel without PRNU: ndarray[n], ndarray[n]."""
    root = math.sqrt(electrons)
    counts = np.arange(max(0, int(electrons - 14 * root - 9)), int(electrons + 14 * root + 120))
    weights = poisson.pmf(counts, electrons)
    dn = np.minimum(counts, pixel.well_e) * pixel.dn_per_e + pixel.offset_dn
    sigma, top = pixel.read_noise_e * pixel.dn_per_e, pixel.full_scale_dn
    reach = 15 * sigma + 2
    first, last = np.clip([math.floor(dn.min() - reach), math.ceil(dn.max() + reach)], 0, top).astype(int)
    numbers = np.arange(first, last + 1)
    found = np.zeros(numbers.size)
    if sigma == 0:
        np.add.at(found, np.clip(np.floor(dn + 0.5), 0, top).astype(int) - first, weights)
        return numbers, found
    kept = weights > 1e-30
    weights, dn = weights[kept, None], dn[kept, None]
    near = np.round(dn).astype(int) + np.arange(-math.ceil(11 * sigma) - 1, math.ceil(11 * sigma) + 2)
    ends = (np.hstack([near, near[:, -1:] + 1]) - 0.5 - dn) / sigma
    tail = ndtr(-np.abs(ends))  # beyond each end, on the side where it keeps its digits
    apart = np.abs(np.diff(tail, axis=1))
    across = (ends[:, :-1] <= 0) & (ends[:, 1:] > 0)
    shares = np.where(across, 1 - tail[:, :-1] - tail[:, 1:], apart)
    found += np.bincount((np.clip(near, 0, top) - first).ravel(), (weights * shares).ravel(), numbers.size)
    return numbers, found


def pixels_of(model: SceneModel, curves: np.ndarray, place: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """One design's pixels at a sampling phase, [exposures, moments, signals, pixels], their weights, and their light."""
    view = model.own_views[0]
    per_place = model.scales(model.exposure_s(curves)).shape[-1]
    electrons = (
        model.at([view])
        .pixel_electrons(curves)[:, 0]
        .reshape(len(model.exposures), -1, per_place, *(len(model.setup.lights.names), view.image.channel.size))
    )
    if isinstance(view.image, Pixels):
        entries = slice(view.image.bounds[place], view.image.bounds[place + 1])
        used, weight = view.image.element[entries], view.image.weight[entries]
    else:
        used = np.concatenate(view.image.pixels_of_channels())
        weight = 1 / np.repeat(view.image.counts, view.image.counts)
    of_channel = view.image.channel[used][:, None] == np.arange(view.image.n_channels)
    return (
        electrons[:, 0][..., used],
        of_channel * weight[:, None],
        light_of_elements(model.exposures, view.image.channel)[:, used],
    )


def moments(electrons: float, pixel: Pixel) -> tuple[float, float]:
    """Mean, DN, and variance, DN^2; with PRNU over gains that are half a Poisson deviation apart or less."""
    fine = max(40, math.ceil(36 * pixel.prnu * math.sqrt(electrons)))
    gains = np.linspace(-9, 9, fine + 1) if pixel.prnu else np.zeros(1)
    shares = np.exp(-(gains**2) / 2)
    shares /= shares.sum()
    means, squares = [], []
    center = round(min(electrons, pixel.well_e) * pixel.dn_per_e + pixel.offset_dn)  # digits are kept beside it
    for gain in gains:
        numbers, often = digital_numbers(electrons * (1 + pixel.prnu * gain), pixel)
        often = often / often.sum()
        means.append(often @ (numbers - center))
        squares.append(often @ (numbers - center) ** 2)
    mean = shares @ means
    return float(center + mean), float(shares @ squares - mean**2)
