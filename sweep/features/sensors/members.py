"""Studies of several sensors, pixels or light sets: one study for each combination of them."""

from __future__ import annotations

import fnmatch
import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from typing import Any

from ...base.errors import StudyError, nearest
from ...camera.pixel import merged
from ...camera.sensor import BUILT_IN_SENSORS
from ...spectra.builtin.measured_sets import LUXEON, SENSORS
from ...spectra.spectrum import WavelengthGrid
from ...study.document import Document
from ...study.members import SensorAndLights
from ...study.schema import StudySection

_MOST = 200
_MEASURED = {**SENSORS, "luxeon": LUXEON}
_SPACES = ("cfas", "designs", "sweeps", "boxes", "clouds")


def members_of(document: Document) -> list[SensorAndLights]:
    """Return the sensors and lights of a study, each pair once; a plain study has one member.

    Raises StudyError if `sensors` stands beside `sensor`, or a list is empty, too long, or names one twice.
    """
    data = document.data
    if data.get("sensors") is not None and "sensor" in data:
        raise StudyError(document.issue(("sensors",), "beside `sensor`", None, "one of both"))
    document.expand("sensors", BUILT_IN_SENSORS)
    sensors, lights = _listed(document, "sensors", data.get("sensor")), _listed(document, "lights", data.get("lights"))
    pixels = _pixels(document)
    _check_only(document, [*dict.fromkeys([*(name for name, _ in sensors), *BUILT_IN_SENSORS])])
    if (count := len(sensors) * len(lights) * len(pixels)) > _MOST:
        allowed = f"at most {_MOST} sensors times pixels times lights"
        raise StudyError(document.issue(("sensors",), "too many", count, allowed))
    return [
        SensorAndLights(f"{sensor} {pixel}".strip(), light_set, (i, k), pixel)
        for (sensor, i), pixel, (light_set, k) in product(sensors, pixels, lights)
    ]


def _check_only(document: Document, known: Sequence[str]) -> None:
    """Check that CFAs that are for some sensors name some that there are."""
    cfas = document.data.get("cfas")
    for name, cfa in cfas.items() if isinstance(cfas, dict) else ():
        only = cfa.get("only") if isinstance(cfa, dict) else None
        for at, pattern in enumerate(only if isinstance(only, list) else ()):
            if not fnmatch.filter(known, str(pattern)):
                near = nearest(pattern, known)
                path = ("cfas", name, "only", at)
                raise StudyError(document.issue(path, "unknown sensor", pattern, ", ".join(known), near))


def _pixels(document: Document) -> list[str]:
    """Return the names of several pixels; an empty one without."""
    pixels = document.data.get("pixels")
    if pixels is None:
        return [""]
    if not isinstance(pixels, dict) or not pixels:
        example = "{plain: , split: split_pixel}"
        raise StudyError(document.issue(("pixels",), "no mapping of names to pixels", pixels, example))
    return [str(name) for name in pixels]


def _listed(document: Document, key: str, alone: Any) -> list[tuple[str, int]]:
    """Return the names of a list's entries with their indices; a value alone has -1."""
    value = document.data.get(key)
    if not isinstance(value, list):
        return [(_name(alone, key, 0), -1)]
    names = [_name(entry, key, at) for at, entry in enumerate(value)]
    if not names or len(set(names)) < len(names):
        problem = "an empty list" if not names else "one is named twice; `name` tells mappings apart"
        raise StudyError(document.issue((key,), problem, None, "different names, one or more"))
    return [(name, at) for at, name in enumerate(names)]


def _name(entry: Any, key: str, at: int) -> str:
    """Return the name of a sensor or of lights."""
    stated = (entry.get("name") or entry.get("builtin")) if isinstance(entry, dict) else entry
    return str(stated or f"{key.removesuffix('s')} {at + 1}")


def way_to_one(document: Document) -> str:
    """Return the options that choose a member."""
    options = []
    if isinstance(pixels := document.data.get("pixels"), dict):
        name = next(iter(pixels))
        options.append(f"a mapping `pixels` of one in the file, such as `{name}`")
    for key in ("sensors", "lights"):
        entries = document.data.get(key)
        if isinstance(entries, list):
            first = entries[0]
            options.append(f"--set {key}=[{first}]" if isinstance(first, str) else f"a list `{key}` of one in the file")
    return " ".join(options)


