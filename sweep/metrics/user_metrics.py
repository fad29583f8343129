"""Metrics of user code or of an installed package: numbers from the readout alone."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np

from ..base.errors import SweepError, ValidationIssue
from ..base.types import Array, DesignSignals, Float
from ..base.user_code import UserCode, name_in_file
from ..camera.setup import Setup

_NAME = re.compile("[A-Za-z][A-Za-z0-9_]{0,39}")
_MOST_DIGITS = 12


@dataclass(frozen=True)
class Readings:
    """Readout of a batch of designs at one sampling phase and moment, the argument of a user's metric.

    `dn`: digital numbers, DN, including the pedestal; neither clipped nor rounded in a search.
    """

    dn: DesignSignals
    types: tuple[str, ...]
    names: tuple[str, ...]
    channels: tuple[str, ...]
    pedestal_dn: float

    @staticmethod
    def of_setup(setup: Setup, dn: DesignSignals) -> Readings:
        """Return read-only digital numbers with the signals and channels of a setup."""
        fixed = np.asarray(dn, dtype=float).view()
        fixed.flags.writeable = False
        lights = setup.lights
        return Readings(fixed, lights.types, lights.names, setup.camera.mosaic.channels, setup.camera.pixel.offset_dn)

    def of(self, kind: str) -> DesignSignals:
        """Return the digital numbers of one signal type, DN."""
        return self.dn[:, [of_type == kind for of_type in self.types]]


@dataclass(frozen=True)
class UserMetric:
    """Metric of user code: a function of `Readings`, or a class with a method `of`, constructed without arguments.

    It returns a number for each design; or several, [designs, n], of which the worst counts, so that a search sees each
    of them; or None for a CFA that it does not apply to. A row must not depend on other rows. Optional attributes:
    `name`, `unit`, `label`, `digits` and `direction` (`more` or `less`).
    """

    code: UserCode

    def __reduce__(self) -> tuple[type[UserMetric], tuple[UserCode]]:
        return UserMetric, (self.code,)

    @cached_property
    def _made(self) -> Any:
        loaded = self.code.loaded
        return self.code.called(loaded) if isinstance(loaded, type) else loaded

    @property
    def name(self) -> str:
        """Column name; raises SweepError for an invalid one."""
        usual = name_in_file(self.code.name)
        name = self._said("name", usual)
        if not _NAME.fullmatch(name):
            allowed = "at most 40 letters, digits and `_`, a letter first"
            raise SweepError(ValidationIssue(f"{self.code.name}: no usable `name`", value=name, allowed=allowed))
        return name

    @property
    def unit(self) -> str:
        """Unit; empty for a ratio."""
        return self._said("unit", "")

    @property
    def label(self) -> str:
        """Name in texts."""
        return self._said("label", self.name.replace("_", " "))

    @property
    def direction(self) -> Literal["more", "less"]:
        """`more` or `less`; raises SweepError for anything else."""
        if self._said("wanted", ""):
            raise SweepError(ValidationIssue(f"{self.code.name}: `wanted` is named `direction`"))
        direction = self._said("direction", "more")
        if direction not in ("more", "less"):
            problem = f"{self.code.name}: no such `direction`"
            raise SweepError(ValidationIssue(problem, value=direction, allowed="more, less"))
        return direction  # type: ignore[return-value]  # one of both

    @property
    def digits(self) -> int:
        """Digits after the point; raises SweepError for anything else."""
        digits = self.code.called(getattr, self._made, "digits", 4)
        if isinstance(digits, bool) or not isinstance(digits, int) or not 0 <= digits <= _MOST_DIGITS:
            allowed = f"a whole number, 0 to {_MOST_DIGITS}"
            raise SweepError(ValidationIssue(f"{self.code.name}: no such `digits`", value=digits, allowed=allowed))
        return digits

    def _said(self, what: str, usual: str) -> str:
        text = self.code.called(getattr, self._made, what, usual)
        if not isinstance(text, str) or len(text) > 100 or not text.isprintable():
            raise SweepError(ValidationIssue(f"{self.code.name}: `{what}` is no short text", value=text))
        return text

    def parts(self, readings: Readings, *, finite: bool = True) -> Float[Array, "designs parts"] | None:
        """Call the metric.

        None if the CFA has none. Raises SweepError if the code raises, or returns something else.
        """
        metric, n = self._made, len(readings.dn)
        with np.errstate(all="ignore"):
            result = self.code.called(self.code.called(getattr, metric, "of", metric), readings)
        if result is None:
            return None
        values = self.code.called(np.asarray, result)
        if values.dtype.kind not in "biuf":
            raise SweepError(
                ValidationIssue(f"{self.code.name} gives no numbers", value=result, allowed="a number per design")
            )
        if values.ndim not in (1, 2) or len(values) != n or values.size == 0:
            problem = f"{self.code.name} gives another shape"
            raise SweepError(ValidationIssue(problem, value=values.shape, allowed=f"({n},) or ({n}, n)"))
        if finite and not np.isfinite(values).all():
            other = float(values[~np.isfinite(values)][0])
            raise SweepError(ValidationIssue(f"{self.code.name} is not finite", value=other))
        return np.asarray(values.reshape(n, -1), dtype=float)
