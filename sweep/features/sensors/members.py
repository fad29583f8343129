"""Studies of several sensors, pixels or light sets: one study for each combination of them."""

from __future__ import annotations

import math
from itertools import product
from typing import Any

from ...base.errors import StudyError, SweepError
from ...camera.pixel import merged
from ...camera.sensor import BUILT_IN_SENSORS, own_red
from ...spectra.builtin.measured_sets import LUXEON, SENSORS
from ...study.document import Document
from ...study.members import SensorAndLights
from ...study.schema import Modification, StudySection

_MOST = 200
_SURROGATE_CURVES = ("C", "R", "G", "B", "Y", "Cy", "Rx")
_MEASURED = {**SENSORS, "luxeon": LUXEON}
_SPACES = ("cfas", "designs", "sweeps", "boxes")


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
    if (count := len(sensors) * len(lights) * len(pixels)) > _MOST:
        allowed = f"at most {_MOST} sensors times pixels times lights"
        raise StudyError(document.issue(("sensors",), "too many", count, allowed))
    return [
        SensorAndLights(f"{sensor} {pixel}".strip(), light_set, (i, k), pixel)
        for (sensor, i), pixel, (light_set, k) in product(sensors, pixels, lights)
    ]


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
    """Return a member's study: the wavelengths that its curves have, and the CFAs that the sensor has.

    `section`: the whole study with this member's sensor and lights. Returns `notes`: what was left out.
    """
    grid, notes = section.wavelengths, list[str]()
    ends = [_MEASURED[n].range_nm for n in (section.sensor.builtin, section.lights.builtin) if n in _MEASURED]
    low = max([grid.start_nm, *(low for low, _ in ends)])
    high = min([grid.stop_nm, *(high for _, high in ends)])
    if (low, high) != (grid.start_nm, grid.stop_nm):
        start = grid.start_nm + grid.step_nm * math.ceil((low - grid.start_nm) / grid.step_nm)
        stop = start + grid.step_nm * math.floor((high - start) / grid.step_nm)
        if stop <= start:  # left as it is, for the error of what has no curves there
            return section, []
        grid = grid.model_copy(update={"start_nm": start, "stop_nm": stop})
        notes.append(f"{member.sensor}: curves from {start:g} to {stop:g} nm")
    changes: dict[str, Any] = {"wavelengths": grid}
    names = _curve_names(section)
    if names is not None:
        changes |= _buildable(section, names)
        gone = [name for key in _SPACES for name in getattr(section, key) if name not in changes[key]]
        if gone:
            left_out = ", ".join(dict.fromkeys(gone))
            notes.append(f"{member.sensor}: without {left_out}, whose curves {member.sensor} does not have")
        before, after = section.search, changes.get("search", section.search)
        if before is not None and after is not before:
            notes.append(f"{member.sensor}: {'no search' if after is None else f'the search is of {after.space}'}")
    return section.model_copy(update=changes), notes


def _curve_names(section: StudySection) -> set[str] | None:
    """Return the curves of the sensor; None of one that a package offers."""
    names = {column for entry in section.sensor.files for column in entry.columns}
    match section.sensor.builtin:
        case None:
            return names
        case name if name in SENSORS:
            return names | set(SENSORS[name].names)
        case name:
            return names | set(_SURROGATE_CURVES) if name in BUILT_IN_SENSORS else None


def _buildable(section: StudySection, names: set[str]) -> dict[str, Any]:
    """Return CFAs, filters and search without those that need curves of other sensors.

    A name that no sensor has is a mistake, and stays for its error.
    """
    others = {*_SURROGATE_CURVES, *(curve for measured in SENSORS.values() for curve in measured.names)} - names
    variants = own_red(names) if section.sensor.builtin is not None else {}

    def is_buildable(entry: Modification) -> bool:
        return not others & {entry.base, entry.to if isinstance(entry.to, str) else None}

    filters = {
        key: {name: entry for name, entry in getattr(section, key).items() if is_buildable(entry)}
        for key in ("designs", "sweeps", "boxes")
    }
    modified = {(e.cfa, channel) for entries in filters.values() for e in entries.values() for channel in e.channel}
    cfas = {}
    for name, cfa in section.cfas.items():
        try:
            channels = cfa.mosaic(name).channels
        except SweepError:  # stays for its error
            channels = ()
        curves = {c: cfa.curves.get(c, variants.get(name, {}).get(c, c)) for c in channels}
        if all(curve not in others or (name, channel) in modified for channel, curve in curves.items()):
            cfas[name] = cfa
    filters = {
        key: {n: e for n, e in entries.items() if e.cfa in cfas or e.cfa not in section.cfas}
        for key, entries in filters.items()
    }
    filters["clouds"] = {n: c for n, c in section.clouds.items() if n in cfas or n not in section.cfas}
    searched = {**filters["sweeps"], **filters["boxes"]}
    space_name = None if section.search is None else section.search.space
    if section.search is None or space_name is None or space_name in searched:
        return {"cfas": cfas, **filters} | ({"search": None} if not searched else {})
    named_anywhere = space_name in {**section.sweeps, **section.boxes}
    instead = next(iter(searched), None) if named_anywhere else space_name
    search = None if instead is None else section.search.model_copy(update={"space": instead})
    return {"cfas": cfas, **filters, "search": search}
