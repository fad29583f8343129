"""Evaluate one filter, from a file of curves or from a finished run."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from ..base.disk import is_folder
from ..base.errors import DataError, ValidationIssue, nearest
from ..camera.mosaic import Mosaic
from ..camera.sensor import SensorCurves
from ..metrics.separation import csd_name
from ..spectra.formats import files_in, read_curves
from ..spectra.lights import class_pairs, in_order
from ..spectra.spectrum import Curves, Quantity
from ..spectra.units import FITTING, Use, light_unit, stated_quantity, used_as
from ..study import Study
from ..study.shipped import shipped_folder
from .channels import NEW, RATIO, Layout, layout_of, sensor_file
from .filter_evaluation import FilterEvaluation, evaluate_filter, with_base
from .loading import lights as lights_of
from .loading import load_study, make_study, sensor_source
from .own_designs import space_of_curves

_ASKED = "stopband"
"""Study of the package whose constraints a filter from a file is held against."""
_OF_A_RUN = ("manifest.json", "provenance.json")


def evaluate(
    source: Path | str,
    *,
    design: str | int | None = None,
    column: str | None = None,
    channel: str | None = None,
    cfa: str | None = None,
    base: str | None = None,
    sensor: str | None = None,
    lights: str | None = None,
    quantity: str | Sequence[str] | None = None,
    relative_to: str | None = None,
    transmission: bool = False,
    data: Path | str | None = None,
    allow_code: bool = False,
) -> FilterEvaluation:
    """Evaluate one filter beside RGGB, the CFA that it changes, and its upper bound.

    Parameters
    ----------
    source : path-like
        A file with the filter's curve, or the folder of a finished run.
    design : str or int, optional
        A design of the run: a `filter_id`, a name (paper_N4, RGGB), or ``best`` (default).
    column : str, optional
        Column of the file; left out, the only one, or that of the channel.
    channel, cfa : str, optional
        Channel of a CFA that the filter of a file is for; left out, one that the sensor allows (N of RYNCy).
    base : str, optional
        Curve that it replaces; left out, that of the pixel diagonal to it.
    sensor : str, optional
        A built-in sensor or a file of QE curves; left out, ar0820. A run has its own.
    lights : str, optional
        Built-in lights or a file of spectra; left out, tl16, or those of the run.
    quantity : str or sequence of str, optional
        Units that heads do not tell (``qe``, ``transmission``, ``density``, ``energy``, ``photons``, ...).
    relative_to : str, optional
        The values are transmissions, to be multiplied by this curve of the sensor.
    transmission : bool
        The values are transmissions, to be multiplied by the clear pixel, or else the brightest curve.
    data : path-like, optional
        Folder of the files of a run.
    allow_code : bool
        Permit the code that a run was made with to run.

    Returns
    -------
    FilterEvaluation
        ``table`` of the CFAs, ``upper_bound``, DN (or ``no_upper_bound``, why there is none), ``gap`` to it, relative
        to it (0 to 1), constraints that are ``violated``: those of the run, or for a file of the study ``stopband``;
        printed, it is the text of `sweep evaluate`.

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
    path, of_a_run = Path(source), is_folder(Path(source)) and not _holds_curves(Path(source))
    words = [quantity] if isinstance(quantity, str) else list(quantity or ())
    stated = [stated_quantity(word) for word in words]
    of_file: dict[str, Any] = {"column": column, "channel": channel, "cfa": cfa, "base": base, "sensor": sensor}
    of_file |= {"relative-to": relative_to, "transmission": transmission}
    of_run = {"design": design, "data": data, "allow-code": allow_code}
    for key, value in (of_file if of_a_run else of_run).items():
        if value:
            problem = f"`{key}` requires {'a file of curves' if of_a_run else 'a run folder'}"
            raise DataError(ValidationIssue(problem, str(path), None, f"--{key}", str(value)))
    if of_a_run:
        return _of_run(path, design, lights, stated, None if data is None else Path(data), allow_code=allow_code)
    study = _study_of_file(sensor or "ar0820", lights or "tl16", stated)
    layout = _default_layout(study.sensor)
    mosaic = Mosaic.from_name(cfa or layout.changed)
    channel = channel or _channel_without_curve(mosaic, study.sensor)
    if channel not in mosaic.channels:
        known, near = ", ".join(mosaic.channels), nearest(channel, mosaic.channels)
        raise DataError(
            ValidationIssue(f"no such channel of {mosaic.name}", None, None, "--channel", channel, known, near)
        )
    usual = layout.base if (mosaic.name, channel) == (layout.changed, NEW) else None
    base = base or usual or _diagonal_curve(mosaic, channel, study.sensor)
    study.sensor.curve(base)
    curves = read_curves(path)
    column = _find_column(path, curves, column, channel)
    use, unit = _use_of(curves, column, stated, transmission=bool(relative_to) or transmission)
    factor = relative_to or (study.sensor.clear if transmission else base if use == "filter" else None)
    used = used_as(curves, [column], use, unit)
    curve = used.on(study.grid, column) * (1.0 if factor is None else study.sensor.curve(factor))
    times = "" if factor is None else f", times {factor}"
    note = f"{path}: {used.notes[-1]}{times}; it is {channel} of {mosaic.name}, in place of {base}"
    space = space_of_curves(mosaic.name, {channel: base}, curve[None, None], None)
    alike = with_base(mosaic, {channel: base}).name
    return evaluate_filter(study, mosaic, space, _curve_names(study.sensor, alike, mosaic), [note])


