"""The search of the study `stopband`, and random filters of any family for it."""

from __future__ import annotations

import numpy as np

from sweep.designs.families.free_form import FreeForm
from sweep.designs.families.stopband import MultiStopband
from sweep.study import load_study

from ..conftest import STUDIES

STUDY = load_study(STUDIES / "stopband.yaml")
assert STUDY.search is not None
PROBLEM = STUDY.problem(STUDY.search)


def random_filters(kind: str, count: int, rng: np.random.Generator) -> np.ndarray:
    base, green = PROBLEM.setup.camera.base_qe[0], STUDY.sensor.qe["G"]
    wave = STUDY.grid.nodes_nm
    if kind == "free_form":
        family = FreeForm(wave, base, np.arange(540.0, 701.0, 4.0))
        return family.curves(family.start(rng.uniform(size=(count, 3))))
    bands = 1 if kind == "stopband" else 2
    target = np.minimum(green, base) if kind == "stopband" else 0.05 * base
    family = MultiStopband(wave, base, target, bands)
    edges = np.sort(rng.uniform(500, 690, (count, 2 * bands)), axis=1)
    x = np.empty((count, 5 * bands))
    for band in range(bands):
        x[:, 5 * band] = edges[:, 2 * band]
        x[:, 5 * band + 2] = edges[:, 2 * band + 1]
        x[:, [5 * band + 1, 5 * band + 3]] = rng.uniform(5, 30, (count, 2))
        x[:, 5 * band + 4] = rng.uniform(0, 1, count)
    formed = (family.violation(x) <= 0).all(axis=1)
    return family.curves(x[formed])
