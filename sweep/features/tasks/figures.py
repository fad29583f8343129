"""Figures of tasks: definition, unit, and direction of improvement."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from .spectra import LightName, TaskColumns, TaskMetric

CSD, D_PRIME, ERROR = "csd", "dprime", "error"
MEAN, MOST_95, MOST, SNR = "delta_e_mean", "delta_e_95", "delta_e_max", "snr"
VORA, SMI = "vora", "smi"
LUX, SNR_AT_1_LX = "lux", "snr_at_1_lx"


@dataclass(frozen=True)
class Figure:
    """Figure of a task.

    `each`: it has a value for each of the task's lights.
    """

    what: str
    words: str
    meaning: str
    direction: Literal["more", "less"]
    unit: str = ""
    digits: int = 3
    each: bool = True
    first: bool = False
    signed: bool = False


FIGURES: dict[TaskMetric, tuple[Figure, ...]] = {
    "separation": (
        Figure(
            CSD,
            "CSD",
            "smallest distance of two spectra of different classes of a task, all with the same photons, at the "
            "task's exposure",
            "more",
            "DN",
            1,
        ),
        Figure(
            D_PRIME,
            "d'",
            "smallest distance of two such spectra in units of the noise of four pixels (d')",
            "more",
            digits=2,
            first=True,
        ),
        Figure(
            ERROR,
            "pairwise error",
            "largest probability that noise turns one such spectrum into the other, over all pairs",
            "less",
            digits=6,
        ),
    ),
    "color": (
        Figure(
            MEAN,
            "mean error",
            "color difference CIEDE2000 of a chart's 24 patches after the noise-optimal color matrix, mean",
            "less",
            digits=2,
            first=True,
        ),
        Figure(MOST_95, "95 % error", "the same, 95th percentile", "less", digits=2),
        Figure(MOST, "largest error", "the same, largest", "less", digits=2),
        Figure(
            SNR,
            "luminance SNR",
            "luminance of 18 % gray over its noise after that matrix, of four pixels at the task's illuminance",
            "more",
            digits=1,
            first=True,
        ),
        Figure(
            VORA,
            "Vora value",
            "share of the space of the color-matching functions that the channels span",
            "more",
            each=False,
            first=True,
        ),
        Figure(
            SMI,
            "metamerism index",
            "sensitivity metamerism index of ISO 17321-1: 100 - 5.5 times the mean CIELAB distance of 18 patches under "
            "D50 with the best matrix",
            "more",
            digits=1,
            each=False,
            first=True,
            signed=True,
        ),
    ),
    "low_light": (
        Figure(
            LUX,
            "illuminance for SNR 10",
            "illuminance at which 18 % gray has a luminance SNR of 10 after the color matrix, of four pixels",
            "less",
            "lx",
            1,
            first=True,
        ),
        Figure(SNR_AT_1_LX, "luminance SNR at 1 lx", "the luminance SNR at 1 lx", "more"),
    ),
}
"""The figures of each metric, in order."""


def figures_of(task: TaskColumns) -> Iterator[tuple[str, Figure, LightName]]:
    """Yield all figures of a task."""
    for figure in FIGURES[task.metric]:
        for case in task.lights if figure.each else ("",):
            yield task.column(figure.what, case), figure, case
