"""Cost of accuracy in time: error of a CSD and time of each setting, in each scene of a study."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, replace
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
from threadpoolctl import threadpool_limits

from ...base.answer import Answer
from ...base.errors import SweepError, ValidationIssue
from ...base.types import Array, DesignNumbers, Float, Progress
from ...camera.accuracy import PRESETS, Accuracy, Preset
from ...camera.model import SceneModel
from ...camera.setup import Setup
from ...designs.block import CurveBlock, edges_of_some
from ...designs.space import Space
from ...metrics.evaluate import evaluate
from ...metrics.quantity import BEST_PHASE, Columns
from ...metrics.separation import csd_name
from ...report.panels import Lines, axis_over, png, svg
from ...report.tables import aligned
from ...results.atomic import write_bytes
from ...results.tables import write_table
from ...runs.dry_run import spread
from ...spectra.lights import class_pairs
from ...study import Study

_MOST_DESIGNS = 5
_WHOLE_NM = 1e-6
"""A range that is so near to whole steps is of whole steps."""
STEPS_NM = (10.0, 5.0, 2.0, 1.0, 0.5, 0.25)
"""Steps of the wavelengths that are measured, the finest last."""
_LEAST_DN = 1e-6
"""Errors below are drawn here."""
_WARM = Accuracy(phases_per_px=1, finest_phase_px=0.25, field_positions=2, pwm_moments=2)


@dataclass(frozen=True)
class Measured:
    """CSDs, DN, and times, s.

    `first_s`: the first design, with everything that is computed once per scene; `following_s`: each following one, NaN
    where there is none.
    """

    csds: Float[Array, "csds designs"]
    first_s: float
    following_s: float


@dataclass(frozen=True)
class Setting:
    """Setting that is measured: a preset, on wavelengths of a step."""

    preset: Preset
    step_nm: float

    def named(self, own_nm: float) -> str:
        """Return its name in a study with a step of its own: the preset's there, else the step."""
        if self.step_nm == own_nm:
            return self.preset
        return f"{self.step_nm:g} nm" if self.preset == "standard" else f"{self.preset}, {self.step_nm:g} nm"


def settings_of(own_nm: float, steps_nm: Sequence[float]) -> list[Setting]:
    """Return the settings that are measured, the finest last: it is what errors are told against."""
    steps = sorted({own_nm, *steps_nm}, reverse=True)
    by_step = [Setting("standard", step_nm) for step_nm in steps]
    return [*by_step, *(Setting("reference", step_nm) for step_nm in dict.fromkeys((own_nm, steps[-1])))]


def measure_accuracy(
    at_step: Callable[[float | None], Study], output: Path, progress: Progress, *, steps_nm: Sequence[float] = STEPS_NM
) -> Answer:
    """Measure error and time of presets, and of steps of the wavelengths, in each scene; write a table and a figure.

    Every effect is computed. The error is the largest difference of any CSD from the preset `reference` at the finest
    step, over up to 5 designs spread over the study's largest space. Each measurement is made in a process of its own,
    one after the other, with nothing but imports and machine code there before.

    `at_step`: the study with a step of its wavelengths, or with its own; only steps that divide its range are measured.
    """
    own = at_step(None)
    whole = [step_nm for step_nm in steps_nm if abs(math.remainder(own.grid.span_nm, step_nm)) < _WHOLE_NM]
    settings = settings_of(own.grid.step_nm, whole)
    studies = {each.step_nm: at_step(each.step_nm) for each in settings}
    at = max(range(len(own.spaces)), key=lambda number: own.spaces[number].size)
    numbers = spread(own.spaces[at].size)[:_MOST_DESIGNS]
    jobs, measured = [(scenario, each) for scenario in own.scenarios for each in settings], list[Measured]()
    for done, (scenario, setting) in enumerate(jobs):
        progress("measurements", done, len(jobs))
        study = studies[setting.step_nm]
        setup = replace(study.setup(study.spaces[at], scenario).with_all_effects, accuracy=PRESETS[setting.preset])
        measured.append(_in_new_process(setup, study.spaces[at], numbers))
    progress("measurements", len(jobs), len(jobs))
    rows = []
    for start in range(0, len(jobs), len(settings)):
        of_scene = measured[start : start + len(settings)]
        for (scenario, setting), one in zip(jobs[start : start + len(settings)], of_scene, strict=True):
            row = {"scenario": scenario, "setting": setting.named(own.grid.step_nm), "step_nm": setting.step_nm}
            row["error_dn"] = float(np.abs(one.csds - of_scene[-1].csds).max(initial=0.0))
            rows.append(row | {"first_s": one.first_s, "following_s": one.following_s, "designs": numbers.size})
    table = pd.DataFrame(rows)
    write_table(pa.Table.from_pandas(table, preserve_index=False), output / "accuracy.parquet")
    panel = _panel(table)
    write_bytes(png([panel]), output / "accuracy.png")
    write_bytes(svg(panel, "accuracy").encode(), output / "accuracy.svg")
    lines = [*aligned(_in_words(table)), f"Files: {output}/: accuracy.parquet, accuracy.png, accuracy.svg."]
    return Answer(lines, {"folder": str(output), "measured": table.to_dict("records")})


