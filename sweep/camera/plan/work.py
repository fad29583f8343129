"""How much computing a scene takes."""

from __future__ import annotations

from ..effects.base import Load
from ..methods import Methods
from ..registry import EFFECTS
from ..view import View


def estimated_work(view: View, n_designs: int, methods: Methods) -> float:
    """Estimated multiplications of a run of all designs."""
    channels, signals = len(view.mosaic.channels), len(view.lights.photons)
    load = Load(units=float(channels), nodes=view.grid.size)
    for effect in reversed(EFFECTS.values()):
        load = effect.work(view, methods, load)
    touched = load.units * max(len(view.modified), 1) / channels
    values = load.cases * load.scales * signals
    each = values / load.scales * touched * load.nodes + values * channels * signals / 2
    each += values * load.units * load.clip
    each += values * load.units * load.rounding
    return load.kernel + n_designs * each
