"""Parameters of the built-in surrogate sensor and lights: one readable file, checked when it is read."""

from __future__ import annotations

from functools import cache
from importlib.resources import files
from typing import Annotated, Any, Literal

from pydantic import Field
from ruamel.yaml import YAML

from ...base.types import Fraction, NonNegative, Positive, Section

BUILT_IN_RANGE_NM = (400.0, 700.0)
"""Wavelengths that the surrogate curves are stated for; an IR cut filter closes the rest."""
MODELED = ("ar0820", "tl16", "tl16_deep_red")
"""Sensors and lights that are modeled between these wavelengths; others say themselves where they end."""
FITS = 12
"""Further fits, `ar0820@1` with `tl16@1` and so on."""
LEAK_NODES_NM = (400.0, 600.0, 700.0)


class ClearPixel(Section):
    """Nodes of the unfiltered pixel's QE."""

    wavelength_nm: list[Positive]
    qe: list[Fraction]


class IrCut(Section):
    """The infrared cut filter before all pixels: a falling logistic edge; `width_nm` is its 10-90 % width."""

    center_nm: Positive
    width_nm: Positive


class FilterEdge(Section):
    """A logistic edge; `width_nm` is its 10-90 % width."""

    passes: Annotated[Literal["above", "below"], Field(alias="pass")]
    center_nm: Positive
    width_nm: Positive


class FilterParameters(Section):
    """A color filter's transmission: `peak` where all edges are open, `leak` where it is closed.

    `leak` holds the values at LEAK_NODES_NM: dyes close best somewhere and open again toward the ends.
    """

    peak: Fraction
    leak: Annotated[list[Fraction], Field(min_length=3, max_length=3)]
    edges: list[FilterEdge]


class LedParameters(Section):
    """LEDs of one color: peak (in photons) of the middle lamp, half range over the lamps, decay toward blue and red."""

    peak_nm: Positive
    spread_nm: NonNegative
    blue_nm: Positive
    red_nm: Positive


class StopbandParameters(Section):
    """A stopband filter of the paper, as `families.Stopband` takes it."""

    left_nm: Positive
    left_width_nm: Positive
    right_nm: Positive
    right_width_nm: Positive


class SurrogateParameters(Section):
    """The whole file: `surrogate.yaml` as shipped, `prior.yaml` as the start of `studies/notebooks/calibrate.py`."""

    provenance: dict[str, str | int | float]
    photon_ratio: Positive
    clear_pixel: ClearPixel
    ir_cut: IrCut
    filters: dict[str, FilterParameters]
    lights: dict[str, dict[str, LedParameters]]
    stopbands: dict[str, StopbandParameters]


@cache
def surrogate_parameters(name: str = "surrogate") -> SurrogateParameters:
    """Read a parameter file of the package."""
    return SurrogateParameters.model_validate(parameter_tree(name))


@cache
def surrogate_fit(number: int) -> SurrogateParameters:
    """Return another fit of the same model, from another start, that meets every printed figure, too: 1 to FITS."""
    tree = parameter_tree("surrogate")
    head, *rows = files(__package__).joinpath("surrogate_fits.csv").read_text(encoding="utf-8").splitlines()
    column = head.split(",").index(str(number))
    for row in rows:
        path, *numbers = row.split(",")
        *parents, last = [int(key) if key.isdigit() else key for key in path.split(".")]
        node: Any = tree
        for key in parents:
            node = node[key]
        node[last] = float(numbers[column - 1])
    return SurrogateParameters.model_validate(tree)


def parameters_of(name: str | None) -> SurrogateParameters:
    """Return the parameters of a built-in sensor or lights: those of its fit (`ar0820@3`), or the shipped ones."""
    _, _, number = (name or "").partition("@")
    return surrogate_fit(int(number)) if number else surrogate_parameters()


def parameter_tree(name: str) -> dict[str, Any]:
    """Return a parameter file as mappings and lists."""
    text = files(__package__).joinpath(f"{name}.yaml").read_text(encoding="utf-8")
    tree: dict[str, Any] = YAML(typ="safe").load(text)
    return tree
