"""The study file's schema. Sections that a lower layer owns (pixel, scenario, ...) are declared there."""

from __future__ import annotations

import math
from copy import deepcopy
from itertools import product
from typing import Annotated, Any

from pydantic import BeforeValidator, Field, ValidationError, model_validator

from ..constraints import Bound
from ..datasets import BUILT_IN_LIGHTS
from ..families import FamilyOptions
from ..filters import BUILT_IN_SENSORS
from ..objectives import Objective
from ..scenes import Geometry, Scenario
from ..schema import NonNegative, Positive, Section
from ..sensor import Pixel
from ..spectra import WavelengthGrid
from .curve_sections import Documented, LightsSection, Name, SensorSection, builtin, named

_FEWEST_PATCHES = 10


class CfaSection(Section):
    """A tile, row by row. `curves` maps channels to curves of the sensor that have another name."""

    tile: list[list[Name]] | None = None
    curves: dict[Name, Name] = {}


def _listed(value: Any) -> Any:
    return [value] if isinstance(value, str) else value


class Modification(Documented):
    """A family of filters put into `channel` of a CFA: it starts from curve `base` and goes `to` a curve or a floor.

    A number for `to` is a floor: that fraction of the base curve. `dual` replaces two channels (a list) and goes `to` a
    ceiling; `free_form` has no `to`.
    """

    cfa: Name
    """One of `cfas`."""
    family: Name = "stopband"
    """stopband, multi_stopband (options: {bands: 2}), dual, or free_form (options: {nodes: {...}})."""
    channel: Annotated[
        list[Name], BeforeValidator(_listed, json_schema_input_type=list[Name] | Name), Field(min_length=1)
    ]
    """The channel of the CFA that the filter replaces; `dual` takes a list of two."""
    base: Name
    """The curve that the filter starts from."""
    to: Name | Annotated[float, Field(ge=0, le=1)] | None = None
    """The curve that it follows inside the band; a number is a floor, that share of the base."""
    options: FamilyOptions = FamilyOptions()


class DesignSection(Modification):
    """One filter by its parameters, or by the name of a built-in one."""

    at: dict[Name, float] | Name


class Axis(Section):
    """Values of one parameter: a list, or `count` equidistant ones from `min` to `max`."""

    values: list[float] | None = Field(default=None, min_length=1)
    min: float | None = None
    max: float | None = None
    count: int | None = Field(default=None, ge=1, le=1_000_000)

    @model_validator(mode="after")
    def _one_form(self) -> Axis:
        spanned = (self.min, self.max, self.count)
        if (self.values is None) == (None in spanned) or (self.values is not None and spanned != (None, None, None)):
            raise ValueError("an axis is a number, a list of numbers, or `min`, `max` and `count`")
        if self.min is not None and self.max is not None and not self.min <= self.max:
            raise ValueError(f"min {self.min:g} must not be above max {self.max:g}")
        if self.count == 1 and self.min != self.max:
            raise ValueError("count 1 needs min = max")
        return self

    def points(self) -> tuple[float, ...]:
        """The values, in order."""
        if self.values is not None:
            return tuple(self.values)
        assert self.min is not None
        assert self.max is not None
        assert self.count is not None
        step = (self.max - self.min) / max(1, self.count - 1)
        return tuple(self.max if i == self.count - 1 else self.min + i * step for i in range(self.count))


def _span(value: Any) -> Any:
    """An axis of a box: `min` and `max` are enough."""
    if isinstance(value, dict) and set(value) == {"min", "max"}:
        return {**value, "count": 1 if value["min"] == value["max"] else 2}
    return _axis(value)


def _axis(value: Any) -> Any:
    """A number or a list of numbers as an axis."""
    if isinstance(value, list):
        return {"values": value}
    return {"values": [value]} if isinstance(value, int | float) and not isinstance(value, bool) else value


Values = Annotated[Axis, BeforeValidator(_axis, json_schema_input_type=float | list[float] | Axis)]
Span = Annotated[Axis, BeforeValidator(_span, json_schema_input_type=float | list[float] | Axis)]


