"""The sensor of a study: its curves, how its filters work, and the angles of its lenses."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from ..base.errors import DataError, Fault, unknown
from ..base.types import Array, Float, FloatArray, PerWavelength
from ..camera.angular import grazing_fault
from ..camera.scene import WhitePatchExposure
from ..camera.sensor import BUILT_IN_SENSORS, SensorCurves, make_sensor
from ..camera.sensor_field import PLACES, SensorField
from ..designs.space import Space
from ..spectra.facts import EACH_NORMALIZED, NORMALIZED, is_each_normalized, is_normalized_response
from ..spectra.units import FITTING, Use
from .schema import StudySection
from .schema_curves import CurveFile, SensorSection
from .sources import Sources
from .tree import KeyPath
from .user_code import offered_curves

_ROUNDING = 1e-9


def sensor_of(section: SensorSection, sources: Sources) -> SensorCurves | None:
    """Construct the sensor of a study.

    Relative curves of files are multiplied by their reference, which is built in or QE from a file. A channel with a
    file replaces that of the built-in sensor.

    Raises StudyError: with every issue so far, if the study cannot be used.
    """
    section = offered_curves(sources, ("sensor",), section, "sweep.sensors", BUILT_IN_SENSORS)
    sensor = _sensor(section, sources)
    if sensor is None or section.ir_cut is None:
        return sensor
    entry = CurveFile(file=section.ir_cut, columns={"ir_cut": "ir_cut"})
    curves = sources.curves(("sensor", "ir_cut"), entry)
    if curves is None:
        return None
    if len(curves.values) > 1:
        sources.refuse(
            Fault(("sensor", "ir_cut"), "a file of several curves", ", ".join(curves.values), "a file of one curve")
        )
        return None
    (column,) = curves.values
    cut = sources.used(("sensor", "ir_cut"), entry, "filter", [column])
    values = sources.column(("sensor", "ir_cut"), cut, column, entry)
    if values is None:
        return None
    qe = {name: curve * values for name, curve in sensor.qe.items()}
    return replace(sensor, qe=qe, source=f"{sensor.source}, behind {section.ir_cut}", bare=(sensor, values))


def _sensor(section: SensorSection, sources: Sources) -> SensorCurves | None:
    """Return the curves of a sensor without its IR cut."""
    built_in: SensorCurves | None = None
    if section.builtin is not None:
        built_in = sources.built_in(("sensor",), section.builtin, BUILT_IN_SENSORS)
        if built_in is None or not section.files:
            return built_in
    before = len(sources.issues)
    if not sources.fits(("sensor", "files"), "curves", sum(len(entry.columns) for entry in section.files)):
        return None
    known = {} if built_in is None else built_in.qe
    added = _curves_of_files(sources, section, known)
    if len(sources.issues) > before:
        return None
    source = ", ".join(entry.file for entry in section.files)
    clear = section.clear or (None if built_in is None else built_in.clear)
    try:
        sensor = make_sensor(section.name or section.builtin or "sensor", {**known, **added}, source, clear)
    except DataError as error:
        for issue in error.issues:
            index = next((i for i, entry in enumerate(section.files) if issue.key in entry.columns), None)
            place = ("sensor",) if index is None else ("sensor", "files", index, "columns", issue.key or "")
            path = ("sensor", "clear") if issue.key is None else place
            sources.refuse(Fault(path, issue.problem, issue.value, issue.allowed, issue.nearest))
        return None
    if built_in is None:
        return sensor
    variants = {
        cfa: {channel: curve for channel, curve in channels.items() if channel not in added}
        for cfa, channels in built_in.variants.items()
    }
    return replace(sensor, source=f"{built_in.source}, {source}", surrogate=built_in.surrogate, variants=variants)


def _curves_of_files(
    sources: Sources, section: SensorSection, known: Mapping[str, Float[Array, " _values"]]
) -> dict[str, PerWavelength]:
    """Return the QE of every curve of the files, those that are relative to others last; `known`: built-in curves."""
    curves: dict[str, FloatArray] = {}
    files = sorted(enumerate(section.files), key=lambda item: item[1].relative_to is not None)
    all_known = dict(known)
    for index, entry in files:
        path: KeyPath = ("sensor", "files", index)
        if entry.relative_to is not None and entry.relative_to not in all_known:
            sources.refuse(unknown((*path, "relative_to"), "curve", entry.relative_to, all_known))
            continue
        factor = entry.scale if entry.relative_to is None else entry.scale * all_known[entry.relative_to]
        for name, values in _columns(sources, path, entry, factor).items():
            if name in curves:
                sources.refuse(Fault((*path, "columns", name), "the curve is defined twice", name))
            curves[name] = values
            if entry.relative_to is None:
                all_known[name] = values
    return curves


def _columns(
    sources: Sources, path: KeyPath, entry: CurveFile, factor: float | Float[Array, "#wavelengths"]
) -> dict[str, PerWavelength]:
    """Return the curves of one file on the grid, times a factor."""
    use: Use = "sensor" if entry.relative_to is None else "filter"
    given = FITTING[use][0] if entry.file in sources.given else None
    known = sources.used(
        path,
        entry,
        use,
        entry.columns.values(),
        entry.quantity or given,
        scaled="scale" in entry.model_fields_set or given is not None,
    )
    if known is None:
        return {}
    if entry.relative_to is None:
        present = [column for column in entry.columns.values() if column in known.values]
        tops = [float(known.samples(column)[1].max()) for column in present]
        top = max(tops, default=0.0)
        relative = any(known.units[column].quantity == "relative_responsivity" for column in present)
        if relative or is_normalized_response(entry.scale * top):
            sources.warnings.append(f"{entry.file}: {NORMALIZED}")
        if is_each_normalized(tops):
            sources.warnings.append(f"{entry.file}: {EACH_NORMALIZED}")
    scaled = {}
    for name, column in entry.columns.items():
        place = (*path, "columns", name)
        values = sources.column(place, known, column, entry)
        if values is not None:
            scaled[name] = values * factor
    return scaled


def with_chief_rays(section: StudySection, sources: Sources) -> StudySection:
    """Read the files of lenses.

    Returns the study with chief ray angles instead of file names.
    """
    scenarios = dict(section.scenarios)
    read: dict[tuple[str, float | None], SensorField] = {}
    for name, scenario in section.scenarios.items():
        field = scenario.field
        if field is None or field.file is None:
            continue
        key = (field.file, field.corner_mm)
        if key not in read:
            rays = sources.chief_rays(("scenarios", name, "field", "profile"), *key)
            # Without a file that can be read, a field without angles lets the other issues be found.
            read[key] = (
                SensorField(cra_max_deg=0.0)
                if rays is None
                else SensorField(heights=tuple(rays.heights.tolist()), cra_deg=tuple(rays.cra_deg.tolist()))
            )
        sensor_field = read[key].model_copy(update={"places": field.places or PLACES})
        scenarios[name] = scenario.model_copy(update={"field": sensor_field})
    return section.model_copy(update={"scenarios": scenarios})


def _moves(sensor: SensorCurves, curve: str) -> bool:
    """Return whether a curve of the sensor moves with the angle of the light."""
    technology = sensor.technologies.get(curve)
    return technology is not None and technology.interference is not None


def with_technologies(sensor: SensorCurves, section: StudySection, sources: Sources) -> SensorCurves:
    """Add the filter technologies that the study states."""
    clear = sensor.curve(sensor.clear)
    kind = "clear" if sensor.has_clear else "brightest"
    stated = replace(sensor, technologies=section.sensor.technology)
    for curve in section.sensor.technology:
        path: KeyPath = ("sensor", "technology", curve)
        if curve not in sensor.qe:
            sources.refuse(unknown(path, "curve", curve, sensor.qe))
        elif _moves(stated, curve) and (sensor.qe[curve] > clear * (1 + _ROUNDING)).any():
            problem = f"an interference filter lets through a share of the {kind} curve, {sensor.clear}"
            sources.refuse(Fault(path, problem, f"{curve} is above it", "pigment"))
    return stated


def check_filter(space: Space, path: KeyPath, sensor: SensorCurves) -> Iterator[Fault]:
    """Check that the base of a filter is no interference filter and that no filter exceeds its base."""
    candidate = space.filter
    assert candidate is not None
    for base in dict.fromkeys(candidate.bases.values()):
        if _moves(sensor, base):
            problem = f"the base curve {base} is an interference filter itself"
            yield Fault((*path, "base"), problem, base, "a base of pigment")
    if candidate.technology is None or candidate.technology.interference is None:
        return
    low, high = (np.array([end(axis) for axis in space.axes], dtype=float) for end in (min, max))
    bases = np.stack([sensor.curve(base) for base in candidate.bases.values()])
    if (candidate.family.upper(low, high) > bases * (1 + _ROUNDING)).any():
        problem = "an interference filter lets through a share of its base"
        exceeded = f"filters that exceed {' and '.join(dict.fromkeys(candidate.bases.values()))}"
        yield Fault((*path, "technology"), problem, exceeded, "a filter below it, or pigment")


def check_lenses(section: StudySection, sensor: SensorCurves, spaces: Sequence[Space]) -> Iterator[Fault]:
    """Check that no ray reaches interference filters at grazing angles."""
    filters = [space.filter.technology for space in spaces if space.filter is not None]
    if all(t is None or t.interference is None for t in (*filters, *sensor.technologies.values())):
        return
    for name, scenario in section.scenarios.items():
        if (fault := grazing_fault(scenario)) is not None:
            yield fault.under("scenarios", name)


def check_uncertainty(section: StudySection, sensor: SensorCurves, spaces: Sequence[Space]) -> Iterator[Fault]:
    """Check that uncertain curves are of filters that do not move."""
    if section.uncertainty is None:
        return
    filters = [space.filter.technology for space in spaces if space.filter is not None]
    if any(t is not None and t.interference is not None for t in (*filters, *sensor.technologies.values())):
        problem = "of filters that do not move with the angle of the light; thin layers do"
        yield Fault(("uncertainty",), problem, None, "no `interference`")
    if section.uncertainty.wanted_yield is None:
        return
    path = ("uncertainty", "wanted_yield")
    if section.population is not None and section.population.wanted_yield is not None:
        problem = "stated of `population`, too; of `uncertainty` it counts random curves and random lamps"
        yield Fault(path, problem, section.uncertainty.wanted_yield, "one of them")
    for name, scene in section.scenarios.items():
        if scene.drive is not None and isinstance(scene.exposure, WhitePatchExposure):
            problem = f"random cameras under a pulsed light need a fixed exposure (scenario {name})"
            yield Fault(path, problem, section.uncertainty.wanted_yield, "`exposure: {kind: fixed, ...}`")