def _holds_curves(folder: Path) -> bool:
    """Return whether a folder holds files of curves, and no run."""
    try:
        return not any(os.path.lexists(folder / name) for name in _OF_A_RUN) and bool(files_in(folder))
    except DataError:
        return False


def _study_of_file(sensor: str, lights: str, stated: Sequence[Quantity]) -> Study:
    """Return a study of a sensor and lights, with the constraints that a filter from a file is held against."""
    source, folder = sensor_source(sensor, {}), shipped_folder()
    keys: dict[str, Any] = {"sensor": source, **_lit(lights, stated)}
    if os.path.lexists(sensor):
        start_nm, stop_nm = sensor_file(Path(sensor)).range_nm
        keys["wavelengths"] = {"start_nm": start_nm, "stop_nm": stop_nm}
    if folder is not None:
        asked = load_study(folder / f"{_ASKED}.yaml").study
        keys |= {"study": asked.name, "constraints": dict(asked.constraints)}
    channel = next((name for entry in source.keys["files"] for name in entry["columns"]), "G")
    return make_study(cfas={"any": {"tile": [[channel]]}}, **keys).study


def _use_of(
    curves: Curves, column: str, stated: Sequence[Quantity], *, transmission: bool
) -> tuple[Use, Quantity | None]:
    """Return whether a column is QE or transmissions, and its quantity where it is stated or known."""
    unit = next((quantity for quantity in stated if quantity in (*FITTING["sensor"], *FITTING["filter"])), None)
    told = unit or curves.units[column].quantity
    if told is not None and not transmission:
        return ("sensor" if told in FITTING["sensor"] else "filter"), unit
    if told is None and any(name.startswith(f"{column}{RATIO}") for name in curves.values):
        return "sensor", "qe"  # of `sweep export`, whose transmissions stand beside it
    return "filter", unit


def _of_run(
    folder: Path,
    design: str | int | None,
    lights: str | None,
    stated: Sequence[Quantity],
    data: Path | None,
    *,
    allow_code: bool,
) -> FilterEvaluation:
    """Evaluate a design of a finished run, in the scene of its row, with the run's lights or others."""
    from ..results.designs import BEST, find_design_row, row_space, study_of
    from ..results.output import read_output

    output = read_output(folder)
    study = study_of(output, data, allow_code=allow_code)
    row = find_design_row(output, BEST if design is None else design)
    space, scenario = row_space(study, row), str(row["scenario"])
    if space.filter is None:
        raise DataError(ValidationIssue("a plain CFA has no filter to judge", str(folder), None, "--design", design))
    axes = tuple((float(row[name]),) for name in space.parameters)
    candidate = replace(space, kind="design", axes=axes, gridded=True, listed=0)
    mosaic = study.mosaics[space.cfa]
    names = _curve_names(study.sensor, space.cfa, mosaic) | dict(study.section.cfas[space.cfa].curves)
    features = {name: feature for name, feature in study.features.items() if not feature.slow}
    study = replace(study, scenarios={scenario: study.scenarios[scenario]}, warnings=(), features=features)
    if lights is not None:
        study = _under(study, _lit(lights, stated))
    name = row["name"] if isinstance(row["name"], str) else f"filter {row['filter_id']}"
    note = f"{folder}: {name} of {space.cfa}, in scenario {scenario}"
    return evaluate_filter(study, mosaic, candidate, names, [note])


def _lit(lights: str, stated: Sequence[Quantity]) -> dict[str, Any]:
    """Return keys of a study under lights, built in or in a file, whose objective is one that they have."""
    source = lights_of(lights, quantity=light_unit(stated))
    types = {kind for entry in source.keys.get("files", ()) for kind in entry["signals"]} or {"yellow", "red"}
    return {"lights": source, "objective": csd_name(class_pairs(in_order(types))[0])}


def _under(study: Study, keys: Mapping[str, Any]) -> Study:
    """Return a study under other lights, those of a file as bright as its own, without what features know of these."""
    other = make_study(**keys, cfas=["RGGB"], wavelengths=study.grid).study
    if "files" in keys["lights"].keys:
        other = replace(other, lights=replace(other.lights, photon_ratio=study.lights.photon_ratio))
    return replace(study, lights=other.lights, features={}, warnings=other.warnings)


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


def _diagonal_curve(mosaic: Mosaic, channel: str, sensor: SensorCurves) -> str:
    """Return the curve that a channel of a 2 x 2 tile replaces: that of the pixel diagonal to it."""
    rows = mosaic.rows
    at = [(r, c) for r, row in enumerate(rows) for c, name in enumerate(row) if name == channel]
    if len(rows) == len(rows[0]) == 2 and len(at) == 1:
        other = rows[1 - at[0][0]][1 - at[0][1]]
        if other in sensor.qe:
            return other
    allowed = ", ".join(sensor.qe)
    raise DataError(ValidationIssue(f"which curve does {channel} replace?", None, None, "--base", allowed=allowed))


def _find_column(path: Path, curves: Curves, column: str | None, channel: str) -> str:
    """Return the stated column, the only one, or the one named like the channel."""
    names = list(curves.values)
    chosen = column or (names[0] if len(names) == 1 else channel)
    if chosen not in names:
        known, near = ", ".join(names), nearest(chosen, names)
        problem = "which column is the filter?" if column is None else "no such column"
        raise DataError(ValidationIssue(problem, str(path), None, "--column", column, known, near))
    return chosen
