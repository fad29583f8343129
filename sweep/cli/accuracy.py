"""Cost of accuracy in time: presets and single settings, their error in a CSD and their time, in each scene."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, replace
from functools import cache
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
from threadpoolctl import threadpool_limits

from ..base.errors import StudyError, SweepError, ValidationIssue
from ..base.types import FloatArray, IndexArray, Progress
from ..camera.accuracy import PRESETS, REFERENCE, STANDARD, Accuracy
from ..camera.forward import ForwardModel
from ..camera.setup import Setup
from ..designs.block import CurveBlock, edges_of_some
from ..designs.space import Space
from ..metrics.evaluate import evaluate
from ..metrics.quantity import BEST_PLACE, Columns
from ..metrics.separation import csd_name
from ..report.accuracy_figure import PRESET, draw_accuracy
from ..report.figures import pictures_of
from ..results.atomic import write_bytes
from ..results.identity import CHUNK
from ..results.tables import write_table
from ..spectra.lights import class_pairs
from ..study import Study
from .accuracy_report import make_accuracy_report, read_hard_cases, summary

SETTINGS: Mapping[str, Sequence[Any]] = {
    "phases_per_px": (1, 4, 16, 64),
    "finest_phase_px": (1 / 32, 1 / 128, 1 / 512, 1 / 8192),
    "field_positions": (5, 9, 17, 33, 129),
    "rays": (1, 4, 16, None),
    "psf_step_nm": (20.0, 10.0, 5.0, 2.0, 1.0),
    "pwm_moments": (2, 5, 17, 65),
    "single_precision": (True,),
    "grid_step_nm": (5.0, 1.0, 0.25),
}
"""Values of single settings; phases per pixel are without refinement. `grid_step_nm`: step of the wavelength grid."""
_FINEST_GRID_NM = 0.125
_MOST_COMPARED = 42
_LARGE_SWEEP = 10_000
_SHORT_S = 0.1
"""The large sweep is measured where the compared designs take less; longer computations are not repeated."""
_WARM = Accuracy(phases_per_px=1, finest_phase_px=0.25, field_positions=2, pwm_moments=2)


@dataclass(frozen=True)
class Setting:
    """A preset or a single setting with its value; `step_nm`: of the wavelength grid, None for the study's."""

    name: str
    value: str
    accuracy: Accuracy
    step_nm: float | None = None


@dataclass(frozen=True)
class Measured:
    """CSDs, ndarray[n_csds, n_designs], of the designs that fitted into the time, and times.

    `first_s`: time of the first design, including everything that is computed once per scene, s; `following_s`: of
    each following one, NaN without any; `many_s`: of all of a large sweep, None where that was not measured.
    """

    csds: FloatArray
    first_s: float
    following_s: float
    many_s: float | None


def measure_accuracy(
    study: Study,
    regridded: Callable[[float], Study],
    output: Path,
    progress: Progress,
    *,
    settings: Mapping[str, Sequence[Any]] = SETTINGS,
    presets: Sequence[str] = tuple(PRESETS),
    seconds: float = 6.0,
) -> list[str]:
    """Measure error and time of presets and single settings in each scene; write a table, a figure and a page.

    Every effect is computed. The error is the largest difference of any CSD from the reference settings, over up to 42
    designs of the study's largest space. Each measurement is made in a process of its own, one after the other, and
    nothing but imports and machine code is there before.

    Parameters
    ----------
    study : Study
        Scenes and designs.
    regridded : callable
        From a wavelength step, nm, to the study on that grid; raises StudyError or ValueError where there is none.
    output : Path
        Folder of the results; a table of hard cases that lies there goes onto the page.
    progress : callable
        Receives the number of measurements that are done.
    settings : mapping
        Values of single settings, by the names of `Accuracy`, and steps of the wavelength grid, nm.
    presets : sequence of str
        Presets that are measured; the reference always is.
    seconds : float
        Time for the following designs of one measurement, s; more of them are extrapolated.

    Returns
    -------
    list of str
        For each scene error and time of the presets, and where the files lie.

    Raises
    ------
    OutputError
        When the folder cannot be written, or its table of hard cases is damaged.
    """
    hard = read_hard_cases(output)
    n_designs = min(_largest(study).size, _MOST_COMPARED)

    @cache
    def measured(scenario: str, accuracy: Accuracy, step_nm: float | None = None) -> Measured:
        gridded = study if step_nm is None else regridded(step_nm)
        space = _largest(gridded)
        setup = replace(gridded.setup(space, scenario).with_all_effects, accuracy=accuracy)
        dense = denser(space) if step_nm is None and accuracy in PRESETS.values() else None
        return _in_new_process(setup, space, spread(space.size)[:_MOST_COMPARED], dense, seconds)

    def rows() -> Iterator[dict[str, Any]]:
        jobs = [
            (scenario, setting)
            for at, scenario in enumerate(study.scenarios)
            for setting in _settings_of(study.setup(_largest(study), scenario), at == 0, settings, presets)
        ]
        for done, (scenario, setting) in enumerate(jobs):
            progress("measurements", done, len(jobs))
            finest_nm = _FINEST_GRID_NM if setting.name == "grid_step_nm" else None
            try:
                for step_nm in (finest_nm, setting.step_nm):
                    if step_nm is not None:
                        regridded(step_nm)
            except (StudyError, ValueError):  # the step does not divide the range, or curves are not that fine
                continue
            exact = measured(scenario, REFERENCE, finest_nm)
            yield from _rows(scenario, setting, measured(scenario, setting.accuracy, setting.step_nm), exact, n_designs)
        progress("measurements", len(jobs), len(jobs))

    table = pd.DataFrame(rows())
    write_table(pa.Table.from_pandas(table, preserve_index=False), output / "accuracy.parquet")
    pictures = pictures_of(lambda: draw_accuracy(table, study.name), ("png", "svg"))
    for kind, content in pictures.items():
        write_bytes(content, output / f"accuracy.{kind}")
    lines = summary(table, hard)
    make_accuracy_report(output, study, lines, pictures["png"], table, hard)
    return [*lines, f"Files: {output}/: accuracy.html, accuracy.parquet, accuracy.png, accuracy.svg."]


