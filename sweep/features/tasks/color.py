"""Color of a CFA: noise-optimal color matrices, and figures that follow from them.

Arrays may be complex, with a derivative as imaginary part; see `colorimetry`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...base.types import Array, ChannelCurves, Float
from ...camera.pixel import irradiance_factor
from ...camera.setup import Setup
from ...metrics.complex_step import Smooth, moving
from .colorimetry import delta_e, lab, lab_slope

PIXELS = 4.0
"""ChannelNoise is that of so many pixels, shared among the channels as in the tile: of a tile of 2 x 2, all of it."""
_SMI_STEPS = 40
_DAMPING = 1e-12
_LEAST = 1e-12


@dataclass(frozen=True)
class ChannelNoise:
    """Photon and read noise of four pixels of a CFA: variances of the channels' means, electrons^2.

    `shares`: share of the tile's pixels.
    """

    shares: Float[Array, " channels"]
    read_noise_e: float

    def of(self, electrons: Smooth) -> Smooth:
        """Return the variances of the channels.

        Returns variance, electrons^2.
        """
        return self.photons(electrons) + self.read

    def photons(self, electrons: Smooth) -> Smooth:
        """Return the part of photon noise.

        Returns variance, electrons^2.
        """
        return np.asarray(electrons / (PIXELS * self.shares))

    @property
    def read(self) -> Float[Array, " patches"]:
        """Part of read noise."""
        return np.asarray(self.read_noise_e**2 / (PIXELS * self.shares), dtype=float)


@dataclass(frozen=True)
class PatchCamera:
    """Designs before patches that fill the field, on axis, in clear air."""

    setup: Setup
    modified: Smooth

    @classmethod
    def along(cls, setup: Setup, curves: ChannelCurves, by_u: Float[Array, "free modified wavelengths"]) -> PatchCamera:
        """Return one design once per free parameter, with its derivative by that parameter."""
        return cls(setup, moving(curves, by_u))

    def electrons(self, photons: Float[Array, "... wavelengths"], exposure_s: float) -> Smooth:
        """Return expected electrons of a pixel of each channel.

        `photons`: radiance, photons/s/sr/m2/nm.
        """
        setup = self.setup
        photons = photons * (irradiance_factor(setup.scene.optics) * exposure_s * setup.camera.area_bins_m2_nm)
        shape = (len(self.modified), *photons.shape[:-1], len(setup.camera.qe))
        electrons = np.empty(shape, dtype=self.modified.dtype)
        electrons[...] = photons @ setup.camera.qe.T
        flat = photons.reshape(-1, photons.shape[-1])
        for at, channel in enumerate(setup.camera.modified):
            electrons[..., channel] = (self.modified[:, at] @ flat.T).reshape(shape[:-1])
        return electrons

    @property
    def qe(self) -> Smooth:
        """Return the QE of all channels."""
        qe = np.empty((len(self.modified), *self.setup.camera.qe.shape), dtype=self.modified.dtype)
        qe[:] = self.setup.camera.qe
        qe[:, list(self.setup.camera.modified)] = self.modified
        return qe

    def noise(self, read_noise_e: float) -> ChannelNoise:
        """Return the noise of four pixels of the CFA."""
        counts = self.setup.camera.mosaic.counts
        return ChannelNoise(np.asarray(counts / counts.sum(), dtype=float), read_noise_e)


def color_matrix(
    electrons: Smooth,
    xyz: Float[Array, "patches 3"],
    white: Float[Array, " 3"],
    noise: ChannelNoise,
    regularization: float = 1.0,
) -> Smooth:
    """Return the matrix from electrons to XYZ relative to white with the least expected error.

    It minimizes the expected sum over the patches of weight times |M (n + noise) - XYZ / white|^2. A weight is the
    squared change of a patch's CIE lightness with its luminance.

    `electrons`: expected electrons of each patch; `regularization`: factor of the noise: 1 is the noise-optimal matrix.
    """
    weights = (116 / 3 * np.maximum(xyz[:, 1], _LEAST) ** (-2 / 3)) ** 2
    left = np.einsum("npc,p,npd->ncd", electrons, weights, electrons)
    variance = np.einsum("npc,p->nc", noise.of(electrons), weights)
    left = left + regularization * variance[..., None] * np.eye(electrons.shape[-1])
    right = np.einsum("npc,p,pk->nck", electrons, weights, xyz / white)
    return np.linalg.solve(left, right)


def luminance_noise(matrix: Smooth, gray: Smooth, noise: ChannelNoise) -> Smooth:
    """Return the luminance SNR of gray after the matrix.

    `gray`: expected electrons of gray.
    """
    row = matrix[:, :, 1]
    return np.asarray((row * gray).sum(axis=1) / (row**2 * noise.of(gray)).sum(axis=1) ** 0.5)


def least_illuminance(matrix: Smooth, gray: Smooth, noise: ChannelNoise, ratio: float) -> Smooth:
    """Return the illuminance at which the luminance SNR reaches a ratio, lx.

    With the luminance a E and its variance b E + c, the root of ratio^2 (b E + c) = (a E)^2.

    `gray`: electrons of gray per lx.
    """
    row = matrix[:, :, 1]
    a = (row * gray).sum(axis=1)
    b = (row**2 * noise.photons(gray)).sum(axis=1) * ratio**2
    c = (row**2 * noise.read).sum(axis=1) * ratio**2
    return np.asarray((b + (b**2 + 4 * a**2 * c) ** 0.5) / (2 * a**2))


def vora(responses: Smooth, matching: Float[Array, "3 wavelengths"]) -> Smooth:
    """Return the Vora value: share of the space of color-matching functions that the responses span.

    trace(P_V P_M) / 3 of the projections onto both spaces (Vora and Trussell, 1993).

    `responses`: responses per radiant power. Returns 0 to 1.
    """
    basis = np.linalg.qr(matching.T)[0]
    scaled = responses / np.sqrt((responses.real**2).sum(axis=-1, keepdims=True) + _LEAST)
    gram = np.einsum("ncl,ndl->ncd", scaled, scaled) + _DAMPING * np.eye(responses.shape[1])
    cross = scaled @ basis
    return np.asarray(np.einsum("nck,nck->n", cross, np.linalg.solve(gram, cross)) / basis.shape[1])


def metamerism_index(electrons: Smooth, xyz: Float[Array, "patches 3"], white: Float[Array, " 3"]) -> Smooth:
    """Return the sensitivity metamerism index of ISO 17321-1: 100 - 5.5 times the mean CIELAB distance of the patches.

    The matrix has the least mean, found by Gauss-Newton steps weighted by the inverse distances. 100 is a camera with
    the eye's color space; noise is left out.

    `electrons`: expected electrons of each patch.
    """
    target = lab(xyz / white, np.ones(3))
    scale = electrons.real.mean(axis=(1, 2), keepdims=True)
    response = electrons / scale
    free = ChannelNoise(np.full(electrons.shape[-1], 1.0), 0.0)
    matrix = color_matrix(response, xyz, white, free, _DAMPING)
    for _ in range(_SMI_STEPS):
        matrix = matrix + _step(response, matrix, target)
    return np.asarray(100 - 5.5 * delta_e(lab(response @ matrix, np.ones(3)), target).mean(axis=-1))


def _step(response: Smooth, matrix: Smooth, target: Float[Array, "rows 3"]) -> Smooth:
    """Return the matrix after a Gauss-Newton step toward the least sum of distances."""
    n, patches, channels = response.shape
    ratio = response @ matrix
    colors = lab(ratio, np.ones(3))
    left = colors - target
    weights = 1 / (delta_e(colors, target) + _LEAST)
    jacobian = (response[:, :, None, :, None] * lab_slope(ratio)[:, :, :, None, :]).reshape(n, patches, 3, channels * 3)
    normal = np.einsum("npki,np,npkj->nij", jacobian, weights, jacobian)
    trace = np.einsum("nii->n", normal.real)[:, None, None] / normal.shape[-1]
    normal = normal + _DAMPING * trace * np.eye(normal.shape[-1])
    right = np.einsum("npki,np,npk->ni", jacobian, weights, left)
    return -np.linalg.solve(normal, right[..., None])[..., 0].reshape(n, channels, 3)
