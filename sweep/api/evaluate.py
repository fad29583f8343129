"""Evaluate one filter, from a file of curves or from a finished run."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..base.disk import is_folder
from ..base.errors import DataError, ValidationIssue, nearest
from ..base.types import Array, Float
from ..camera.mosaic import Mosaic
from ..camera.sensor import SensorCurves
from ..spectra import LightUnit
from ..spectra.formats import files_in, read_curves
from ..spectra.lights import Lights
from ..spectra.spectrum import Curves, Quantity
from ..spectra.units import FITTING, Use, stated_quantity, used_as
from ..study import Study
from ..study.shipped import shipped_folder
from .channels import NEW, RATIO, Layout, layout_of, sensor_file
from .filter_evaluation import (
    PLAIN_TILE,
    USER_CURVE,
    FilterEvaluation,
    FilterUnderTest,
    diagonal_curve,
    evaluate_filter,
    with_base,
)
from .loading import CurveSource, lights, load_study, make_study, sensor_source

_ASKED = "stopband"
"""Study of the package whose constraints a filter from a file is held against."""
_OF_A_RUN = ("manifest.json", "provenance.json")


@dataclass(frozen=True)
class EvaluateOptions:
    """Options of `evaluate`, as it says them; values that are None follow from the file or the run."""

    column: str | None = None
    channel: str | None = None
    cfa: str | None = None
    base: str | None = None
    sensor: str = "ar0820"
    lights: str | None = None
    quantity: str | Sequence[str] | None = None
    relative_to: str | None = None
    transmission: bool = False
    data: Path | str | None = None
    allow_code: bool = False

    def stated(self, *uses: Use) -> Quantity | None:
        """Return the unit that is stated for a use."""
        words = [self.quantity] if isinstance(self.quantity, str) else list(self.quantity or ())
        stated = [stated_quantity(word) for word in words]
        return next((quantity for quantity in stated if any(quantity in FITTING[use] for use in uses)), None)

    @property
    def of_lights(self) -> LightUnit | None:
        """Unit that is stated for lights."""
        return "photons" if (stated := self.stated("light")) == "photons" else stated and "energy"


def evaluate(source: Path | str, *, design: str | int | None = None, **options: Any) -> FilterEvaluation:
    """Evaluate one filter beside RGGB, the CFA that it changes, and its upper bound.

    Parameters
    ----------
    source : path-like
        A file with the filter's curve, or the folder of a finished run.
    design : str or int, optional
        A design of the run: a `filter_id`, a name (paper_N4, RGGB), or ``best`` (default).
    **options
        Left out, they follow from the file, or are those of the run. ``column`` of the file; ``cfa`` and ``channel``
        that the filter is for, ``base``, the curve that it replaces; ``sensor`` (default ar0820) and ``lights`` (tl16),
        built in or a file; ``quantity``, units that heads do not tell (``qe``, ``transmission``, ``density``, ...);
        ``relative_to``, the curve that its transmissions are multiplied by; ``transmission=True``, the clear pixel's;
        for a run ``data``, the folder of its files, and ``allow_code``. A filter of a file is held against the
        constraints of the shipped study ``stopband``.

    Returns
    -------
    FilterEvaluation
        ``table`` of the CFAs, ``upper_bound``, DN (or ``no_upper_bound``, why there is none), ``gap`` to it, relative
        to it (0 to 1), ``violated`` constraints of ``of_study``; printed, it is the text of `sweep evaluate`.

    Raises
    ------
    SweepError
        If a name is unknown, a value is missing, or a curve is not clean.

    Examples
    --------
    >>> import sweep
    >>> evaluation = sweep.evaluate("my_filter.csv", relative_to="Y")  # doctest: +SKIP
    >>> evaluation.gap  # doctest: +SKIP
    0.876
    """
    path = Path(source)
    if is_folder(path) and not _holds_curves(path):
        return evaluate_filter(filter_of_run(path, design, EvaluateOptions(**options)))
    for key, value in (("design", design), ("data", options.get("data")), ("allow-code", options.get("allow_code"))):
        if value:
            raise DataError(ValidationIssue(f"`{key}` requires a run folder", str(path), None, f"--{key}", str(value)))
    return evaluate_filter(filter_of_file(path, EvaluateOptions(**options)))


def _holds_curves(folder: Path) -> bool:
    """Return whether a folder holds files of curves, and no run."""
    try:
        return not any(os.path.lexists(folder / name) for name in _OF_A_RUN) and bool(files_in(folder))
    except DataError:
        return False


def filter_of_file(path: Path, options: EvaluateOptions) -> FilterUnderTest:
    """Read a filter from a file, with the CFA and lights to evaluate it with."""
    sensor = sensor_source(options.sensor, {})
    keys: dict[str, Any] = {}
    if os.path.lexists(options.sensor):
        start_nm, stop_nm = sensor_file(Path(options.sensor)).range_nm
        keys["wavelengths"] = {"start_nm": start_nm, "stop_nm": stop_nm}
    qe = _curves_of(sensor, keys)
    layout = _default_layout(qe)
    name = options.cfa or layout.changed
    mosaic = Mosaic.from_name(name)
    channel = options.channel or _channel_without_curve(mosaic, qe)
    if channel not in mosaic.channels:
        known = list(mosaic.channels)
        near = nearest(channel, known)
        raise DataError(
            ValidationIssue(f"no such channel of {name}", None, None, "--channel", channel, ", ".join(known), near)
        )
    default = layout.base if (name, channel) == (layout.changed, NEW) else None
    base = options.base or default or diagonal_curve(mosaic, channel, qe.qe)
    qe.curve(base)
    curves = read_curves(path)
    column = _find_column(path, curves, options.column, channel)
    use, stated = _use_of(curves, column, options)
    factor = options.relative_to or (qe.clear if options.transmission else base if use == "filter" else None)
    used = used_as(curves, [column], use, stated)
    unit = used.units[column]
    assert unit.quantity is not None
    entry: dict[str, Any] = {"file": str(path.absolute()), "columns": {USER_CURVE + channel: column}}
    entry |= {"quantity": unit.quantity, "scale": unit.factor or 1.0}
    entry |= {} if factor is None else {"relative_to": factor}
    times = "" if factor is None else f", times {factor}"
    note = f"{path}: {used.notes[-1]}{times}; it is {channel} of {name}, in place of {base}"
    with_filter = CurveSource({**sensor.keys, "files": [*sensor.keys["files"], entry]}, sensor.curves)
    spectra, types = _lights_and_types(options.lights or "tl16", options.of_lights)
    curve_names = _curve_names(qe, with_base(mosaic, {channel: base}).name, mosaic)
    asked = mosaic, {channel: base}, with_filter, spectra, types, curve_names, keys, (note,)
    return FilterUnderTest(*asked, study=_shipped_study())


def _shipped_study() -> Study | None:
    """Return the study of the package whose constraints a filter is held against; None without its files."""
    folder = shipped_folder()
    return None if folder is None else load_study(folder / f"{_ASKED}.yaml").study


def _use_of(curves: Curves, column: str, options: EvaluateOptions) -> tuple[Use, Quantity | None]:
    """Return whether a column is QE or transmissions, and its quantity where it is stated or known."""
    stated = options.stated("sensor", "filter")
    told = stated or curves.units[column].quantity
    if told is not None and not (options.relative_to or options.transmission):
        return ("sensor" if told in FITTING["sensor"] else "filter"), stated
    if told is None and any(name.startswith(f"{column}{RATIO}") for name in curves.values):
        return "sensor", "qe"  # of `sweep export`, whose transmissions stand beside it
    return "filter", stated


def filter_of_run(folder: Path, design: str | int | None, options: EvaluateOptions) -> FilterUnderTest:
    """Take a design of a finished run, in the scene of its row, with the run's lights or others."""
    from ..results.designs import BEST, find_design_row, row_curves, study_of
    from ..results.output import read_output

    output = read_output(folder)
    data = None if options.data is None else Path(options.data)
    study = study_of(output, data, allow_code=options.allow_code)
    row = find_design_row(output, design or BEST)
    space, curves = row_curves(study, row)
    if space.filter is None:
        raise DataError(ValidationIssue("a plain CFA has no filter to judge", str(folder), None, "--design", design))
    nodes_nm = study.grid.nodes_nm
    filters = {USER_CURVE + channel: curve for channel, curve in zip(space.filter.channels, curves[0], strict=True)}
    curves_nm = {name: (nodes_nm, curve) for name, curve in {**study.sensor.qe, **filters}.items()}
    clear = study.sensor.clear if study.sensor.has_clear else None
    plain = sensor_source(None, curves_nm, name=study.sensor.name, clear=clear)
    sensor = CurveSource({**plain.keys, "technology": study.sensor.technologies}, plain.curves)
    mosaic = study.mosaics[space.cfa]
    curve_names = _curve_names(study.sensor, space.cfa, mosaic) | dict(study.section.cfas[space.cfa].curves)
    if options.lights is None:
        spectra, types = _lights_of_run(study.lights, nodes_nm), study.lights.classes
    else:
        spectra, types = _lights_and_types(options.lights, options.of_lights)
        if "files" in spectra.keys:  # as bright as the run's lights
            spectra = CurveSource({**spectra.keys, "photon_ratio": study.lights.photon_ratio}, spectra.curves)
    scene = {str(row["scenario"]): study.section.scenarios[str(row["scenario"])]}
    keys = {"pixel": study.section.pixel, "scenarios": scene, "wavelengths": study.grid}
    note = f"{folder}: {row['name'] or design} of {space.cfa}, in scenario {row['scenario']}"
    bases = dict(space.filter.bases)
    technology = space.filter.technology
    return FilterUnderTest(mosaic, bases, sensor, spectra, types, curve_names, keys, (note,), technology, study)