def choose(document: Document, member: SensorAndLights) -> None:
    """Leave one sensor and one set of lights in a document.

    `document`: study file; changed in place.
    """
    for key, to, at in (("sensors", "sensor", member.indices[0]), ("lights", "lights", member.indices[1])):
        if at >= 0:
            document.put(to, document.data[key][at], (key, at))
    document.data.pop("sensors", None)
    if member.pixel:
        pixels = document.data["pixels"]
        own = next(pixel for name, pixel in pixels.items() if str(name) == member.pixel)
        keys = {"captures": own} if isinstance(own, str) else {} if own is None else own
        general = document.data.get("pixel", {})
        both = general if not isinstance(general, dict) else merged(general, keys) if isinstance(keys, dict) else keys
        document.put("pixel", both, ("pixels", member.pixel))
        document.data.pop("pixels")


def narrowed(section: StudySection, member: SensorAndLights) -> tuple[StudySection, list[str]]:
    """Return a member's study: the wavelengths that its curves have, and the CFAs and filters that are for its sensor.

    `section`: the whole study with this member's sensor and lights. Returns `notes`: what was left out.
    """
    several, notes = max(member.indices) >= 0 or bool(member.pixel), list[str]()
    grid = _measured_range(section) if several else section.wavelengths
    if grid is not section.wavelengths:
        notes.append(f"{member.sensor}: curves from {grid.start_nm:g} to {grid.stop_nm:g} nm")
    sensor = member.sensor.removesuffix(f" {member.pixel}")
    gone = [name for name, cfa in section.cfas.items() if not _is_for(cfa.key("only"), sensor)]
    changes: dict[str, Any] = {"wavelengths": grid}
    for key in _SPACES:
        entries = getattr(section, key)
        of_cfa = {name: name if key in ("cfas", "clouds") else entry.cfa for name, entry in entries.items()}
        changes[key] = {name: entry for name, entry in entries.items() if of_cfa[name] not in gone}
    left_out = dict.fromkeys(name for key in _SPACES for name in getattr(section, key) if name not in changes[key])
    if left_out:
        notes.append(f"{member.sensor}: without {', '.join(left_out)}")
    if section.search is not None and not {**changes["sweeps"], **changes["boxes"]} and left_out:
        notes.append(f"{member.sensor}: no search")
        changes["search"] = None
    elif section.search is not None and section.search.space in left_out:
        changes["search"] = section.search.model_copy(update={"space": None})
    return section.model_copy(update=changes), notes


def _measured_range(section: StudySection) -> WavelengthGrid:
    """Return the wavelengths of a study that its measured sensor and lights have; all, for an error, where none."""
    grid = section.wavelengths
    ends = [_MEASURED[n].range_nm for n in (section.sensor.builtin, section.lights.builtin) if n in _MEASURED]
    low = max([grid.start_nm, *(low for low, _ in ends)])
    high = min([grid.stop_nm, *(high for _, high in ends)])
    if (low, high) == (grid.start_nm, grid.stop_nm):
        return grid
    start = grid.start_nm + grid.step_nm * math.ceil((low - grid.start_nm) / grid.step_nm)
    stop = start + grid.step_nm * math.floor((high - start) / grid.step_nm)
    return grid.model_copy(update={"start_nm": start, "stop_nm": stop}) if start < stop else grid


def _is_for(only: Sequence[str] | None, sensor: str) -> bool:
    """Return whether a CFA is for a sensor; without `only` it is for all."""
    return not only or any(fnmatch.fnmatchcase(sensor, pattern) for pattern in only)


def of_member(error: StudyError, member: SensorAndLights) -> StudyError:
    """Return what is wrong with a member, with its name."""
    issues = []
    for issue in error.issues:
        allowed = issue.allowed
        if allowed is not None and (issue.key or "").startswith("cfas."):
            allowed = f"`only: [SENSOR, ...]` of the CFA; or {allowed}"
        issues.append(replace(issue, problem=f"{member.sensor}: {issue.problem}", allowed=allowed))
    return StudyError(issues)
