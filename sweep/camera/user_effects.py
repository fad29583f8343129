"""Effects of user code or of an installed package: functions of the irradiance on the sensor."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..base.errors import SweepError, ValidationIssue
from ..base.types import Array, Float, FloatArray, PerWavelength
from ..base.user_code import UserCode, name_in_file


@dataclass(frozen=True)
class Irradiance:
    """Photon irradiance on the sensor, on axis, before air and relative illumination dim it, photons/s/m2/nm.

    Parameters
    ----------
    wavelength_nm : ndarray of shape (n_wavelengths,)
        Equidistant, ascending.
    signals : ndarray of shape (n_signals, n_wavelengths)
        Irradiance of each signal where its image is whole.
    background : ndarray of shape (n_wavelengths,)
        Uniform over the field.
    """

    wavelength_nm: FloatArray
    signals: FloatArray
    background: FloatArray


@dataclass(frozen=True)
class UserEffect:
    """Function of an `Irradiance` and its `Scene` that returns an `Irradiance`.

    It is always computed, since it has no bound, and must depend on nothing else.
    """

    code: UserCode

    @property
    def name(self) -> str:
        """Name in plans and provenance."""
        return name_in_file(self.code.name)

    def applied(self, irradiance: Irradiance, scene: object) -> tuple[Float[Array, "... wavelengths"], PerWavelength]:
        """Return the irradiance of signals and background behind the effect.

        Parameters
        ----------
        irradiance : Irradiance
            Irradiance before the effect.
        scene : Scene
            Scenario of the study.

        Returns
        -------
        signals, background : ndarray
            Irradiance in the shapes of those before it, photons/s/m2/nm.

        Raises
        ------
        SweepError
            If the code raises, or returns another shape, negative or non-finite values.
        """
        result = self.code.called(self.code.loaded, irradiance, scene)
        behind = []
        for part in ("signals", "background"):
            before = getattr(irradiance, part)
            values = self.code.called(np.asarray, self.code.called(getattr, result, part), float)
            if values.shape != before.shape:
                problem = f"{self.code.name} gives another shape of `{part}`"
                raise SweepError(ValidationIssue(problem, value=values.shape, allowed=f"{before.shape}"))
            wrong = values[~(np.isfinite(values) & (values >= 0))]
            if wrong.size:
                problem = f"{self.code.name} gives no irradiance in `{part}`"
                raise SweepError(ValidationIssue(problem, value=float(wrong[0]), allowed="finite numbers, 0 or more"))
            behind.append(values)
        return behind[0], behind[1]