class SweepSection(Modification):
    """A full-factorial grid over the family's parameters."""

    grid: dict[Name, Values]


class BoxSection(Modification):
    """A box that is searched but not swept; a parameter that is not named may take all its family's values."""

    box: dict[Name, Span] = {}


class Production(Section):
    """What production does to a filter: every edge may come out up to `edge_shift_nm` too far to either side."""

    edge_shift_nm: NonNegative = 0.0


class Recognition(Section):
    """How often noise confuses signal types.

    `states`: the signal types to tell apart; all of them where it is left out. `patches`: raw patches that are drawn
    of every signal for each plain CFA, named design and answer of the search, half of them to train the classifiers;
    0 draws none. `error_max`: a CFA is usable while no two states are confused more often.
    """

    states: Annotated[list[Name], Field(min_length=2)] | None = None
    patches: int = Field(default=200, ge=0, le=5000)
    error_max: float = Field(default=1e-3, gt=0, lt=0.5)

    @model_validator(mode="after")
    def _enough(self) -> Recognition:
        if 0 < self.patches < _FEWEST_PATCHES:
            raise ValueError(f"patches: 0, or at least {_FEWEST_PATCHES}: {self.patches} are too few to train and test")
        return self


class Levels(Section):
    """Equidistant levels of sensitivity."""

    min: float = Field(gt=0, lt=2)
    max: float = Field(gt=0, lt=2)
    count: int = Field(ge=1, le=1000)

    @model_validator(mode="after")
    def _ordered(self) -> Levels:
        if not self.min <= self.max:
            raise ValueError(f"min {self.min:g} must not be above max {self.max:g}")
        if (self.count == 1) != (self.min == self.max):
            raise ValueError("count 1 goes with min = max")
        return self


class SearchSection(Documented):
    """A search in a box, or in that of a sweep's grid (from the smallest to the largest value of each axis).

    `front`: repeat the search over these levels of the least sensitivity.
    """

    space: Name | None = None
    """The sweep or box to search; may be left out where there is one."""
    front: Levels | None = None
    scenario: Name | None = None
    algorithm: Name = "SLSQP"
    """SLSQP, MMA, CCSAQ; without gradients COBYLA, ISRES, ORIG_DIRECT_L, AGS."""
    starts: int = Field(default=16, ge=1, le=10_000)
    max_evaluations: int = Field(default=2000, ge=10, le=10_000_000)


def _cfas(value: Any) -> Any:
    if isinstance(value, list):
        names = [name for name in value if isinstance(name, str)]
        if len(names) < len(value):
            raise ValueError("a list of CFAs holds names; write others as `NAME: {tile: [[R, G], [G, B]]}`")
        if len(set(names)) < len(names):
            raise ValueError("a CFA is named twice")
        return {name: {} for name in names}
    return {name: {} if tile is None else tile for name, tile in value.items()} if isinstance(value, dict) else value


_MOST_SCENARIOS = 2000


class ScenarioTemplate(Scenario):
    """What the file says of a scenario; with `each`, of one for every combination of its values.

    `each`: dotted keys of the scenario (target.distance_m) -> values.
    """

    each: Annotated[dict[Name, Values], Field(min_length=1)] | None = None


def _expanded(value: Any) -> Any:
    """Scenarios with `each: {key: values}` become one per combination, named after their values."""
    if not isinstance(value, dict):
        return value
    found: dict[str, Any] = {}
    for name, entry in value.items():
        if not isinstance(entry, dict) or "each" not in entry:
            found[name] = entry
            continue
        each = entry["each"]
        if not isinstance(each, dict) or not each:
            raise ValueError(f"{name}: `each` maps keys such as target.distance_m to values")
        axes = [_numbers(f"{name}: each.{key}", axis) for key, axis in each.items()]
        if math.prod(map(len, axes)) + len(found) > _MOST_SCENARIOS:
            raise ValueError(f"{name}: more than {_MOST_SCENARIOS} scenarios")
        for point in product(*axes):
            made = deepcopy({key: inner for key, inner in entry.items() if key != "each"})
            for key, number in zip(each, point, strict=True):
                _set(made, str(key).split("."), number)
            labels = [f"{str(key).rsplit('.', 1)[-1]}={number:.12g}" for key, number in zip(each, point, strict=True)]
            full = " ".join([str(name), *labels])
            if full in found:
                raise ValueError(f"{name}: two scenarios are named {full!r}")
            found[full] = made
    return found


