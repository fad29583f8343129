"""What a scene gives before any pixel: its light as the filters see it, and the exposure of each design."""

from __future__ import annotations

from ..base.types import FloatArray
from . import pwm
from .angular import AngularResponse
from .exposure import exposure_times, fixed_white, white_irradiance
from .field import over_field
from .irradiance import signal_irradiance
from .view import View, per_photon


class SceneLight:
    """The light of a scene.

    `signals`, `white`: electrons/s for each QE of light and the white patch at every wavelength, ndarray[n_signals,
    n_wavelengths] and ndarray[n_wavelengths]; `fixed_white`: of the brightest channel that no design modifies.
    `positions`: a view of each field position; `angular`: the filters as the rays see them there.
    """

    def __init__(self, view: View) -> None:
        self.view = view
        self.signals = signal_irradiance(view) * per_photon(view)
        self.white = white_irradiance(view) * per_photon(view)
        self.fixed_white = fixed_white(view)
        self.positions = over_field(view)
        self.angular = [AngularResponse(position) for position in self.positions]

    def exposure_s(self, curves: FloatArray) -> FloatArray:
        """Exposure of each design, s, ndarray[n_designs]; `curves`: ndarray[n_designs, n_modified, n_wavelengths]."""
        return exposure_times(self.view, curves @ self.white, self.fixed_white)

    def scales(self, exposure_s: FloatArray) -> FloatArray:
        """Light relative to its mean at the moments of a pulsed light, ndarray[n_designs, n_moments]."""
        return pwm.scales(self.view, exposure_s)
