"""Family of user code, or of an installed package."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..base.errors import SweepError, ValidationIssue
from ..base.types import (
    Array,
    ChannelCurves,
    DesignCurves,
    DesignParameters,
    Float,
    PerParameter,
    PerWavelength,
)
from ..base.user_code import UserCode
from .family import Family, Parameter

_SLACK = 1e-9


class PluginFamily(Family):
    """Family by a class of user code: FILE.py:CLASS, or the name by which an installed package offers it.

    Methods as in `Family`. The class has `parameters`, a list of (name, low, high) or (name, low, high, default), is
    constructed with (wavelength_nm, base, target), and has `curves(x)`: from [designs, parameters] to QE, [designs,
    wavelengths]. It may have `violation(x)`, [designs, n], met where <= 0, and `below_base = True`, which states that
    no curve of a well-formed design is above the base. Curves are checked to be within 0 and 1, and below the base if
    that is stated. Gradients are central differences. A row of `curves(x)` must not depend on the other rows.

    Worker processes get the text of a file; an installed package must be installed there.
    """

    def __init__(self, code: UserCode, wavelength_nm: PerWavelength, base: PerWavelength, target: PerWavelength | None):
        self.kind = code.name  # type: ignore[misc]
        self._given = code, wavelength_nm, base, target
        self._base = base
        own_family = code.called(code.loaded, wavelength_nm, base, target)
        self._own = own_family
        self.below_base = getattr(own_family, "below_base", False) is True
        self.parameters = _parameters(code.name, getattr(own_family, "parameters", None))

    def __reduce__(self) -> tuple[type[PluginFamily], tuple[Any, ...]]:
        return PluginFamily, self._given

    def _array(self, name: str, x: DesignParameters, width: int | None) -> Float[Array, "designs columns"]:
        """Call a method of the class and check its result."""
        try:
            values = np.asarray(self._given[0].called(getattr(self._own, name), x.copy()), dtype=float)
        except (TypeError, ValueError):
            raise SweepError(ValidationIssue(f"{self.kind}: {name} gives no array of numbers")) from None
        if values.ndim != 2 or len(values) != len(x) or (width is not None and values.shape[1] != width):
            allowed = f"({len(x)}, {'n' if width is None else width})"
            raise SweepError(
                ValidationIssue(f"{self.kind}: {name} has another shape", value=values.shape, allowed=allowed)
            )
        if not np.isfinite(values).all():
            raise SweepError(ValidationIssue(f"{self.kind}: {name} is not finite"))
        return values

    def curves(self, x: DesignParameters) -> DesignCurves:
        """Return the QE of the modified channel; see `Family.curves`.

        Raises SweepError if the curve of a well-formed design is out of its bounds; others are clipped to 0 and 1.
        """
        curves = self._array("curves", x, self._base.size)
        well_formed = curves[(self.violation(x) <= _SLACK).all(axis=1)]
        top = self._base if self.below_base else 1.0
        if (well_formed < -_SLACK).any() or (well_formed > top + _SLACK).any():
            allowed = "0 to the base curve" if self.below_base else "0 to 1"
            ends = f"{well_formed.min():.6g} to {well_formed.max():.6g}"
            raise SweepError(ValidationIssue(f"{self.kind}: a curve is out of its bounds", value=ends, allowed=allowed))
        return np.clip(curves, 0.0, 1.0)[:, None, :]

    def upper(self, low: PerParameter, high: PerParameter) -> ChannelCurves:
        """Return the base or 1, which every well-formed curve is checked against."""
        assert low.shape == high.shape
        return np.asarray((self._base if self.below_base else np.ones_like(self._base))[None], dtype=float)

    def violation(self, x: DesignParameters) -> Float[Array, "designs _conditions"]:
        """Return the conditions of the class; a condition that is always met if it has none."""
        return self._array("violation", x, None) if hasattr(self._own, "violation") else super().violation(x)


def _parameters(kind: str, stated: Any) -> tuple[Parameter, ...]:
    """Check and return the parameters of a class."""
    try:
        parameters = tuple(Parameter(str(name), float(low), float(high)) for name, low, high in stated)
    except (TypeError, ValueError):
        parameters = ()
    names = [parameter.name for parameter in parameters]
    if not parameters or len(set(names)) < len(names) or not all(p.low < p.high for p in parameters):
        allowed = "a list of (name, low, high) with low < high, each name once"
        raise SweepError(ValidationIssue(f"{kind}: no usable `parameters`", allowed=allowed))
    return parameters
