"""A camera: its pixels, the mosaic of their filters, and what each channel's quantum efficiency is."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from ..base.types import FloatArray
from ..curves.spectrum import WavelengthGrid
from ..designs.technology import Technology, index_of
from .mosaic import Mosaic
from .pixel import Pixel


@dataclass(frozen=True)
class Camera:
    """Camera that a block of designs shares; its lens is part of the scene, since a study sets it by scene.

    Attributes
    ----------
    grid : WavelengthGrid
        Wavelengths of all curves, nm.
    mosaic : Mosaic
        The CFA.
    qe : ndarray[n_channels, n_wavelengths]
        Quantum efficiency of the mosaic's channels, electrons per photon; the rows of `modified` hold the base curve.
    modified : tuple of int
        Channels whose curve a design replaces, one per curve that a family makes.
    clear_qe : ndarray[n_wavelengths]
        The reference of the CFA's sensitivity.
    pixel : Pixel
        Pitch, full well, noise, ADC.
    technologies : tuple
        By what each channel's filter works, None where that is not stated; empty where it is of none.
    """

    grid: WavelengthGrid
    mosaic: Mosaic
    qe: FloatArray
    modified: tuple[int, ...]
    clear_qe: FloatArray
    pixel: Pixel
    technologies: tuple[Technology | None, ...] = field(default=(), kw_only=True)

    @property
    def base_qe(self) -> FloatArray:
        """Curves that the modified channels replace, ndarray[n_modified, n_wavelengths]."""
        return self.qe[list(self.modified)]

    @property
    def fixed(self) -> tuple[int, ...]:
        """Channels that no design modifies."""
        return tuple(i for i in range(len(self.mosaic.channels)) if i not in self.modified)

    def effective_index(self, channel: int) -> float:
        """Effective index of a channel's filter; infinite for one that does not move with the angle of the light."""
        return index_of(self.technologies[channel]) if self.technologies else math.inf

    @property
    def moving(self) -> tuple[int, ...]:
        """Channels whose filter moves with the angle of the light."""
        return tuple(c for c in range(len(self.mosaic.channels)) if math.isfinite(self.effective_index(c)))

    def base_transmission(self, channel: int) -> FloatArray:
        """Curve of a channel under its filter, the same at every angle: its base, or if plain the clear pixel's."""
        return self.qe[channel] if channel in self.modified else self.clear_qe

    @property
    def area_step_m2_nm(self) -> float:
        """Light-sensitive area times the step of the grid: electrons/s of a sum of irradiance times QE."""
        return self.grid.step_nm * self.pixel.area_m2

    @property
    def longest_distance_dn(self) -> float:
        """No two points of the unclipped response that fit into the range are further apart; DN."""
        return float(2 * self.pixel.full_scale_dn * np.sqrt(len(self.mosaic.channels)))
