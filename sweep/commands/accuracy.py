"""What accuracy costs in time: presets and single settings, their error in a CSD and their time, in each scene."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa

from ..base.errors import StudyError
from ..base.types import IndexArray, Progress
from ..camera.accuracy import PRESETS, REFERENCE, STANDARD, Accuracy
from ..camera.setup import Setup
from ..designs.space import Space
from ..report.accuracy_figure import PRESET, draw_accuracy
from ..report.figures import pictures_of
from ..results.atomic import write_bytes
from ..results.tables import write_table
from ..study import Study
from .accuracy_report import make_accuracy_report, read_hard_cases, told
from .accuracy_timing import MANY, Measured, denser, in_new_process, spread

TABLE, FIGURE = "accuracy.parquet", "accuracy"
_REFERENCE, _UNREFINED, GRID = "reference", "phases_per_px", "grid_step_nm"
SETTINGS: Mapping[str, Sequence[Any]] = {
    _UNREFINED: (1, 4, 16, 64),
    "finest_phase_px": (1 / 32, 1 / 128, 1 / 512),
    "field_positions": (5, 9, 17, 33, 129),
    "rays": (1, 4, 16, None),
    "psf_step_nm": (20.0, 10.0, 5.0, 2.0, 1.0),
    "pwm_moments": (2, 5, 17, 65),
    "single_precision": (True,),
    GRID: (5.0, 1.0, 0.25),
}
"""Values of single settings; phases per pixel are without refinement. `GRID`: the step of the wavelength grid, nm."""
_FINEST_GRID_NM = 0.125
_COMPARED = 42
"""Designs that are compared, at most."""
Regridded = Callable[[float], Study]


@dataclass(frozen=True)
class Setting:
    """A preset or a single setting with its value; `step_nm`: of the wavelength grid, None for the study's own."""

    name: str
    value: str
    accuracy: Accuracy
    step_nm: float | None = None


