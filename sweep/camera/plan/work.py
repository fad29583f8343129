"""How much computing a scene takes."""

from __future__ import annotations

from typing import NamedTuple

from ..effects.base import Load
from ..methods import Methods
from ..registry import EFFECTS
from ..view import View

PLANNED_PATCH, PLANNED_TARGET = 2e8, 4e8
"""Multiplications that it takes to find a plan, for each CFA: of a patch, and of a light at a distance;
`tests/bench_work.py` measures them."""


class Work(NamedTuple):
    """Multiplications: `kernel` once, for CFAs whose tiles have one size; `each` for every design."""

    kernel: float
    each: float

    def of(self, n_designs: int) -> float:
        """Of a run of some designs."""
        return self.kernel + n_designs * self.each


def estimated_work(view: View, methods: Methods) -> Work:
    """What a scene takes, estimated."""
    channels, signals = len(view.mosaic.channels), len(view.lights.photons)
    load = Load(units=float(channels), nodes=view.grid.size)
    for effect in reversed(EFFECTS.values()):
        load = effect.work(view, methods, load)
    touched = load.units * max(len(view.modified), 1) / channels
    values = load.cases * load.scales * signals
    each = values / load.scales * touched * load.nodes + values * channels * signals / 2
    each += values * load.units * load.clip
    each += values * load.units * load.rounding
    return Work(load.kernel, each)
