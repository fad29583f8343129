"""Camera: pixel, mosaic and the QE of each channel."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ..base.types import Array, ChannelCurves, Float, PerWavelength
from ..designs.technology import Technology, index_of
from ..spectra.spectrum import WavelengthGrid
from .curve_errors import UncertainCurves
from .mosaic import Mosaic
from .pixel import Pixel


@dataclass(frozen=True)
class Camera:
    """Camera that a batch of designs shares; its lens is part of the scene, since a study sets it by scene.

    `grid`: wavelengths of all curves, nm; `qe`: QE of the mosaic's channels, electrons per photon; rows of `modified`
    hold the base curve; `modified`: channels whose curve a design replaces, one per curve of the family; `clear_qe`: QE
    of the clear pixel, the reference of the CFA sensitivity; `technologies`: physical principle of each channel's
    filter, None if it is not stated; empty if none is stated; `uncertain`: the curves where they are not known exactly.
    """

    grid: WavelengthGrid
    mosaic: Mosaic
    qe: Float[Array, "channels wavelengths"]
    modified: tuple[int, ...]
    clear_qe: PerWavelength
    pixel: Pixel
    technologies: tuple[Technology | None, ...] = field(default=(), kw_only=True)
    uncertain: UncertainCurves | None = field(default=None, kw_only=True)

    @property
    def base_qe(self) -> ChannelCurves:
        """Curves that the modified channels replace."""
        return self.qe[list(self.modified)]

    @cached_property
    def fixed(self) -> tuple[int, ...]:
        """Channels that no design modifies."""
        return tuple(i for i in range(len(self.mosaic.channels)) if i not in self.modified)

    def effective_index(self, channel: int) -> float:
        """Return the effective index of a channel's filter.

        Infinite for a filter that does not move with the angle of the light.
        """
        return index_of(self.technologies[channel]) if self.technologies else math.inf

    @cached_property
    def moving(self) -> tuple[int, ...]:
        """Channels whose filter moves with the angle of the light."""
        return tuple(c for c in range(len(self.mosaic.channels)) if math.isfinite(self.effective_index(c)))

    def base_transmission(self, channel: int) -> PerWavelength:
        """Return the base transmission of a channel, which is the same at every angle.

        Returns its base curve, or the clear pixel's for an unmodified channel.
        """
        return self.qe[channel] if channel in self.modified else self.clear_qe

    @property
    def area_bins_m2_nm(self) -> PerWavelength:
        """Light-sensitive area times width of each bin, m2 nm: electrons/s per unit of irradiance times QE."""
        return self.grid.bins_nm * self.pixel.area_m2

    @property
    def longest_distance_dn(self) -> float:
        """Upper bound on the distance of two unclipped responses within the range of the ADC, DN."""
        top_dn = max(self.pixel.full_scale_dn, self.pixel.saturation_e * self.pixel.dn_per_e)
        return float(2 * top_dn * np.sqrt(len(self.mosaic.channels)))