def _largest(study: Study) -> Space:
    return max(study.spaces, key=lambda space: space.size)


def _settings_of(
    setup: Setup, first: bool, settings: Mapping[str, Sequence[Any]], presets: Sequence[str]
) -> Iterator[Setting]:
    """Presets, and those single settings that can change anything in a scene; `first`: it is the first."""
    for name in dict.fromkeys((*presets, "reference")):
        yield Setting(PRESET, name, PRESETS[name])
    drive = setup.scene.drive
    active = {
        "phases_per_px": setup.all_phases,
        "finest_phase_px": setup.all_phases,
        "field_positions": setup.all_heights,
        "rays": bool(setup.camera.moving),
        "psf_step_nm": setup.scene.target is not None,
        "pwm_moments": drive is not None and drive.duty < 1 and not setup.linear,
        "single_precision": first,
        "grid_step_nm": first,
    }
    for name, values in settings.items():
        for value in values if active[name] else ():
            if name == "grid_step_nm":
                yield Setting(name, f"{value:g}", STANDARD, None if value == setup.camera.grid.step_nm else value)
                continue
            if value is None or isinstance(value, bool):
                text = {None: "null", True: "true", False: "false"}[value]
            else:
                text = f"1/{1 / value:g}" if 0 < value < 1 else f"{value:g}"
            changes = {name: value} | ({"finest_phase_px": 0.0} if name == "phases_per_px" else {})
            yield Setting(name, text, STANDARD.model_copy(update=changes))


def _rows(
    scenario: str, setting: Setting, result: Measured, exact: Measured, n_designs: int
) -> Iterator[dict[str, Any]]:
    """Rows of one measurement: of one design, of those of the study, and of a large sweep."""
    shared = min(result.csds.shape[1], exact.csds.shape[1])
    error = float(np.abs(result.csds[:, :shared] - exact.csds[:, :shared]).max(initial=0.0))
    for designs in [1] if n_designs == 1 else [1, n_designs, _LARGE_SWEEP]:
        following_s, total_s = result.following_s, result.first_s
        measured_s = result.many_s if designs == _LARGE_SWEEP else None
        if measured_s is not None:
            total_s, following_s = measured_s, (measured_s - result.first_s) / (designs - 1)
        elif designs > 1:
            total_s += (designs - 1) * following_s
        yield {
            "scenario": scenario,
            "setting": setting.name,
            "value": setting.value,
            "designs": designs,
            "error_dn": error,
            "first_s": result.first_s,
            "following_s": following_s,
            "total_s": total_s,
            "extrapolated": measured_s is None and designs > result.csds.shape[1],
        }


def spread(n: int) -> IndexArray:
    """Return 0 to n - 1 in an order whose every prefix covers the whole range evenly.

    Parameters
    ----------
    n : int
        Number of indices.

    Returns
    -------
    ndarray of shape (n,)
        The indices; 0 first.
    """
    golden = (math.sqrt(5) - 1) / 2
    return np.argsort(np.arange(n) * golden % 1.0, kind="stable")


