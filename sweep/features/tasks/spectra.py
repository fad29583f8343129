"""Tasks beyond traffic lights, such as color and vehicle lamps: their spectra, conditions and column names."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ...base.types import Array, Float, IndexArray, Int
from ...camera.setup import Feature, Setup

TaskMetric = Literal["color", "low_light", "separation"]
"""Kind of a task, which sets its figures: color reproduction, noise in low light, or separation of classes."""
LightName = str
"""Key of `ILLUMINANTS`; empty for a task whose spectra are lamps themselves."""

SHIPPED: Mapping[str, str] = {
    "color": "color error of 24 chart patches after a color matrix, under daylight, CIE A, a white LED and sodium",
    "low_light": "illuminance at which gray reaches a luminance SNR of 10",
    "vehicle_lamps": "brake red, turn amber and reversing white",
    "emergency": "emergency blue and white headlamps",
    "road_marking": "white and yellow road markings",
    "traffic_signs": "six colors of traffic signs",
    "vegetation": "leaves in daylight and green signals",
    "unseen_lamps": "green, yellow and red lamps that no search uses",
}
"""Subject of each built-in task, by the name of the task."""

ILLUMINANTS: Mapping[str, tuple[str, str]] = {
    "d65": ("cie_illuminants", "D65"),
    "d50": ("cie_illuminants", "D50"),
    "a": ("cie_illuminants", "A"),
    "led": ("cie_illuminants", "LED-B3"),
    "hps": ("cie_illuminants", "HP1"),
    "lps": ("light_sources", "LPS"),
}
"""Illuminants by their names in columns, as (group, spectrum) of `builtin.spectra`: CIE daylight D65 and D50, CIE A
(incandescent), a white LED, and high- and low-pressure sodium lamps."""


@dataclass(frozen=True)
class TaskColumns:
    """Columns of a task in the result table."""

    name: str
    metric: TaskMetric
    lights: tuple[LightName, ...]

    def column(self, figure: str, light: LightName = "") -> str:
        """Return the name of a column: `<task>_<figure>_<light>`, or `<task>_<figure>` without a light.

        `light`: light; empty for a figure that depends on none.
        """
        return "_".join(part for part in (self.name, figure, light) if part)


@dataclass(frozen=True)
class Chart:
    """Patches of a chart under each light.

    `photons`: photon radiance of the patches at an illuminance of 1 lx, photons/s/sr/m2/nm; `gray`: photon radiance of
    an 18 % gray patch at 1 lx, photons/s/sr/m2/nm; `xyz`: CIE 1931 tristimulus values of the patches, relative to Y = 1
    of the perfect reflecting diffuser; `white`: CIE 1931 tristimulus values of the perfect reflecting diffuser, Y = 1.
    """

    photons: Float[Array, "lights patches wavelengths"]
    gray: Float[Array, "lights wavelengths"]
    xyz: Float[Array, "lights patches 3"]
    white: Float[Array, "lights 3"]


@dataclass(frozen=True)
class GriddedTask:
    """Task with its spectra on the wavelength grid.

    A separation has `types` and `photons`; the other metrics have a `chart`.

    `photons`: photon spectra, each scaled to an integral of 1 over the grid, 1/nm; `metamerism_chart`: patches of ISO
    17321-1 under D50, for the sensitivity metamerism index of a color task.
    """

    columns: TaskColumns
    types: tuple[str, ...] = ()
    photons: Float[Array, "lights spectra wavelengths"] | None = None
    chart: Chart | None = None
    metamerism_chart: Chart | None = None

    @property
    def pairs(self) -> tuple[Int[IndexArray, " pairs"], Int[IndexArray, " pairs"]]:
        """Indices (first, second) of all pairs of spectra of different classes."""
        types = np.asarray(self.types)
        first, second = np.triu_indices(len(types), 1)
        differ = types[first] != types[second]
        return first[differ], second[differ]


@dataclass(frozen=True)
class Conditions:
    """Conditions of all tasks."""

    exposure_s: float
    read_noise_e: float
    illuminance_lx: float


@dataclass(frozen=True)
class StudyTasks(Feature):
    """Tasks of a study: built-in ones, then its own."""

    conditions: Conditions
    tasks: tuple[GriddedTask, ...]

    @property
    def columns(self) -> tuple[TaskColumns, ...]:
        """Columns of each task."""
        return tuple(task.columns for task in self.tasks)

    @property
    def by_name(self) -> Mapping[str, GriddedTask]:
        """Tasks by name."""
        return {task.columns.name: task for task in self.tasks}


def tasks_in(setup: Setup) -> StudyTasks:
    """Return the tasks that a setup carries."""
    tasks = setup.features["tasks"]
    assert isinstance(tasks, StudyTasks)
    return tasks
