"""Figures of a study's tasks, for batches of designs, and for one design with derivatives.

A figure is the smallest of its rows if more is wanted, else the largest: rows are smooth, figures are not.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from ...base.types import FloatArray, PerDesign
from ...camera.noise.gaussian import share_below
from ...camera.setup import Setup
from ...designs.block import Block
from ...metrics.complex_step import Smooth, root
from ...metrics.discrimination import dprime, margin
from ...metrics.quantity import Columns
from ...spectra.color import color_matching
from . import color
from .color import PatchCamera
from .colorimetry import delta_e_2000, lab
from .figures import CSD, D_PRIME, ERROR, LUX, MEAN, MOST, MOST_95, SMI, SNR, SNR_AT_1_LX, VORA, figures_of
from .spectra import Chart, Conditions, GriddedTask, LightName, tasks_in

LUMINANCE_RATIO = 10.0
"""The luminance SNR that low light is judged by."""
REGULARIZATIONS = np.geomspace(1e-3, 1e4, 29)
"""How much the noise counts in a color matrix; 1 is the noise-optimal one."""
_BLOCK = 128
_MOST_DISTANCES = 2_000_000
"""Designs that are judged at once, and their pairs of spectra, so that arrays stay small."""


class TaskEvaluation:
    """Task for some designs; common parts of several figures are computed once."""

    def __init__(self, task: GriddedTask, patch_camera: PatchCamera, conditions: Conditions) -> None:
        self._task, self._patch_camera, self._conditions = task, patch_camera, conditions
        self._noise = patch_camera.noise(conditions.read_noise_e)
        self._made: dict[tuple[str, LightName], Smooth] = {}
        self._rows: dict[str, Callable[[LightName], Smooth]] = {
            CSD: self._csd,
            D_PRIME: lambda case: dprime(*self._apart(case)),
            ERROR: lambda case: pair_errors(margin(*self._apart(case))),
            MEAN: lambda case: self._color_errors(case).mean(axis=1, keepdims=True),
            MOST_95: lambda case: _percentile(self._color_errors(case), 0.95),
            MOST: self._color_errors,
            SNR: lambda case: self._luminance_noise(case, self._conditions.illuminance_lx),
            VORA: self._vora,
            SMI: self._metamerism,
            LUX: self._least_lux,
            SNR_AT_1_LX: lambda case: self._luminance_noise(case, 1.0),
        }

    def rows(self, what: str, case: LightName) -> Smooth:
        """Return the rows of a figure."""
        return self._rows[what](case)

    def _once(self, key: str, case: LightName, make: Callable[[], Smooth]) -> Smooth:
        if (key, case) not in self._made:
            self._made[key, case] = make()
        return self._made[key, case]

    def _at(self, case: LightName) -> int:
        return self._task.columns.lights.index(case)

    def _signals(self, case: LightName) -> Smooth:
        """Return electrons of each spectrum of a separation, with the photons of the study's lights."""
        assert self._task.photons is not None
        photons = self._task.photons[self._at(case)] * self._patch_camera.setup.scene.photon_radiance
        return self._once("signals", case, lambda: self._patch_camera.electrons(photons, self._conditions.exposure_s))

    def _apart(self, case: LightName) -> tuple[Smooth, Smooth, Smooth]:
        """Return differences of the pairs of spectra of two classes, and both variances."""
        signals, (first, second) = self._signals(case), self._task.pairs
        variance = self._noise.of(signals)
        return signals[:, first] - signals[:, second], variance[:, first], variance[:, second]

    def _csd(self, case: LightName) -> Smooth:
        return root(((self._patch_camera.setup.camera.pixel.dn_per_e * self._apart(case)[0]) ** 2).sum(axis=-1))

    @property
    def _chart(self) -> Chart:
        assert self._task.chart is not None
        return self._task.chart

    def _patches(self, case: LightName) -> Smooth:
        photons = self._chart.photons[self._at(case)] * self._conditions.illuminance_lx
        return self._once("patches", case, lambda: self._patch_camera.electrons(photons, self._conditions.exposure_s))

    def _gray(self, case: LightName) -> Smooth:
        """Return electrons of 18 % gray per lx."""
        return self._patch_camera.electrons(self._chart.gray[self._at(case)], self._conditions.exposure_s)

    def _matrix(self, case: LightName) -> Smooth:
        """Return the noise-optimal color matrix at the conditions' illuminance."""
        xyz, white = self._chart.xyz[self._at(case)], self._chart.white[self._at(case)]
        return self._once("matrix", case, lambda: color.color_matrix(self._patches(case), xyz, white, self._noise))

    def _color_errors(self, case: LightName) -> Smooth:
        return self._once(
            "errors", case, lambda: color_errors(self._patches(case), self._matrix(case), self._chart, self._at(case))
        )

    def _luminance_noise(self, case: LightName, illuminance_lx: float) -> Smooth:
        gray = self._gray(case) * illuminance_lx
        return color.luminance_noise(self._matrix(case), gray, self._noise)[:, None]

    def _least_lux(self, case: LightName) -> Smooth:
        least_lux = color.least_illuminance(self._matrix(case), self._gray(case), self._noise, LUMINANCE_RATIO)
        return least_lux[:, None]

    def _vora(self, _: LightName) -> Smooth:
        grid = self._patch_camera.setup.camera.grid
        return color.vora(self._patch_camera.qe * grid.nodes_nm, color_matching(grid))[:, None]

    def _metamerism(self, _: LightName) -> Smooth:
        chart = self._task.metamerism_chart
        assert chart is not None
        electrons = self._patch_camera.electrons(chart.photons[0], self._conditions.exposure_s)
        return color.metamerism_index(electrons, chart.xyz[0], chart.white[0])[:, None]