def _curves_of(source: CurveSource, keys: Mapping[str, Any]) -> SensorCurves:
    """Return the curves of a sensor without a study."""
    channel = next((name for entry in source.keys["files"] for name in entry["columns"]), "G")
    return make_study(sensor=source, cfas={"any": {"tile": [[channel]]}}, **keys).study.sensor


def _lights_and_types(source: str, quantity: LightUnit | None) -> tuple[CurveSource, tuple[str, ...]]:
    """Return lights of a built-in data set or a file, and their signal types in order."""
    spectra = lights(source, quantity=quantity)
    if "files" in spectra.keys:
        return spectra, tuple(dict.fromkeys(kind for entry in spectra.keys["files"] for kind in entry["signals"]))
    return spectra, make_study(lights=spectra, cfas=[PLAIN_TILE]).study.lights.classes


def _lights_of_run(spectra: Lights, nodes_nm: Float[Array, " nodes"]) -> CurveSource:
    """Return the lights of a run, with the photons that they have in it."""
    import pandas as pd

    labels = [f"{kind} {name}" for kind, name in zip(spectra.types, spectra.names, strict=True)]
    table = pd.DataFrame(spectra.photons.T, columns=labels, index=nodes_nm)
    types = {kind: [labels[at] for at in indices] for kind, indices in spectra.members.items()}
    source = lights(table, quantity="photons", types=types)
    return CurveSource({**source.keys, "photon_ratio": spectra.photon_ratio}, source.curves)


