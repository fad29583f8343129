"""Tasks beside traffic lights: spectra on the wavelength grid, and names of their columns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from ..base.types import FloatArray, IndexArray

Measure = Literal["color", "low_light", "separation"]
Case = str
"""The light of a task: an illuminant's name, as columns write it; empty for a task of lamps alone."""

SHIPPED: Mapping[str, str] = {
    "color": "colors of 24 patches after a color matrix, under daylight, a filament, a white LED and a sodium lamp",
    "low_light": "how little light is enough for a clean gray",
    "vehicle_lamps": "brake red, turn amber and reversing white",
    "emergency": "emergency blue and white headlamps",
    "road_marking": "white and yellow road markings",
    "traffic_signs": "six colors of traffic signs",
    "vegetation": "leaves by day and green signals",
    "unseen_lamps": "green, yellow and red lamps that no search has seen",
}
"""Subject of every task that the package ships."""
ILLUMINANTS: Mapping[str, tuple[str, str]] = {
    "d65": ("cie_illuminants", "D65"),
    "d50": ("cie_illuminants", "D50"),
    "a": ("cie_illuminants", "A"),
    "led": ("cie_illuminants", "LED-B3"),
    "hps": ("cie_illuminants", "HP1"),
    "lps": ("light_sources", "LPS"),
}
"""Lights by the names that columns give them, as group and spectrum: daylight, a filament, a white LED, sodium lamps of
high and low pressure."""


@dataclass(frozen=True)
class TaskName:
    """Name, metric and lights of a task's columns."""

    name: str
    metric: Measure
    cases: tuple[Case, ...]

    def column(self, what: str, case: Case = "") -> str:
        """Return a column name: `<task>_<what>`, and the light if there are several.

        Parameters
        ----------
        what : str
            Figure.
        case : str
            Light.

        Returns
        -------
        str
            Text.
        """
        return "_".join(part for part in (self.name, what, case) if part)


@dataclass(frozen=True)
class Chart:
    """Patches of a chart under several lights.

    Parameters
    ----------
    photons : ndarray of shape (n_cases, n_patches, n_wavelengths)
        Photon radiance at 1 lx, per nm.
    gray : ndarray of shape (n_cases, n_wavelengths)
        The same of 18 % gray.
    xyz : ndarray of shape (n_cases, n_patches, 3)
        CIE 1931.
    white : ndarray of shape (n_cases, 3)
        CIE 1931 of a perfect reflector, Y = 1.
    """

    photons: FloatArray
    gray: FloatArray
    xyz: FloatArray
    white: FloatArray


@dataclass(frozen=True)
class GriddedTask:
    """Task on the wavelength grid.

    Parameters
    ----------
    key : TaskName
        Names.
    types : tuple of str
        Class of each spectrum of a separation.
    photons : ndarray of shape (n_cases, n_spectra, n_wavelengths), optional
        Spectra that integrate to one photon.
    chart, index : Chart, optional
        Charts of a task of color, and of its metamerism index.
    """

    key: TaskName
    types: tuple[str, ...] = ()
    photons: FloatArray | None = None
    chart: Chart | None = None
    index: Chart | None = None

    @property
    def pairs(self) -> tuple[IndexArray, IndexArray]:
        """Both spectra of every pair of two classes."""
        kinds = np.asarray(self.types)
        first, second = np.triu_indices(len(kinds), 1)
        apart = kinds[first] != kinds[second]
        return first[apart], second[apart]


@dataclass(frozen=True)
class Conditions:
    """Conditions of all tasks: exposure, read noise, and illuminance of charts."""

    exposure_s: float
    read_noise_e: float
    illuminance_lx: float


@dataclass(frozen=True)
class StudyTasks:
    """Tasks of a study, their conditions, and spectra from its files."""

    conditions: Conditions
    tasks: tuple[GriddedTask, ...]
    from_files: Mapping[tuple[str, str], FloatArray] = field(default_factory=dict)

    @property
    def keys(self) -> tuple[TaskName, ...]:
        """Names of the tasks, as in column names."""
        return tuple(task.key for task in self.tasks)

    @property
    def by_name(self) -> Mapping[str, GriddedTask]:
        """Tasks by name."""
        return {task.key.name: task for task in self.tasks}
