"""Variation of lamps around the spectra of a study: temperature, binning, ageing, width.

A warm LED emits at longer wavelengths. Each signal of a study becomes a set of spectra: its own, shifted by drift
times (temperature of the junction - reference) + binning + ageing, and stretched by each width factor.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, Literal, Protocol, TypeVar

from pydantic import BeforeValidator, Field, model_validator

from ..base.types import Section, from_to

_Value = TypeVar("_Value")
_Celsius = Annotated[float, Field(ge=-100, le=300)]
_Drift = Annotated[float, Field(ge=-2, le=2)]
_Off = Annotated[float, Field(ge=0, le=30)]
_Aged = Annotated[float, Field(ge=-30, le=30)]
_LEAST_BELOW, _ROUNDING = 10, 1e-6
"""Draws that have less than the wanted share has, at least, on average; numbers of draws are known to this."""
_MOST_HELD = 1_000_000
"""Draws of two types that every worker of a search holds: of so many 40 MB, for each two types."""
_ALL = ""
"""Key of the value for every signal."""

DRIFT_NM_PER_K: Mapping[str, float] = {"green": 0.03, "yellow": 0.1, "orange": 0.1, "red": 0.1}
"""Drift of the peak where a study states none.

Yellow, orange and red LEDs are of AlGaInP: the peak follows the band gap E, d l / d T = (l^2 / hc) (-d E / d T), with
Varshni's -d E / d T = a T (T + 2 b) / (T + b)^2. InP's a = 0.363 meV/K and b = 162 K (Vurgaftman, Meyer, Ram-Mohan,
"Band parameters for III-V compound semiconductors", J. Appl. Phys. 89, 5815, 2001) give 0.32 meV/K at 300 K: 0.09 nm/K
at 592 nm, 0.105 nm/K at 640 nm. Green is of InGaN, whose peak follows the gap less: 0.02 to 0.04 nm/K, the middle of it
here, a usual figure without a source. None of these was compared with the text of a maker's data sheet: a study of
certain LEDs should state what theirs say. (Data sheets often give the drift of the dominant wavelength, which of red
LEDs is less than that of the peak, because the eye's sensitivity falls there.)
"""


def check_draws(wanted_yield: float | None, draws: int) -> None:
    """Raise ValueError if too few draws are below the value that a share of them has."""
    if wanted_yield is not None and draws * (1 - wanted_yield) + _ROUNDING < _LEAST_BELOW:
        least = math.ceil(_LEAST_BELOW / (1 - wanted_yield) - _ROUNDING)
        raise ValueError(f"wanted_yield {wanted_yield:g} needs at least {least:,} `draws`, not {draws:,}")


class States(Protocol):
    """Section that may state the share of a yield."""

    @property
    def wanted_yield(self) -> float | None: ...


def stated_yield(*sections: States | None) -> float:
    """Return the share of a yield that the first of some sections states; 0: none."""
    stated = (section.wanted_yield for section in sections if section is not None)
    return next((share for share in stated if share is not None), 0.0)


def _by_name(value: Any) -> Any:
    """Convert a single number to one for every signal."""
    return value if isinstance(value, dict) else {_ALL: value}


def _spans_by_name(value: Any) -> Any:
    """Convert a single range to one for every signal."""
    return {name: from_to(span) for name, span in _by_name(value).items()}


class Population(Section):
    """Population of lamps around the study's lights, by shifts of their spectra; `worst_csd_...` is over all of them.

    Where values differ, keys are signal types or names of signals; a value alone holds for all.
    """

    temperature_c: Annotated[
        tuple[_Celsius, _Celsius],
        BeforeValidator(from_to, json_schema_input_type=Annotated[list[_Celsius], Field(min_length=2, max_length=2)]),
    ] = (25.0, 25.0)
    """Ambient temperature from the coldest to the hottest, degrees C, evenly."""
    reference_c: _Celsius = 25.0
    """Junction temperature of the study's spectra, degrees C."""
    self_heating_k: float = Field(default=0.0, ge=0, le=200)
    """Largest excess of the junction temperature over the ambient, K, from 0, evenly."""
    drift_nm_per_k: Annotated[
        dict[str, _Drift], BeforeValidator(_by_name, json_schema_input_type=_Drift | dict[str, _Drift])
    ] = {}
    """Shift of a spectrum with the junction temperature, nm/K: left out, 0.03 for green and 0.1 for yellow, orange
    and red."""
    temperatures: Literal["common", "independent"] = "common"
    """Two lights are compared at one junction temperature (`common`), or each has its own (`independent`)."""
    binning_nm: Annotated[
        dict[str, _Off], BeforeValidator(_by_name, json_schema_input_type=_Off | dict[str, _Off])
    ] = {}
    """Largest shift by binning to either side, nm; independent for each signal."""
    ageing_nm: Annotated[
        dict[str, tuple[_Aged, _Aged]],
        BeforeValidator(_spans_by_name, json_schema_input_type=list[_Aged] | dict[str, list[_Aged]]),
    ] = {}
    """Shift by ageing, from and to, nm; independent for each signal."""
    width: list[Annotated[float, Field(ge=0.5, le=2)]] = Field(default=[1.0], min_length=1, max_length=9)
    """Factors by which each spectrum is stretched about its middle."""
    wanted_dn: float | None = Field(default=None, ge=0, le=1e6)
    """CSD for which the share of lamps and cameras that have it is estimated, DN."""
    wanted_yield: float | None = Field(default=None, ge=0.5, le=0.9999)
    """Share of random lamps and cameras: `yield_csd_...` is the CSD that this share has at least, as objective or
    constraint."""
    draws: int = Field(default=100_000, ge=100, le=10_000_000)
    """Random draws for `wanted_dn` and `wanted_yield`: two lights with temperature, binning, ageing and width, a
    field position, and a production error, each evenly."""

    @model_validator(mode="after")
    def _ordered(self) -> Population:
        if not self.temperature_c[0] <= self.temperature_c[1]:
            raise ValueError(f"temperature_c: {self.temperature_c[0]:g} must not be above {self.temperature_c[1]:g}")
        for name, (low, high) in self.ageing_nm.items():
            if not low <= 0 <= high:
                lamp = name or "a lamp"
                raise ValueError(f"ageing_nm: {lamp} begins as new, so from 0 or less to 0 or more")
        check_draws(self.wanted_yield, self.draws)
        if self.wanted_yield is not None and self.draws > _MOST_HELD:
            raise ValueError(f"wanted_yield takes at most {_MOST_HELD:,} `draws`, not {self.draws:,}")
        return self

    @property
    def names(self) -> dict[str, set[str]]:
        """Signal types and signals that each key of the section names."""
        return {key: set(getattr(self, key)) - {_ALL} for key in ("drift_nm_per_k", "binning_nm", "ageing_nm")}

    @property
    def description(self) -> str:
        """Differences from a single lamp, in words."""
        given = self.model_dump(mode="json", exclude_defaults=True)
        return f"lamps of {given}"

    @property
    def warmer_k(self) -> tuple[float, float]:
        """Least and largest excess of a junction's temperature over the reference, K."""
        low, high = self.temperature_c
        return low - self.reference_c, high + self.self_heating_k - self.reference_c

    def scaled(self, factor: float) -> Population:
        """Return a population with scaled shifts."""
        low, high = (self.reference_c + factor * warmer for warmer in self.warmer_k)
        update = {
            "temperature_c": (low, high),
            "self_heating_k": 0.0,
            "binning_nm": {name: factor * value for name, value in self.binning_nm.items()},
            "ageing_nm": {name: (factor * low, factor * high) for name, (low, high) in self.ageing_nm.items()},
        }
        return self.model_copy(update=update)

    def temperature_of(self, kind: str, name: str, shift_nm: float) -> tuple[float, float]:
        """Return the range of junction temperatures at which a signal may be shifted by an amount.

        Returns temperatures, degrees Celsius.
        """
        drift, (low, high) = self.drift(kind, name), self.independent_nm(kind, name)
        ends = self.warmer_k
        if drift:
            ends_k = sorted((shift_nm - independent_nm) / drift for independent_nm in (low, high))
            ends = max(ends[0], ends_k[0]), min(ends[1], ends_k[1])
        return self.reference_c + ends[0], self.reference_c + ends[1]

    def drift(self, kind: str, name: str) -> float | None:
        """Return the drift of a signal.

        Returns nm/K. None if neither the study nor a default states it.
        """
        return _of(self.drift_nm_per_k, kind, name, DRIFT_NM_PER_K.get(kind))

    def independent_nm(self, kind: str, name: str) -> tuple[float, float]:
        """Return the range of shifts by binning and ageing alone."""
        binning = _of(self.binning_nm, kind, name, 0.0)
        low, high = _of(self.ageing_nm, kind, name, (0.0, 0.0))
        return low - binning, high + binning


def _of(values: Mapping[str, _Value], kind: str, name: str, default: _Value) -> _Value:
    """Return the value of the signal, else of its type, else of all."""
    return values.get(name, values.get(kind, values.get(_ALL, default)))
