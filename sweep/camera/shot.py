"""A shot: a camera with one CFA before a scene, whatever the way in which it is simulated."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..curves.lights import Lights
from ..curves.spectrum import WavelengthGrid
from ..types import FloatArray, IndexArray
from .mosaic import Mosaic
from .pixel import Pixel
from .scene import Scene


@dataclass(frozen=True)
class Shot:
    """What a block of designs shares.

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
    scenario: Scene

    @property
    def base_qe(self) -> FloatArray:
        """Curves that the modified channels replace, ndarray[n_modified, n_wavelengths]."""
        return self.qe[list(self.modified)]

    @property
    def fixed(self) -> tuple[int, ...]:
        """Channels that no design modifies."""
        return tuple(i for i in range(len(self.mosaic.channels)) if i not in self.modified)

    @property
    def longest_distance_dn(self) -> float:
        """No two points of the unclipped response that fit into the range are further apart; DN."""
        return float(2 * self.pixel.full_scale_dn * np.sqrt(len(self.mosaic.channels)))

    @property
    def members(self) -> dict[str, IndexArray]:
        """Signal type -> indices of its signals."""
        return self.lights.members
