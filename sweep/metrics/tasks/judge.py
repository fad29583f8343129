"""The figures of a study's tasks, of blocks of designs, and of one design with derivatives.

A figure is the smallest of its rows where more of it is wanted, else the largest: rows are smooth, figures have kinks.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...base.types import FloatArray
from ...camera.setup import Setup
from ...curves.color import color_matching
from ...curves.tasks import Case, Chart, Conditions, GriddedTask
from ...designs.block import Block
from ..quantity import Columns
from . import color, separations
from .colorimetry import Smooth, delta_e_2000, lab, root
from .figures import CSD, D_PRIME, ERROR, LUX, MEAN, MOST, MOST_95, SMI, SNR, SNR_AT_1_LX, VORA, figures_of
from .looks import Looks

LUMINANCE_RATIO = 10.0
"""The luminance SNR that low light is judged by."""
_BLOCK = 128
_MOST_DISTANCES = 2_000_000
"""Designs that are judged at once, and their pairs of spectra, so that arrays stay small."""


class JudgedTask:
    """A task for some designs; what several figures share is made once."""

    def __init__(self, task: GriddedTask, looks: Looks, conditions: Conditions) -> None:
        self._task, self._looks, self._conditions = task, looks, conditions
        self._noise = looks.noise(conditions.read_noise_e)
        self._made: dict[tuple[str, Case], Smooth] = {}
        self._rows: dict[str, Callable[[Case], Smooth]] = {
            CSD: self._csd,
            D_PRIME: self._detectabilities,
            ERROR: self._errors,
            MEAN: lambda case: self._color_errors(case).mean(axis=1, keepdims=True),
            MOST_95: lambda case: _percentile(self._color_errors(case), 0.95),
            MOST: self._color_errors,
            SNR: lambda case: self._luminance_noise(case, self._conditions.illuminance_lx),
            VORA: self._vora,
            SMI: self._metamerism,
            LUX: self._least_lux,
            SNR_AT_1_LX: lambda case: self._luminance_noise(case, 1.0),
        }

    def rows(self, what: str, case: Case) -> Smooth:
        """The rows of a figure, ndarray[n, n_rows]."""
        return self._rows[what](case)

    def _once(self, key: str, case: Case, make: Callable[[], Smooth]) -> Smooth:
        if (key, case) not in self._made:
            self._made[key, case] = make()
        return self._made[key, case]

    def _at(self, case: Case) -> int:
        return self._task.key.cases.index(case)

    def _signals(self, case: Case) -> Smooth:
        """Electrons of each spectrum of a separation, as many photons as the study's lights have."""
        assert self._task.photons is not None
        photons = self._task.photons[self._at(case)] * self._looks.setup.scene.photon_radiance
        return self._once("signals", case, lambda: self._looks.electrons(photons, self._conditions.exposure_s))

    def _csd(self, case: Case) -> Smooth:
        gain = self._looks.setup.camera.pixel.dn_per_e
        return root(separations.squared_distances(self._signals(case), self._task.pairs, gain))

    def _detectabilities(self, case: Case) -> Smooth:
        return root(separations.squared_detectabilities(self._signals(case), self._task.pairs, self._noise))

    def _errors(self, case: Case) -> Smooth:
        return separations.pair_errors(separations.margins(self._signals(case), self._task.pairs, self._noise))

    @property
    def _chart(self) -> Chart:
        assert self._task.chart is not None
        return self._task.chart

    def _patches(self, case: Case) -> Smooth:
        photons = self._chart.photons[self._at(case)] * self._conditions.illuminance_lx
        return self._once("patches", case, lambda: self._looks.electrons(photons, self._conditions.exposure_s))

    def _gray(self, case: Case) -> Smooth:
        """Electrons of 18 % gray for each lx, ndarray[n, n_channels]."""
        return self._looks.electrons(self._chart.gray[self._at(case)], self._conditions.exposure_s)

    def _matrix(self, case: Case) -> Smooth:
        """The noise-optimal color matrix at the conditions' illuminance."""
        xyz, white = self._chart.xyz[self._at(case)], self._chart.white[self._at(case)]
        return self._once("matrix", case, lambda: color.color_matrix(self._patches(case), xyz, white, self._noise))

    def _color_errors(self, case: Case) -> Smooth:
        return self._once(
            "errors", case, lambda: color_errors(self._patches(case), self._matrix(case), self._chart, self._at(case))
        )

    def _luminance_noise(self, case: Case, illuminance_lx: float) -> Smooth:
        gray = self._gray(case) * illuminance_lx
        return color.luminance_noise(self._matrix(case), gray, self._noise)[:, None]

    def _least_lux(self, case: Case) -> Smooth:
        found = color.least_illuminance(self._matrix(case), self._gray(case), self._noise, LUMINANCE_RATIO)
        return found[:, None]

    def _vora(self, _: Case) -> Smooth:
        grid = self._looks.setup.camera.grid
        return color.vora(self._looks.qe * grid.nodes_nm, color_matching(grid))[:, None]

    def _metamerism(self, _: Case) -> Smooth:
        chart = self._task.index
        assert chart is not None
        electrons = self._looks.electrons(chart.photons[0], self._conditions.exposure_s)
        return color.metamerism_index(electrons, chart.xyz[0], chart.white[0])[:, None]


def color_errors(electrons: Smooth, matrix: Smooth, chart: Chart, case: int) -> Smooth:
    """CIEDE2000 of each patch of a chart after a color matrix, ndarray[n, n_patches]."""
    target = lab(chart.xyz[case], chart.white[case])
    return delta_e_2000(lab(electrons @ matrix, np.ones(3)), target)


def _percentile(values: Smooth, share: float) -> Smooth:
    """The percentile over the last axis, linear between neighbors in order, ndarray[n, 1]."""
    ordered = np.take_along_axis(values, np.argsort(values.real, axis=1, kind="stable"), axis=1)
    at, rest = divmod(share * (values.shape[1] - 1), 1.0)
    low, high = ordered[:, int(at)], ordered[:, min(int(at) + 1, values.shape[1] - 1)]
    return np.asarray(low + rest * (high - low))[:, None]


def task_columns(setup: Setup, block: Block) -> Columns:
    """Every figure of a setup's tasks, ndarray[n_designs] each."""
    tasks = setup.tasks
    assert tasks is not None
    curves = block.curves()
    parts: list[dict[str, FloatArray]] = []
    pairs = max((len(task.pairs[0]) for task in tasks.tasks if task.photons is not None), default=1)
    size = max(1, min(_BLOCK, _MOST_DISTANCES // pairs))
    for start in range(0, len(curves), size):
        looks = Looks(setup, curves[start : start + size])
        found: dict[str, FloatArray] = {}
        for task in tasks.tasks:
            judged = JudgedTask(task, looks, tasks.conditions)
            for name, figure, case in figures_of(task.key):
                rows = judged.rows(figure.what, case)
                found[name] = rows.max(axis=1) if figure.wanted == "less" else rows.min(axis=1)
        parts.append(found)
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
