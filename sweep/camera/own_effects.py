"""An effect of a user's own, or one that an installed package offers: a function of the irradiance on the sensor."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..base.errors import Fault, SweepError
from ..base.own_code import OwnCode, own_name
from ..base.types import FloatArray


@dataclass(frozen=True)
class Irradiance:
    """Photon irradiance on the sensor, on axis, before air and relative illumination dim it; photons/s/m^2/nm.

    Attributes
    ----------
    wavelength_nm : ndarray[n_wavelengths]
        Equidistant, ascending.
    signals : ndarray[n_signals, n_wavelengths]
        Each signal's where its image is whole.
    background : ndarray[n_wavelengths]
        Uniform over the field.
    """

    wavelength_nm: FloatArray
    signals: FloatArray
    background: FloatArray


@dataclass(frozen=True)
class OwnEffect:
    """A function of an `Irradiance` and its `Scene` that returns an `Irradiance`.

    It is always computed, since it has no bound. It must not depend on anything else, so that a study gives the same
    rows again.
    """

    code: OwnCode

    @property
    def name(self) -> str:
        """Its name in plans and provenance."""
        return own_name(self.code.name)

    def applied(self, irradiance: Irradiance, scene: object) -> tuple[FloatArray, FloatArray]:
        """Irradiance of signals and background behind the effect, in the shapes of those before it.

        Raises SweepError for what is raised, and for what is no irradiance: another shape, negative or not finite.
        """
        result = self.code.called(self.code.loaded, irradiance, scene)
        behind = []
        for part in ("signals", "background"):
            before = getattr(irradiance, part)
            values = self.code.called(np.asarray, self.code.called(getattr, result, part), float)
            if values.shape != before.shape:
                problem = f"{self.code.name} gives another shape of `{part}`"
                raise SweepError(Fault(problem, value=values.shape, allowed=f"{before.shape}"))
            wrong = values[~(np.isfinite(values) & (values >= 0))]
            if wrong.size:
                problem = f"{self.code.name} gives no irradiance in `{part}`"
                raise SweepError(Fault(problem, value=float(wrong[0]), allowed="finite numbers, 0 or more"))
            behind.append(values)
        return behind[0], behind[1]