def denser(space: Space) -> Space | None:
    """Refine the grid of a design space to at least 10,000 designs.

    Parameters
    ----------
    space : Space
        Design space.

    Returns
    -------
    Space or None
        Grid between the ends of the first axes; None if nothing varies.
    """
    varied = [at for at, axis in enumerate(space.axes) if max(axis) > min(axis)][:4]
    if not varied:
        return None
    count = math.ceil(_LARGE_SWEEP ** (1 / len(varied)) - 1e-9)
    axes = [
        tuple(np.linspace(min(axis), max(axis), count).tolist()) if at in varied else axis[:1]
        for at, axis in enumerate(space.axes)
    ]
    return replace(space, axes=tuple(axes), gridded=True, rows=None)


def _in_new_process(setup: Setup, space: Space, numbers: IndexArray, dense: Space | None, seconds: float) -> Measured:
    """Measure designs in a process of its own; raises SweepError when that is killed."""
    try:
        with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
            return pool.submit(_measure, setup, space, numbers, dense, seconds).result()
    except BrokenProcessPool:
        raise SweepError(ValidationIssue("the process of a measurement was killed", key="accuracy")) from None


def _measure(setup: Setup, space: Space, numbers: IndexArray, dense: Space | None, seconds: float) -> Measured:
    """Measure designs of a space with one thread, in a process that has computed nothing but what warms it up.

    As many of the designs that follow the first one are computed as fit into `seconds`.
    """
    with threadpool_limits(1):
        _warm_up(setup, space)
        started = time.perf_counter()
        model = ForwardModel(setup)
        csds = [_csds(model, space, numbers[:1])]
        first_s = time.perf_counter() - started
        rest = numbers[1:]
        if len(rest) * first_s > seconds:  # a following design takes less than the first one
            started = time.perf_counter()
            _csds(model, space, numbers[:1])
            rest = rest[: max(1, int(seconds / (time.perf_counter() - started)))]
        times: list[float] = []
        many_s = None
        while rest.size and len(times) < 3 and sum(times) < _SHORT_S:  # the shortest of up to three counts
            started = time.perf_counter()
            csds[1:] = [_csds(model, space, rest)]
            times.append(time.perf_counter() - started)
        rest_s = min(times, default=math.nan)
        if dense is not None and rest.size == len(numbers) - 1 and first_s + min(times, default=0.0) < _SHORT_S:
            many = np.arange(1, _LARGE_SWEEP) * dense.size // _LARGE_SWEEP
            started = time.perf_counter()
            for start in range(0, len(many), CHUNK):
                _evaluated(model, dense, many[start : start + CHUNK])
            many_s = first_s + time.perf_counter() - started
    return Measured(np.concatenate(csds, axis=1), first_s, rest_s / max(1, rest.size), many_s)


def _warm_up(setup: Setup, space: Space) -> None:
    """Load what a measurement imports and its machine code: a chart, and the scene itself behind another lens."""
    one = replace(space, axes=tuple(axis[:1] for axis in space.axes), gridded=True, rows=None)
    optics = setup.scene.optics.model_copy(update={"f_number": 1.1 * setup.scene.optics.f_number})
    elsewhere = setup.scene.model_copy(update={"optics": optics})
    chart = elsewhere.model_copy(update={"target": None, "field": None})
    for scene, n_designs in ((chart, 512), (elsewhere, 2)):
        model = ForwardModel(replace(setup, scene=scene, accuracy=_WARM))
        _evaluated(model, one, np.zeros(n_designs, dtype=np.intp))


def _evaluated(model: ForwardModel, space: Space, numbers: IndexArray) -> Columns:
    """Columns of designs, by their edges where the space is separable, as in a run; else by their curves."""
    block = edges_of_some(space, numbers)
    if block is None:
        return evaluate(model, CurveBlock(space.curves(space.points_of(numbers), model.setup.camera.grid.size)))
    return evaluate(model, block)


def _csds(model: ForwardModel, space: Space, numbers: IndexArray) -> FloatArray:
    """All CSDs, at the best sampling phase too where all phases count, ndarray[n_csds, n_designs]."""
    columns = _evaluated(model, space, numbers)
    names = [csd_name(pair) for pair in class_pairs(model.setup.lights.classes)]
    if model.setup.all_phases:
        names += [BEST_PLACE + name for name in names]
    return np.stack([columns[name] for name in names])
