"""What a CFA's colors are worth: color matrices that weigh noise, and the figures that follow from them.

`electrons`: expected electrons of each patch in a pixel of each channel, ndarray[n, n_patches, n_channels]; `noise`:
see `ChannelNoise`. All of it may be complex, see `colorimetry`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...base.types import FloatArray
from ...camera.pixel import irradiance_factor
from ...camera.setup import Setup
from .colorimetry import COMPLEX_STEP, Smooth, delta_e, lab, lab_slope

PIXELS = 4.0
"""ChannelNoise is that of so many pixels, shared among the channels as in the tile: of a tile of 2 x 2, all of it."""
_SMI_STEPS = 40
_DAMPING = 1e-12
_LEAST = 1e-12


@dataclass(frozen=True)
class ChannelNoise:
    """Photon and read noise of what four pixels of a CFA see: variances of the channels' means, in electrons^2.

    `shares`: of the tile's pixels, ndarray[n_channels].
    """

    shares: FloatArray
    read_noise_e: float

    def of(self, electrons: Smooth) -> Smooth:
        """Variances of ndarray[..., n_channels]."""
        return self.photons(electrons) + self.read

    def photons(self, electrons: Smooth) -> Smooth:
        """The photons' part."""
        return np.asarray(electrons / (PIXELS * self.shares))

    @property
    def read(self) -> FloatArray:
        """The part of read noise, ndarray[n_channels]."""
        return np.asarray(self.read_noise_e**2 / (PIXELS * self.shares), dtype=float)


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


def color_matrix(
    electrons: Smooth, xyz: FloatArray, white: FloatArray, noise: ChannelNoise, regularization: float = 1.0
) -> Smooth:
    """The matrix from electrons to XYZ over its white that errs least, ndarray[n, n_channels, 3].

    It minimizes the expected sum, over the patches, of weights times |M (n + noise) - XYZ / white|^2. A weight is the
    square of how much a patch's CIE lightness changes with its luminance. The noise's part counts `regularization`
    times: 1 is the noise-optimal matrix, less trusts noisy channels more. `xyz`: ndarray[n_patches, 3], `white`:
    ndarray[3].
    """
    weights = (116 / 3 * np.maximum(xyz[:, 1], _LEAST) ** (-2 / 3)) ** 2
    left = np.einsum("npc,p,npd->ncd", electrons, weights, electrons)
    variance = np.einsum("npc,p->nc", noise.of(electrons), weights)
    left = left + regularization * variance[..., None] * np.eye(electrons.shape[-1])
    right = np.einsum("npc,p,pk->nck", electrons, weights, xyz / white)
    return np.linalg.solve(left, right)


def luminance_noise(matrix: Smooth, gray: Smooth, noise: ChannelNoise) -> Smooth:
    """Luminance of gray over its standard deviation after the matrix, ndarray[n]; `gray`: ndarray[n, n_channels]."""
    row = matrix[:, :, 1]
    return np.asarray((row * gray).sum(axis=1) / (row**2 * noise.of(gray)).sum(axis=1) ** 0.5)


def least_illuminance(matrix: Smooth, gray: Smooth, noise: ChannelNoise, ratio: float) -> Smooth:
    """Illuminance at which luminance over noise reaches `ratio`, lx, ndarray[n]; `gray`: electrons for each lx.

    With the luminance a E and its variance b E + c this is the root of ratio^2 (b E + c) = (a E)^2.
    """
    row = matrix[:, :, 1]
    a = (row * gray).sum(axis=1)
    b = (row**2 * noise.photons(gray)).sum(axis=1) * ratio**2
    c = (row**2 * noise.read).sum(axis=1) * ratio**2
    return np.asarray((b + (b**2 + 4 * a**2 * c) ** 0.5) / (2 * a**2))


def vora(responses: Smooth, matching: FloatArray) -> Smooth:
    """Vora value: how much of the color-matching functions' space a camera's responses span, 0..1, ndarray[n].

    trace(P_V P_M) / 3 of the projections onto both spaces (Vora and Trussell, 1993). `responses`: per radiant power,
    ndarray[n, n_channels, n_wavelengths]; `matching`: ndarray[3, n_wavelengths].
    """
    basis = np.linalg.qr(matching.T)[0]
    scaled = responses / np.sqrt((responses.real**2).sum(axis=-1, keepdims=True) + _LEAST)
    own = np.einsum("ncl,ndl->ncd", scaled, scaled) + _DAMPING * np.eye(responses.shape[1])
    cross = scaled @ basis
    return np.asarray(np.einsum("nck,nck->n", cross, np.linalg.solve(own, cross)) / basis.shape[1])


def metamerism_index(electrons: Smooth, xyz: FloatArray, white: FloatArray) -> Smooth:
    """Sensitivity metamerism index, ISO 17321-1: 100 - 5.5 times the mean CIELAB distance of the patches, ndarray[n].

    The matrix is the one with the least mean, found by Gauss-Newton steps on it, weighted by the inverse distances.
    100 is a camera with the eye's own color space; noise is left out.
    """
    target = lab(xyz / white, np.ones(3))
    scale = electrons.real.mean(axis=(1, 2), keepdims=True)
    seen = electrons / scale
    free = ChannelNoise(np.full(electrons.shape[-1], 1.0), 0.0)
    matrix = color_matrix(seen, xyz, white, free, _DAMPING)
    for _ in range(_SMI_STEPS):
        matrix = matrix + _step(seen, matrix, target)
    return np.asarray(100 - 5.5 * delta_e(lab(seen @ matrix, np.ones(3)), target).mean(axis=-1))


def _step(seen: Smooth, matrix: Smooth, target: FloatArray) -> Smooth:
    """A Gauss-Newton step of the matrix toward the least sum of distances, ndarray[n, n_channels, 3]."""
    n, patches, channels = seen.shape
    ratio = seen @ matrix
    colors = lab(ratio, np.ones(3))
    left = colors - target
    weights = 1 / (delta_e(colors, target) + _LEAST)
    jacobian = (seen[:, :, None, :, None] * lab_slope(ratio)[:, :, :, None, :]).reshape(n, patches, 3, channels * 3)
    normal = np.einsum("npki,np,npkj->nij", jacobian, weights, jacobian)
    trace = np.einsum("nii->n", normal.real)[:, None, None] / normal.shape[-1]
    normal = normal + _DAMPING * trace * np.eye(normal.shape[-1])
    right = np.einsum("npki,np,npk->ni", jacobian, weights, left)
    return -np.linalg.solve(normal, right[..., None])[..., 0].reshape(n, channels, 3)