def _panel(table: pd.DataFrame) -> Lines:
    """Return the largest error over the time of a further design, a line for each scene over its settings."""
    lines = {}
    for scenario, rows in table.groupby("scenario", sort=False):
        known = rows.assign(s=rows["following_s"].fillna(rows["first_s"]), dn=rows["error_dn"].clip(lower=_LEAST_DN))
        known = known[~known["setting"].str.startswith("reference")].sort_values("s")
        lines[str(scenario)] = known["s"].to_numpy(dtype=float), known["dn"].to_numpy(dtype=float)
    x, y = (np.concatenate([line[at] for line in lines.values()]) for at in (0, 1))
    across, up = axis_over("time of a design", "s", x, log=True), axis_over("", "DN", y, log=True)
    return Lines("Largest error of a CSD / DN, by wavelength step", across, up, lines=lines)


def _in_words(table: pd.DataFrame) -> pd.DataFrame:
    """Return the table with digits that a person reads."""
    shown = table[["scenario", "setting"]].copy()
    shown["error / DN"] = table["error_dn"].map("{:.2g}".format)
    for name, title in (("first_s", "first design / ms"), ("following_s", "each following / ms")):
        shown[title] = (1e3 * table[name]).map("{:.3g}".format)
    return shown


def _in_new_process(setup: Setup, space: Space, numbers: DesignNumbers) -> Measured:
    """Measure designs in a process of its own; raises SweepError when that is killed."""
    try:
        with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
            return pool.submit(_measure, setup, space, numbers).result()
    except BrokenProcessPool:
        raise SweepError(ValidationIssue("the process of a measurement was killed", key="accuracy")) from None


def _measure(setup: Setup, space: Space, numbers: DesignNumbers) -> Measured:
    """Measure designs with one thread, in a process that has computed nothing but what warms it up."""
    with threadpool_limits(1):
        _warm_up(setup, space)
        started = time.perf_counter()
        model = SceneModel(setup)
        csds = [_csds(model, space, numbers[:1])]
        first_s = time.perf_counter() - started
        if numbers.size == 1:
            return Measured(csds[0], first_s, math.nan)
        started = time.perf_counter()
        csds.append(_csds(model, space, numbers[1:]))
        following_s = (time.perf_counter() - started) / (numbers.size - 1)
    return Measured(np.concatenate(csds, axis=1), first_s, following_s)


def _warm_up(setup: Setup, space: Space) -> None:
    """Load what a measurement imports and its machine code: a chart, and the scene itself behind another lens."""
    single = replace(space, axes=tuple(axis[:1] for axis in space.axes), gridded=True, listed=0)
    optics = setup.scene.optics.model_copy(update={"f_number": 1.1 * setup.scene.optics.f_number})
    elsewhere = setup.scene.model_copy(update={"optics": optics})
    chart = elsewhere.model_copy(update={"target": None, "field": None})
    for scene, n_designs in ((chart, 64), (elsewhere, 2)):
        model = SceneModel(replace(setup, scene=scene, accuracy=_WARM))
        _evaluated(model, single, np.zeros(n_designs, dtype=np.intp))


def _evaluated(model: SceneModel, space: Space, numbers: DesignNumbers) -> Columns:
    """Columns of designs, by their edges where the space is separable, as in a run; else by their curves."""
    block = edges_of_some(space, numbers)
    if block is None:
        return evaluate(model, CurveBlock(space.curves(space.points_of(numbers), model.setup.camera.grid.size)))
    return evaluate(model, block)


def _csds(model: SceneModel, space: Space, numbers: DesignNumbers) -> Float[Array, "csds designs"]:
    """All CSDs, at the best sampling phase too where all phases count."""
    columns = _evaluated(model, space, numbers)
    names = [csd_name(pair) for pair in class_pairs(model.setup.lights.classes)]
    if model.setup.all_phases:
        names += [BEST_PHASE + name for name in names]
    return np.stack([columns[name] for name in names])
