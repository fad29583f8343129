"""Values of parameters and of scenes: lists and spans, and the scenarios that `each` makes of them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import product
from typing import Annotated, Any

from pydantic import BeforeValidator, Field, ValidationError, ValidationInfo, model_validator

from ..base.errors import Fault
from ..base.types import Number, Section
from ..camera.pixel import Pixel
from ..camera.scene import Scene
from .schema_curves import Name
from .tree import put

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


ZIP = "zip"
_MADE = ("series", "at", "each")
"""Keys of scenarios that say how `each` made them."""
_MOST_SCENARIOS = 2000
_MOST_KEYS = 500_000
"""Most keys of all scenarios that `each` makes."""


class ScenarioTemplate(Scene):
    """Scenario as the file has it; with `each`, one for every combination of its values."""

    each: Annotated[dict[Name, Values | dict[Name, Values]], Field(min_length=1)] | None = None
    """Dotted key of the scenario (`target.distance_m`, `pixel.bits`) -> values; `zip`: such keys whose first values go
    together, then the second ones."""


def expanded(value: Any, info: ValidationInfo) -> Any:
    """Replace scenarios that have `each: {key: values}` by one scenario per combination of values."""
    if not isinstance(value, dict):
        return value
    scenarios = _expanded(value)
    if isinstance(pixel := info.data.get("pixel"), Pixel):  # else it has a fault of its own
        for name, entry in scenarios.items():
            changes = entry.get("pixel") if isinstance(entry, dict) else None
            if isinstance(changes, dict):
                scenarios[name] = entry | {"pixel": pixel.with_numbers(changes)}
    return scenarios


def _expanded(value: dict[str, Any]) -> dict[str, Any]:
    scenarios: dict[str, Any] = {}
    for name, entry in value.items():
        if not isinstance(entry, dict) or "each" not in entry:
            scenarios[name] = entry
            continue
        each = entry["each"]
        if not isinstance(each, dict) or not each:
            raise Fault((name, "each"), "no mapping of keys", each, "{target.distance_m: [20, 50]}")
        axes = [_points((name, "each"), key, axis) for key, axis in each.items()]
        count = math.prod(map(len, axes))
        if count + len(scenarios) > _MOST_SCENARIOS:
            raise Fault((name, "each"), "too many scenarios", f"{count:,}", f"at most {_MOST_SCENARIOS:,} in a study")
        if count * _size(entry) > _MOST_KEYS:
            raise Fault((name, "each"), "too many keys in all scenarios that it makes", None, f"at most {_MOST_KEYS:,}")
        for point in product(*axes):
            scenario: Any = {key: inner for key, inner in entry.items() if key != "each"}
            full = str(name)
            at = {key: number for values in point for key, number in values.items()}
            for key, number in at.items():
                try:
                    scenario = put(scenario, key.split("."), number)
                except Fault as fault:
                    problem = f"{fault.path[-1]} {fault.problem} in this scenario"
                    raise Fault((name, "each", key), problem, fault.value, "a key of a mapping") from None
                full += f" {key.rsplit('.', 1)[-1]}={number:.12g}"
            scenario |= {"series": str(name), "at": at}
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


def _points(path: tuple[str, ...], key: Any, axis: Any) -> list[dict[str, float]]:
    """Values of one key of `each`, or of all keys of its `zip`, by key."""
    if str(key).partition(".")[0] in _MADE:
        raise Fault((*path, key), "no number of a scenario", None, "target.distance_m, pixel.bits, ...")
    if key != ZIP:
        return [{str(key): number} for number in _numbers((*path, key), axis)]
    if not isinstance(axis, dict) or not axis:
        raise Fault(
            (*path, ZIP), "no mapping of keys", axis, "{pixel.pitch_um: [2.1, 4.2], target.width_px: [3840, 1920]}"
        )
    values = {str(inner): _numbers((*path, ZIP, inner), numbers) for inner, numbers in axis.items()}
    if len({len(numbers) for numbers in values.values()}) > 1:
        counts = ", ".join(f"{inner} {len(numbers)}" for inner, numbers in values.items())
        raise Fault((*path, ZIP), "as many values of each key", counts, "lists of equal length")
    return [dict(zip(values, point, strict=True)) for point in zip(*values.values(), strict=True)]


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
    if isinstance(axis, list):
        return tuple(axis)
    points = checked.points()
    whole = isinstance(axis, dict) and all(isinstance(axis.get(end), int) for end in ("min", "max"))
    return tuple(int(value) if whole and value == int(value) else value for value in points)


def series_of(scenes: Mapping[str, Scene]) -> dict[tuple[str, str], dict[str, float]]:
    """Group scenarios that one number tells apart: those of an `each` of which a key has another value in each.

    (name, last part of the key) -> scenario -> number, in ascending order.
    """
    made: dict[str, dict[str, Mapping[str, float]]] = {}
    for name, scene in scenes.items():
        if scene.at:
            made.setdefault(scene.series, {})[name] = scene.at
    groups = {}
    for series, places in made.items():
        for key in next(iter(places.values())):
            values = {name: at[key] for name, at in places.items() if key in at}
            if 1 < len(places) == len({*values.values()}):
                ordered = dict(sorted(values.items(), key=lambda item: item[1]))
                groups[series, key.rpartition(".")[2]] = ordered
                break
    return groups


def axes_of(scenes: Mapping[str, Scene]) -> tuple[str, ...]:
    """Return the dotted keys of `each`, in order."""
    return tuple(dict.fromkeys(key for scene in scenes.values() for key in scene.at))


def places_of(scenes: Mapping[str, Scene]) -> dict[str, dict[str, str | float]]:
    """Return the values of each scene on all axes, by dotted key; in a series its name, key and value, too."""
    single: dict[str, dict[str, str | float]] = {
        name: {"key": next(key for key in scenes[name].at if key.rpartition(".")[2] == last), "value": value}
        for (_, last), members in series_of(scenes).items()
        for name, value in members.items()
    }
    return {
        name: {"series": scene.series, **single.get(name, {}), **scene.at} for name, scene in scenes.items() if scene.at
    }
