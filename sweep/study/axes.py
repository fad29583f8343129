"""Values of parameters and of scenes: lists and spans, and the scenarios that `each` makes of them."""

from __future__ import annotations

import math
from collections.abc import Iterable
from copy import deepcopy
from itertools import product
from typing import Annotated, Any

from pydantic import BeforeValidator, Field, ValidationError, model_validator

from ..base.errors import Fault
from ..base.types import Number, Section
from ..camera.scene import Scene
from .schema_curves import Name

FORMS = "a number, a list of numbers, `min`, `max` and `count`, or `geometric: [min, max, count]`"
_MOST_COUNT = 1_000_000


class Axis(Section):
    """Values of one parameter: a list, `count` equidistant ones from `min` to `max`, or ones of equal ratio."""

    values: list[Number] | None = Field(default=None, min_length=1)
    """List of values."""
    min: Number | None = None
    """Smallest value."""
    max: Number | None = None
    """Largest value."""
    count: int | None = Field(default=None, ge=1, le=_MOST_COUNT)
    """Number of equidistant values."""
    geometric: Annotated[list[Number], Field(min_length=3, max_length=3)] | None = None
    """Smallest value, largest value, and number of values whose ratio to the one before is the same."""

    @model_validator(mode="after")
    def _one_form(self) -> Axis:
        spanned = (self.min, self.max, self.count)
        forms = (self.values is not None, None not in spanned, self.geometric is not None)
        if sum(forms) != 1 or (not forms[1] and spanned != (None, None, None)):
            raise ValueError(f"an axis is {FORMS}")
        if self.geometric is not None:
            low, high, count = self.geometric
            if not (0 < low < high and count == int(count) and 2 <= count <= _MOST_COUNT):
                raise ValueError("geometric: a number above 0, a larger one, and how many values, 2 or more")
        if self.min is not None and self.max is not None and not self.min <= self.max:
            raise ValueError(f"min {self.min:g} must not be above max {self.max:g}")
        if self.count == 1 and self.min != self.max:
            raise ValueError("count 1 needs min = max")
        return self

    @property
    def size(self) -> int:
        """Number of values."""
        return self.count or len(self.values or ()) or int((self.geometric or [0])[-1])

    def points(self) -> tuple[float, ...]:
        """Return the values, in order."""
        if self.values is not None:
            return tuple(self.values)
        if self.geometric is not None:
            low, high, last = self.geometric[0], self.geometric[1], int(self.geometric[2]) - 1
            return tuple(high if i == last else low * (high / low) ** (i / last) for i in range(last + 1))
        assert self.min is not None and self.max is not None and self.count is not None  # noqa: PT018
        step = (self.max - self.min) / max(1, self.count - 1)
        return tuple(self.max if i == self.count - 1 else self.min + i * step for i in range(self.count))


def _span(value: Any) -> Any:
    """Return an axis of a box: `min` and `max` are enough."""
    if isinstance(value, dict) and set(value) == {"min", "max"}:
        return {**value, "count": 1 if value["min"] == value["max"] else 2}
    return _axis(value)


def _axis(value: Any) -> Any:
    """Return a number or a list of numbers as an axis."""
    if isinstance(value, list):
        return {"values": value}
    return {"values": [value]} if isinstance(value, int | float) and not isinstance(value, bool) else value


Values = Annotated[Axis, BeforeValidator(_axis, json_schema_input_type=float | list[float] | Axis)]
Span = Annotated[Axis, BeforeValidator(_span, json_schema_input_type=float | list[float] | Axis)]


_MOST_SCENARIOS = 2000
_MOST_KEYS = 500_000
"""Most keys of all scenarios that `each` makes."""


class ScenarioTemplate(Scene):
    """Scenario as the file has it; with `each`, one for every combination of its values."""

    each: Annotated[dict[Name, Values], Field(min_length=1)] | None = None
    """Dotted key of the scenario (target.distance_m) -> values."""


