"""Parameters of the built-in surrogate sensor and lights: one readable file, checked when it is read."""

from __future__ import annotations

from functools import cache
from importlib.resources import files
from typing import Annotated, Literal

from pydantic import Field
from ruamel.yaml import YAML

from .schema import Fraction, NonNegative, Positive, Section

BUILT_IN_RANGE_NM = (400.0, 700.0)
"""Wavelengths that the surrogate curves are stated for; an IR cut filter closes the rest."""


class ClearPixel(Section):
    """Nodes of the unfiltered pixel's QE."""

    wavelength_nm: list[Positive]
    qe: list[Fraction]


class FilterEdge(Section):
    """A logistic edge; `width_nm` is its 10-90 % width."""

    passes: Annotated[Literal["above", "below"], Field(alias="pass")]
    center_nm: Positive
    width_nm: Positive


class FilterParameters(Section):
    """A color filter's transmission: `leak` where it is closed, `peak` where all edges are open."""

    peak: Fraction
    leak: Fraction
    edges: list[FilterEdge]


class LedParameters(Section):
    """LEDs of one color: peak (in photons) of the middle lamp, half range over the lamps, decay toward blue and red."""

    peak_nm: Positive
    spread_nm: NonNegative
    blue_nm: Positive
    red_nm: Positive


class SurrogateParameters(Section):
    """The whole file `data/surrogate.yaml`."""

    provenance: str
    photon_ratio: Positive
    clear_pixel: ClearPixel
    filters: dict[str, FilterParameters]
    lights: dict[str, dict[str, LedParameters]]


@cache
def surrogate_parameters() -> SurrogateParameters:
    """Read the file that ships with the package."""
    text = files(__package__).joinpath("data/surrogate.yaml").read_text(encoding="utf-8")
    return SurrogateParameters.model_validate(YAML(typ="safe").load(text))
