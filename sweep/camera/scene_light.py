"""What a scene gives before any kernel: its light as the filters see it, and how long designs are exposed to it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from ..base.types import FloatArray
from .effects import flicker, quadrature
from .exposure import exposure_times, fixed_white, white_irradiance
from .field import over_field
from .seen import SeenFilters
from .view import View, per_photon, signal_irradiance


class SceneLight:
    """The light of a scene. `work` counts the values that are computed, by effect.

    `signals`, `white`: electrons/s for each QE of light and the white patch at every wavelength, ndarray[n_signals,
    n_wavelengths] and ndarray[n_wavelengths]; `fixed_white`: of the brightest channel that no design modifies.
    `places`: a view of each place of the field; `seen`: the filters as the rays see them there. `nodes`: wavelengths at
    which QE is looked at, by number; `between_nodes`: how it is known from these, None where they are all.
    """

    def __init__(self, view: View, work: Counter[str]) -> None:
        self.view, self._work = view, work
        self.nodes = quadrature.nodes(view.grid.size, view.methods.quadrature)
        at_all = self.nodes.size == view.grid.size
        self.between_nodes = None if at_all else quadrature.between_nodes(view.grid.size, self.nodes)
        self.signals = signal_irradiance(view) * per_photon(view)
        self.white = white_irradiance(view) * per_photon(view)
        self.fixed_white = fixed_white(view)
        self.places = over_field(view)
        self.seen = [SeenFilters(place, view.methods.angle) for place in self.places]

    def looked_at(self, qe: FloatArray, channels: Sequence[int], place: int = 0) -> FloatArray:
        """QE of some channels as the quadrature sees it (itself, or linear between its nodes), and then the rays."""
        nodal = qe if self.between_nodes is None else qe[..., self.nodes] @ self.between_nodes
        return self.seen[place].curves(nodal, channels)

    def exposure_s(self, curves: FloatArray) -> FloatArray:
        """Exposure of each design, s, ndarray[n_designs]; `curves`: ndarray[n_designs, n_modified, n_wavelengths]."""
        return exposure_times(self.view, curves @ self.white, self.fixed_white)

    def scales(self, exposure_s: FloatArray) -> FloatArray:
        """Light relative to its mean in the cases of a pulsed light, ndarray[n_designs, n_scales]."""
        found = flicker.scales(self.view, self.view.methods.flicker, exposure_s)
        if found.shape[1] > 1:
            self._work["flicker"] += found.size
        return found

    def light_dn(self, curves: FloatArray, exposure_s: float) -> FloatArray:
        """What each signal gives through each channel's filter where its image is whole, in a pulse's darkest moment.

        `curves`: of one design, ndarray[n_modified, n_wavelengths]. DN, ndarray[n_signals, n_channels, n_wavelengths].
        """
        qe = self.view.qe.copy()
        qe[list(self.view.modified)] = curves
        scale = self.scales(np.array([exposure_s]))[0].min() * exposure_s * self.view.pixel.dn_per_e
        return np.asarray(self.signals[:, None] * self.looked_at(qe, range(len(qe))) * scale, dtype=float)