def measure_accuracy(
    study: Study,
    regridded: Regridded,
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
        Told how many measurements are done.
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
    table = pd.DataFrame(_measurements(_Bench(study, regridded, seconds), settings, presets, progress))
    write_table(pa.Table.from_pandas(table, preserve_index=False), output / TABLE)
    pictures = pictures_of(lambda: draw_accuracy(table, study.name), ("png", "svg"))
    for kind, content in pictures.items():
        write_bytes(content, output / f"{FIGURE}.{kind}")
    lines = told(table, hard)
    make_accuracy_report(output, study, lines, pictures["png"], table, hard)
    return [*lines, f"Files: {output}/: accuracy.html, {TABLE}, {FIGURE}.png, {FIGURE}.svg."]


def _settings_of(
    setup: Setup, first: bool, settings: Mapping[str, Sequence[Any]], presets: Sequence[str]
) -> Iterator[Setting]:
    """The presets, and those single settings that can change anything in a scene; `first`: it is the first."""
    for name in dict.fromkeys((*presets, _REFERENCE)):
        yield Setting(PRESET, name, PRESETS[name])
    drive = setup.scene.drive
    active = {
        _UNREFINED: setup.all_phases,
        "finest_phase_px": setup.all_phases,
        "field_positions": setup.all_heights,
        "rays": bool(setup.camera.moving),
        "psf_step_nm": setup.scene.target is not None,
        "pwm_moments": drive is not None and drive.duty < 1 and not setup.linear,
        "single_precision": first,
        GRID: first,
    }
    for name, values in settings.items():
        for value in values if active[name] else ():
            if name == GRID:
                yield Setting(name, f"{value:g}", STANDARD, None if value == setup.camera.grid.step_nm else value)
            else:
                changes = {name: value} | ({"finest_phase_px": 0.0} if name == _UNREFINED else {})
                yield Setting(name, _text(value), STANDARD.model_copy(update=changes))


def _text(value: Any) -> str:
    """A value as a study file has it; a part of one as a fraction."""
    if value is None or isinstance(value, bool):
        return {None: "null", True: "true", False: "false"}[value]
    return f"1/{1 / value:g}" if 0 < value < 1 else f"{value:g}"


@dataclass(frozen=True)
class _Bench:
    """A study whose largest space is measured; the same settings of a scene are measured once."""

    study: Study
    regridded: Regridded
    seconds: float
    known: dict[tuple[str, Accuracy, float | None], Measured] = field(default_factory=dict)

    @property
    def space(self) -> Space:
        """The designs that are measured."""
        return _largest(self.study)

    @property
    def numbers(self) -> IndexArray:
        """Which of them, ndarray[n_designs]."""
        return spread(self.space.size)[:_COMPARED]

    def measured(self, scenario: str, accuracy: Accuracy, step_nm: float | None = None) -> Measured:
        """CSDs and times of a scene with every effect."""
        key = scenario, accuracy, step_nm
        if key not in self.known:
            study = self.study if step_nm is None else self.regridded(step_nm)
            space = _largest(study)
            dense = denser(space) if step_nm is None and accuracy in PRESETS.values() else None
            setup = replace(study.setup(space, scenario).with_all_effects, accuracy=accuracy)
            self.known[key] = in_new_process(setup, space, self.numbers, dense, self.seconds)
        return self.known[key]

    def compared(self, scenario: str, setting: Setting) -> tuple[Measured, Measured] | None:
        """A setting and what it is compared with; None where the study cannot be brought to its wavelengths."""
        if setting.name != GRID:
            return self.measured(scenario, setting.accuracy), self.measured(scenario, REFERENCE)
        try:
            for step_nm in (_FINEST_GRID_NM, setting.step_nm):
                if step_nm is not None:
                    self.regridded(step_nm)
        except (StudyError, ValueError):  # the step does not divide the range, or curves are not that fine
            return None
        exact = self.measured(scenario, REFERENCE, _FINEST_GRID_NM)
        return self.measured(scenario, setting.accuracy, setting.step_nm), exact


def _largest(study: Study) -> Space:
    return max(study.spaces, key=lambda space: space.size)


def _measurements(
    bench: _Bench, settings: Mapping[str, Sequence[Any]], presets: Sequence[str], progress: Progress
) -> Iterator[dict[str, Any]]:
    """Rows of the table."""
    jobs = [
        (scenario, setting)
        for at, scenario in enumerate(bench.study.scenarios)
        for setting in _settings_of(bench.study.setup(bench.space, scenario), at == 0, settings, presets)
    ]
    for done, (scenario, setting) in enumerate(jobs):
        progress("measurements", done, len(jobs))
        both = bench.compared(scenario, setting)
        if both is not None:
            yield from _rows(scenario, setting, *both, len(bench.numbers))
    progress("measurements", len(jobs), len(jobs))


def _rows(
    scenario: str, setting: Setting, result: Measured, exact: Measured, n_designs: int
) -> Iterator[dict[str, Any]]:
    """Rows of one measurement: of one design, of those of the study, and of a large sweep."""
    shared = min(result.csds.shape[1], exact.csds.shape[1])
    error = float(np.abs(result.csds[:, :shared] - exact.csds[:, :shared]).max(initial=0.0))
    counts = [1] if n_designs == 1 else [1, n_designs, MANY]
    for designs in counts:
        rest_s = 0.0 if designs == 1 else (designs - 1) * result.following_s
        many_s = result.many_s if designs == MANY else None
        yield {
            "scenario": scenario,
            "setting": setting.name,
            "value": setting.value,
            "designs": designs,
            "error_dn": error,
            "first_s": result.first_s,
            "following_s": result.following_s if many_s is None else (many_s - result.first_s) / (designs - 1),
            "total_s": result.first_s + rest_s if many_s is None else many_s,
            "extrapolated": many_s is None and designs > result.csds.shape[1],
        }