def _curve_names(sensor: SensorCurves, cfa: str, mosaic: Mosaic) -> dict[str, str]:
    """Return the curve of each channel that is named differently."""
    return {c: name for c in mosaic.channels if (name := sensor.curve_name(cfa, c)) != c}


def _default_layout(sensor: SensorCurves) -> Layout:
    """Return the CFA with a channel to design that the sensor's curves allow."""
    if {"R", "Y", "Cy"} <= set(sensor.qe):
        return layout_of(dict.fromkeys(("R", "Y", "Cy"), 1.0))
    return layout_of({name: float(curve.sum()) for name, curve in sensor.qe.items()})


def _channel_without_curve(mosaic: Mosaic, sensor: SensorCurves) -> str:
    """Return the only channel without a curve in the sensor; raises DataError if there is none, or several."""
    without = [channel for channel in mosaic.channels if channel not in sensor.qe]
    if len(without) != 1:
        allowed = ", ".join(without or mosaic.channels)
        raise DataError(
            ValidationIssue(f"which channel of {mosaic.name} is the filter?", None, None, "--channel", None, allowed)
        )
    return without[0]


def _find_column(path: Path, curves: Curves, column: str | None, channel: str) -> str:
    """Return the stated column, the only one, or the one named like the channel."""
    names = list(curves.values)
    chosen = column or (names[0] if len(names) == 1 else channel)
    if chosen not in names:
        known, near = ", ".join(names), nearest(chosen, names)
        problem = "which column is the filter?" if column is None else "no such column"
        raise DataError(ValidationIssue(problem, str(path), None, "--column", column, known, near))
    return chosen
