"""Readouts drawn by chance, photon by photon: an oracle of moments and errors."""

from __future__ import annotations

import numpy as np

from sweep.camera.noise.merge import coded, exposure_of, merged_readings
from sweep.camera.noise.rounding import rounded
from sweep.camera.pixel import Pixel


def draws_dn(electrons: np.ndarray, pixel: Pixel, rng: np.random.Generator) -> np.ndarray:
    """One readout of each pixel, DN, with its own gain error, of expected electrons."""
    gain = 1 + pixel.prnu * rng.standard_normal(electrons.shape)
    held = np.minimum(rng.poisson(np.maximum(gain * electrons, 0.0)), pixel.well_e)
    dn = (held + pixel.read_noise_e * rng.standard_normal(electrons.shape)) * pixel.dn_per_e + pixel.offset_dn
    return np.clip(np.floor(dn + 0.5), 0, pixel.full_scale_dn)


def merged_draws(electrons: np.ndarray, light: np.ndarray, pixel: Pixel, rng: np.random.Generator) -> np.ndarray:
    """One merged value of each pixel, DN of the first capture, of the expected electrons of each exposure."""
    gain = 1 + pixel.prnu * rng.standard_normal(electrons.shape[1:])
    held = rng.poisson(np.maximum(electrons * gain, 0.0))
    read = []
    for at, capture in zip(exposure_of(pixel), pixel.read_as, strict=True):
        noisy_e = np.minimum(held[at], capture.well_e) + capture.read_noise_e * rng.standard_normal(gain.shape)
        read.append(rounded(noisy_e * capture.dn_per_e, capture))
    return coded(merged_readings(read, electrons, light, pixel), pixel)
