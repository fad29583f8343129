"""What differs between runs: their studies, how they were made, the curves that they used."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from ...results.curves import KeptCurves
from ...results.facts import Provenance
from .. import Output
from ..names import of_reference

_SHOWN = 48
_MOST_KEYS = 3
_BEFORE = 20
"""Characters of a long value that are shown before what differs."""


class _Absent:
    """The value of a key that a run does not have."""


_ABSENT = _Absent()


def study_differences(runs: Mapping[str, Output]) -> pd.DataFrame:
    """Columns `key` and a run each, a row for every key of the resolved studies that is not the same in all."""
    return _table(runs, [output.resolved for output in runs.values()])


def origin_differences(runs: Mapping[str, Output]) -> pd.DataFrame:
    """The same of what made the results: sensor, lights, files, versions, and how each scene was simulated."""
    return _table(runs, [_origin(output.provenance) for output in runs.values()])


def _origin(provenance: Provenance) -> dict[str, Any]:
    kept = {"sensor", "lights", "model_version", "data_sha256", "versions", "designs"}
    simulated = {
        name: {"tolerance_dn": plan.tolerance_dn}
        | {each.effect: "computed" if each.computed else "left out" for each in plan.effects}
        for name, plan in provenance.plans.items()
    }
    return provenance.model_dump(mode="json", include=kept) | {"simulated": simulated}


def _table(runs: Mapping[str, Output], trees: Sequence[Mapping[str, Any]]) -> pd.DataFrame:
    rows = [[key, *_texts(values)] for key, values in _walk("", trees)]
    return pd.DataFrame(rows, columns=["key", *runs])


def _walk(path: str, values: Sequence[Any]) -> Iterator[tuple[str, Sequence[Any]]]:
    """Paths whose values differ; a mapping that some run does not have is one value."""
    if all(value == values[0] for value in values):
        return
    if all(isinstance(value, Mapping) for value in values):
        for key in dict.fromkeys(key for value in values for key in value):
            inner = [value.get(key, _ABSENT) for value in values]
            yield from _walk(f"{path}.{key}" if path else str(key), inner)
    else:
        yield path, values


def _texts(values: Sequence[Any]) -> list[str]:
    """Values in words; of long ones the part where they begin to differ."""
    there = [_text(value) for value in values if value is not _ABSENT]
    distinct = list(dict.fromkeys(there))
    shortest = min(map(len, distinct))
    alike = next((i for i in range(shortest) if len({text[i] for text in distinct}) > 1), shortest)
    cut = len(distinct) > 1 and max(map(len, distinct)) > _SHOWN
    start = max(0, alike - _BEFORE) if cut else 0
    meant: dict[str, str] = {}
    for text in distinct:
        part = text[start : start + _SHOWN]
        part = f"{'...' if start else ''}{part}{'...' if len(text) > start + _SHOWN else ''}"
        meant[text] = f"{part} (differs further on)" if part in meant.values() else part
    return ["-" if value is _ABSENT else meant[_text(value)] for value in values]


def _text(value: Any) -> str:
    plain = value if isinstance(value, str) else json.dumps(value, ensure_ascii=False, default=str)
    return " ".join(plain.split())


def scene_notes(runs: Mapping[str, Output]) -> list[str]:
    """A sentence for each scenario of one name that is not the same in all runs that have it, and for the pixel."""
    studies = {run: output.resolved for run, output in runs.items()}
    names = dict.fromkeys(name for study in studies.values() for name in study["scenarios"])
    parts = {
        f"scenario {' '.join(name.split())}": {
            r: s["scenarios"][name] for r, s in studies.items() if name in s["scenarios"]
        }
        for name in names
    }
    parts["pixel"] = {run: study.get("pixel", {}) for run, study in studies.items()}
    notes = []
    for what, own in parts.items():
        found = [f"{key} {' / '.join(_texts(values))}" for key, values in _walk("", list(own.values()))]
        if found:
            more = f"; {len(found) - _MOST_KEYS} more" if len(found) > _MOST_KEYS else ""
            notes.append(f"{what} differs: {'; '.join(found[:_MOST_KEYS])}{more} ({', '.join(own)}).")
    return notes


def curve_notes(runs: Mapping[str, Output]) -> list[str]:
    """A sentence for each run that used other curves than the first, which makes its CSDs another scale."""
    (first, reference), *others = runs.items()
    notes = []
    for label, output in others:
        what = _other_curves(reference.curves, output.curves)
        if what:
            notes.append(f"{first} and {label} used other curves ({what}): their results do not compare one to one.")
        if of_reference(output) != of_reference(reference):
            shares = f"{of_reference(reference)} in {first}, {of_reference(output)} in {label}"
            notes.append(f"The CFA sensitivities do not compare: they are shares {shares}.")
    return notes


def _other_curves(first: KeptCurves, second: KeptCurves) -> str:
    if not np.array_equal(first.wavelength_nm, second.wavelength_nm):
        return "on another wavelength grid"
    sensor, lights = (first.sensor, second.sensor), (first.lights, second.lights)
    found = []
    common = [name for name in sensor[0] if name in sensor[1]]
    differing = [name for name in common if not np.array_equal(sensor[0][name], sensor[1][name])]
    if differing or not common:
        found.append(f"sensor: {', '.join(differing)}" if differing else "sensor")
    every = {**lights[0], **lights[1]}
    other = [
        name
        for name in every
        if name not in lights[0] or name not in lights[1] or not np.array_equal(lights[0][name], lights[1][name])
    ]
    if other:
        found.append(f"lights: {len(other)} of {len(every)}")
    return "; ".join(found)
