"""What designs see of any light: their QE, with derivatives where a search asks for them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...base.types import FloatArray
from ...camera.pixel import irradiance_factor
from ...camera.setup import Setup
from .color import ChannelNoise
from .colorimetry import Smooth

COMPLEX_STEP = 1e-30
"""Of a derivative by complex steps: nothing is subtracted, so it may be so small that its square vanishes."""


@dataclass(frozen=True)
class Looks:
    """Designs before patches that fill the field, on axis, in clear air.

    `modified`: QE of the modified channels, ndarray[n, n_modified, n_wavelengths], complex where it has a derivative.
    """

    setup: Setup
    modified: Smooth

    @classmethod
    def along(cls, setup: Setup, curves: FloatArray, by_u: FloatArray) -> Looks:
        """One design, once for each free parameter, with its derivative by that; see `SmoothDesign`.

        `curves`: ndarray[n_modified, n_wavelengths]; `by_u`: ndarray[n_free, n_modified, n_wavelengths].
        """
        return cls(setup, curves + 1j * COMPLEX_STEP * by_u)

    def electrons(self, photons: FloatArray, exposure_s: float) -> Smooth:
        """Expected electrons of a pixel of each channel, ndarray[n, ..., n_channels].

        `photons`: radiance, photons/s/sr/m^2/nm, ndarray[..., n_wavelengths].
        """
        setup = self.setup
        factor = irradiance_factor(setup.scene.optics) * setup.camera.area_step_m2_nm * exposure_s
        shape = (len(self.modified), *photons.shape[:-1], len(setup.camera.qe))
        found = np.empty(shape, dtype=self.modified.dtype)
        found[...] = photons @ setup.camera.qe.T * factor
        flat = photons.reshape(-1, photons.shape[-1])
        for at, channel in enumerate(setup.camera.modified):
            found[..., channel] = (self.modified[:, at] @ flat.T).reshape(shape[:-1]) * factor
        return found

    @property
    def qe(self) -> Smooth:
        """QE of all channels, ndarray[n, n_channels, n_wavelengths]."""
        found = np.empty((len(self.modified), *self.setup.camera.qe.shape), dtype=self.modified.dtype)
        found[:] = self.setup.camera.qe
        found[:, list(self.setup.camera.modified)] = self.modified
        return found

    def noise(self, read_noise_e: float) -> ChannelNoise:
        """Of four pixels of the CFA."""
        counts = self.setup.camera.mosaic.counts
        return ChannelNoise(np.asarray(counts / counts.sum(), dtype=float), read_noise_e)