def _numbers(where: str, axis: Any) -> tuple[float, ...]:
    """Values of one key of `each`; whole numbers of a list stay whole."""
    try:
        points = Axis.model_validate(_axis(axis)).points()
    except ValidationError:
        raise ValueError(f"{where}: a number, a list of numbers, or `min`, `max` and `count`") from None
    return tuple(axis) if isinstance(axis, list) else points


def _set(mapping: dict[str, Any], path: list[str], number: float) -> None:
    """Put a number at a dotted path."""
    for key in path[:-1]:
        if mapping.get(key) is True:  # switched on, with its defaults
            mapping[key] = {}
        mapping = mapping.setdefault(key, {})
        if not isinstance(mapping, dict):
            raise ValueError(f"each: {key} is no mapping")
    mapping[path[-1]] = number


class StudySection(Documented):
    """A whole study file."""

    study: Annotated[str, Field(min_length=1, max_length=100)]
    """The name of the study, and of the folder of its results."""
    question: str = ""
    """What the study asks; heads its report."""
    seed: int = Field(default=1, ge=0, lt=2**32)
    """Of every random draw."""
    wavelengths: WavelengthGrid = WavelengthGrid()
    """The grid that all curves are brought to, nm."""
    sensor: Annotated[
        SensorSection, BeforeValidator(builtin, json_schema_input_type=named(BUILT_IN_SENSORS) | SensorSection)
    ]
    """QE curves: `ar0820`, a built-in surrogate, or a mapping with `files`."""
    pixel: Pixel = Pixel()
    """The pixel and its readout."""
    lights: Annotated[
        LightsSection, BeforeValidator(builtin, json_schema_input_type=named(BUILT_IN_LIGHTS) | LightsSection)
    ]
    """Traffic lights: `tl16`, a built-in surrogate, or a mapping with `files`."""
    scenarios: Annotated[
        dict[Name, Scenario],
        BeforeValidator(_expanded, json_schema_input_type=dict[Name, ScenarioTemplate]),
        Field(min_length=1),
    ] = {"chart": Scenario()}
    """Scenes, by name: exposure, target, optics, weather, noise."""
    tolerance_dn: Positive = 0.1
    """By how much the simulation may change any CSD, DN."""
    geometry: dict[Name, Geometry] = {}
    """Distances at which the size of a light on the sensor is told, by name."""
    cfas: Annotated[
        dict[Name, CfaSection],
        BeforeValidator(_cfas, json_schema_input_type=list[Name] | dict[Name, CfaSection | None]),
        Field(min_length=1),
    ]
    """CFAs to compare: a list of names of 2x2 pixels (RGGB, RYYCy), or NAME: {tile: [[R, G], [B, W]]}."""
    designs: dict[Name, DesignSection] = {}
    """Single filters to compare with, by name."""
    sweeps: dict[Name, SweepSection] = {}
    """Full-factorial grids of filters, by name."""
    boxes: dict[Name, BoxSection] = {}
    """Ranges of filters that are searched but not swept, by name."""
    production: Production = Production()
    """What production does to a filter; then worst_... quantities exist."""
    recognition: Recognition | None = None
    """How often noise confuses signal types; needs noise in every scenario."""
    objective: Objective = Objective(minimum={"csd_yellow_red": 1.0})
    """What is maximized: a CSD or sensitivity, or several: {minimum: {...}} or {sum: {...}} with weights."""
    constraints: dict[Name, Bound] = {}
    """Quantity -> {min: ...}, {max: ...} or both."""
    search: SearchSection | None = None
    """A constrained search beside the sweep."""
    published: dict[Name, dict[Name, dict[Name, float]]] = {}
    """Printed figures to compare with: table -> CFA, design or geometry -> quantity -> value."""
