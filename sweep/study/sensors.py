"""The sensor of a study: built in, from files, or own curves beside built-in ones."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from ..base.errors import DataError
from ..base.types import FloatArray
from ..camera.sensor import BUILT_IN_SENSORS, SensorCurves, make_sensor
from ..curves.facts import NORMALIZED, looks_normalized
from .schema_curves import CurveFile, SensorSection
from .sources import Sources
from .yaml_tree import Key


def sensor_of(sources: Sources, section: SensorSection) -> SensorCurves | None:
    """The study's sensor, or None after adding faults to `sources`.

    Curves of files that are relative to another one are multiplied by it; such a curve is built in, or from a file
    whose values are QE themselves.
    """
    built_in: SensorCurves | None = None
    if section.builtin is not None:
        built_in = sources.built_in(("sensor",), section.builtin, BUILT_IN_SENSORS)
        if built_in is None or not section.files:
            return built_in
    before = len(sources.faults)
    if not sources.fits(("sensor", "files"), "curves", sum(len(entry.columns) for entry in section.files)):
        return None
    own = _curves_of_files(sources, section, {} if built_in is None else built_in.qe)
    if len(sources.faults) > before:
        return None
    source = ", ".join(entry.file for entry in section.files)
    qe = own if built_in is None else {**built_in.qe, **own}
    clear = section.clear or (None if built_in is None else built_in.clear)
    try:
        made = make_sensor(section.name or section.builtin or "sensor", qe, source, clear)
    except DataError as error:
        for fault in error.faults:
            path = ("sensor", "clear") if fault.key is None else _place(section, fault.key)
            sources.add(path, fault.problem, fault.value, fault.allowed, fault.nearest)
        return None
    return made if built_in is None else _beside(made, built_in, own)


def _beside(made: SensorCurves, built_in: SensorCurves, own: Mapping[str, FloatArray]) -> SensorCurves:
    """The sensor with what else the built-in one says; a channel with an own curve is not taken from another one."""
    variants = {
        cfa: {channel: curve for channel, curve in channels.items() if channel not in own}
        for cfa, channels in built_in.variants.items()
    }
    return replace(made, source=f"{built_in.source}, {made.source}", surrogate=built_in.surrogate, variants=variants)


def _curves_of_files(
    sources: Sources, section: SensorSection, known: Mapping[str, FloatArray]
) -> dict[str, FloatArray]:
    """QE of every curve of the files, those that are relative to others last; `known`: built-in curves."""
    found: dict[str, FloatArray] = {}
    every = list(enumerate(section.files))
    for entries in ([e for e in every if e[1].relative_to is None], [e for e in every if e[1].relative_to is not None]):
        whole = {**known, **found}
        for index, entry in entries:
            path: tuple[Key, ...] = ("sensor", "files", index)
            if entry.relative_to is not None and entry.relative_to not in whole:
                sources.unknown((*path, "relative_to"), "curve", entry.relative_to, list(whole))
                continue
            factor = entry.scale if entry.relative_to is None else entry.scale * whole[entry.relative_to]
            for name, values in _columns(sources, path, entry, factor).items():
                if name in found:
                    sources.add((*path, "columns", name), "the curve is defined twice", name)
                found[name] = values
    return found


def _columns(
    sources: Sources, path: tuple[Key, ...], entry: CurveFile, factor: float | FloatArray
) -> dict[str, FloatArray]:
    """The curves of one file on the grid, times a factor; those that a finished run kept have it already."""
    curves = sources.curves(path, entry)
    if curves is not None and entry.relative_to is None:
        top = max((float(curves.values[c].max()) for c in entry.columns.values() if c in curves.values), default=0.0)
        if looks_normalized(entry.scale * top):
            sources.warnings.append(f"{entry.file}: {NORMALIZED}")
    found = {}
    for name, column in entry.columns.items():
        place = (*path, "columns", name)
        if sources.kept is not None:
            values = sources.kept_curve(place, sources.kept.sensor, name)
        else:
            values = sources.column(place, curves, column, entry)
            values = None if values is None else values * factor
        if values is not None:
            found[name] = values
    return found


def _place(section: SensorSection, curve: str) -> tuple[Key, ...]:
    """Where the study names a curve."""
    index = next((i for i, entry in enumerate(section.files) if curve in entry.columns), None)
    return ("sensor",) if index is None else ("sensor", "files", index, "columns", curve)