def pair_errors(z: Smooth) -> Smooth:
    """Return the probability that Gaussian noise goes beyond a plane, with its derivative."""
    error = share_below(-z.real)
    if not np.iscomplexobj(z):
        return np.asarray(error)
    return np.asarray(error - 1j * np.exp(-(z.real**2) / 2) / math.sqrt(2 * math.pi) * z.imag)


def color_errors(electrons: Smooth, matrix: Smooth, chart: Chart, case: int) -> Smooth:
    """Return CIEDE2000 of each patch of a chart after a color matrix."""
    target = lab(chart.xyz[case], chart.white[case])
    return delta_e_2000(lab(electrons @ matrix, np.ones(3)), target)


def _percentile(values: Smooth, share: float) -> Smooth:
    """Return the percentile over the last axis, linear between neighbors in order."""
    ordered = np.take_along_axis(values, np.argsort(values.real, axis=1, kind="stable"), axis=1)
    at, rest = divmod(share * (values.shape[1] - 1), 1.0)
    low, high = ordered[:, int(at)], ordered[:, min(int(at) + 1, values.shape[1] - 1)]
    return np.asarray(low + rest * (high - low))[:, None]


def task_columns(setup: Setup, block: Block) -> Columns:
    """Return every figure of a setup's tasks."""
    tasks = tasks_in(setup)
    curves = block.curves()
    parts: list[dict[str, FloatArray]] = []
    pairs = max((len(task.pairs[0]) for task in tasks.tasks if task.photons is not None), default=1)
    size = max(1, min(_BLOCK, _MOST_DISTANCES // pairs))
    for start in range(0, len(curves), size):
        patch_camera = PatchCamera(setup, curves[start : start + size])
        figures: dict[str, FloatArray] = {}
        for task in tasks.tasks:
            evaluation = TaskEvaluation(task, patch_camera, tasks.conditions)
            for name, figure, case in figures_of(task.columns):
                rows = evaluation.rows(figure.what, case)
                figures[name] = rows.max(axis=1) if figure.direction == "less" else rows.min(axis=1)
        parts.append(figures)
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def error_against_noise(
    patch_camera: PatchCamera, chart: Chart, case: int, conditions: Conditions
) -> tuple[PerDesign, PerDesign]:
    """Return color error against noise of one design under one light, for each of `REGULARIZATIONS`.

    Returns mean CIEDE2000 of the chart, and luminance SNR of 18 % gray.
    """
    noise = patch_camera.noise(conditions.read_noise_e)
    patches = patch_camera.electrons(chart.photons[case] * conditions.illuminance_lx, conditions.exposure_s)
    gray = patch_camera.electrons(chart.gray[case] * conditions.illuminance_lx, conditions.exposure_s)
    points = []
    for regularization in REGULARIZATIONS:
        matrix = color.color_matrix(patches, chart.xyz[case], chart.white[case], noise, float(regularization))
        errors = color_errors(patches, matrix, chart, case)
        points.append((float(errors.mean()), float(color.luminance_noise(matrix, gray, noise)[0])))
    delta_e, snr = np.array(points).T
    return delta_e, snr