def expanded(value: Any) -> Any:
    """Replace scenarios that have `each: {key: values}` by one scenario per combination of values."""
    if not isinstance(value, dict):
        return value
    scenarios: dict[str, Any] = {}
    for name, entry in value.items():
        if not isinstance(entry, dict) or "each" not in entry:
            scenarios[name] = entry
            continue
        each = entry["each"]
        if not isinstance(each, dict) or not each:
            raise Fault((name, "each"), "no mapping of keys", each, "{target.distance_m: [20, 50]}")
        axes = [_numbers((name, "each", key), axis) for key, axis in each.items()]
        count = math.prod(map(len, axes))
        if count + len(scenarios) > _MOST_SCENARIOS:
            raise Fault((name, "each"), "too many scenarios", f"{count:,}", f"at most {_MOST_SCENARIOS:,} in a study")
        if count * _size(entry) > _MOST_KEYS:
            raise Fault((name, "each"), "too many keys in all scenarios that it makes", None, f"at most {_MOST_KEYS:,}")
        for point in product(*axes):
            scenario = deepcopy({key: inner for key, inner in entry.items() if key != "each"})
            full = str(name)
            for key, number in zip(map(str, each), point, strict=True):
                _set(scenario, str(name), key, number)
                full += f" {key.rsplit('.', 1)[-1]}={number:.12g}"
            if full in scenarios:
                raise Fault((name,), "two scenarios have one name", full, "other names, or other values")
            scenarios[full] = scenario
    if len(scenarios) > _MOST_SCENARIOS:
        raise Fault((), "too many scenarios", len(scenarios), f"at most {_MOST_SCENARIOS:,}")
    return scenarios


def _size(value: Any) -> int:
    """Keys and values of a part of a study."""
    inner = value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
    return 1 + sum(map(_size, inner))


def _numbers(path: tuple[str, ...], axis: Any) -> tuple[float, ...]:
    """Values of one key of `each`; whole numbers of a list stay whole."""
    try:
        checked = Axis.model_validate(_axis(axis))
    except ValidationError:
        texts = [value for value in axis if isinstance(value, str)] if isinstance(axis, list) else []
        value = texts[0] if texts else axis if isinstance(axis, str | bool) else None
        raise Fault(path, "not a number" if texts else "no values", value, FORMS) from None
    if checked.size > _MOST_SCENARIOS:
        raise Fault(path, "too many values", f"{checked.size:,}", f"at most {_MOST_SCENARIOS:,}")
    return tuple(axis) if isinstance(axis, list) else checked.points()


def _set(mapping: dict[str, Any], name: str, dotted: str, number: float) -> None:
    """Put a number at a dotted path of a scenario."""
    path = dotted.split(".")
    for key in path[:-1]:
        if mapping.get(key) is True:  # switched on, with its defaults
            mapping[key] = {}
        mapping = mapping.setdefault(key, {})
        if not isinstance(mapping, dict):
            raise Fault((name, "each", dotted), f"{key} is no mapping in this scenario", None, "a key of a mapping")
    mapping[path[-1]] = number


def series_of(scenarios: Iterable[str]) -> dict[tuple[str, str], dict[str, float]]:
    """Group scenarios that differ in a single number.

    (name, key) -> scenario -> number, in ascending order.
    """
    groups: dict[tuple[str, str], dict[str, float]] = {}
    for name in scenarios:
        base, _, last = str(name).rpartition(" ")
        key, _, number = last.partition("=")
        try:
            value = float(number)
        except ValueError:  # a scenario that a person named may have an `=` followed by anything
            continue
        if base and "=" not in base and math.isfinite(value):
            groups.setdefault((base, key), {})[name] = value
    ordered = {group: dict(sorted(values.items(), key=lambda item: item[1])) for group, values in groups.items()}
    return {group: values for group, values in ordered.items() if len(values) > 1}
