"""How long computing a scene takes, and looking for a plan: counted work times measured constants.

The seconds are those of one core of the machine by which `tests/bench_work.py` measured the constants, here and in the
effects. They come from the scene alone: no clock is read, so that the same plan is found on every machine.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from ..effects.base import MULTIPLICATION_S, Effect, Load
from ..effects.noise import in_closed_form
from ..effects.sampling import MOST_FUNCTIONS
from ..electrons import KEPT
from ..methods import Methods
from ..registry import EFFECTS
from ..view import View

BOX_S, TABLED_S, FOLDED_S = 2.5e-3, 3e-9, 1.4e-8
"""Seconds: of the imager of a CFA, and of a value of its table at a wavelength, on the grid and between fewer nodes."""
ROW_S, UNROUNDED_S = 1e-6, 3.5e-9
"""Seconds: of a design's other columns and its row, and what a light's value in a design by its edges takes more if it
is not rounded: whole numbers are read and compared in one pass. `tests/bench_work.py` measures them."""
REACH_S, READOUT_S, QUICK_S, LINEAR_S, COMPARED_S, KERNEL_S = 4e-4, 8e-4, 5e-4, 7e-4, 5e-9, 4e-3
"""Seconds of a planner: for the reach of a box, a bound of the readout, one of the optics without kernels and with
them, each value that it compares, and a kernel of a light at a distance; `tests/bench_work.py` measures what they come
to."""
NOISE_S, UNEVEN_NOISE_S = 0.045, 0.06
"""Seconds of the first bounds of a noisy readout, without PRNU and with it; `tests/bench_work.py` measures them."""
LEAST_LOOK_S = 2 * REACH_S
"""Seconds for each CFA, with which hardly anything can be found."""
LOOKING_SHARE = 0.05
"""Of the time that everything on takes, after which nothing more is looked at: what is begun is finished."""


_WORKING = [effect for effect in reversed(EFFECTS.values()) if type(effect).work is not Effect.work]


def noise_s(view: View, brightest_dn: float = 0.0) -> float:
    """Seconds of the first bounds of a scene's readout, counted: its pixel is then known.

    `brightest_dn`: of its pixels, as far as that is known. None where closed forms tell all.
    """
    if view.scenario.noise is None or in_closed_form(view.pixel, brightest_dn):
        return 0.0
    return UNEVEN_NOISE_S if view.pixel.prnu else NOISE_S


class DesignCount(NamedTuple):
    """How many designs a CFA has; `by_edges`: their responses are those of their edges, which a table holds."""

    n: int
    by_edges: bool = False


class Work(NamedTuple):
    """Seconds: `shared` once, for CFAs whose tiles are alike; `own` for each CFA, `each` for every design.

    `curve`: for the response to each design's curve; `by_edges`: for every design that is told by its edges.
    """

    shared: float
    own: float
    each: float
    curve: float
    by_edges: float

    def of(self, designs: DesignCount) -> float:
        """Of a run of some designs."""
        return self.own + designs.n * (self.by_edges if designs.by_edges else self.each + self.curve)


def in_all(works: Sequence[tuple[Work, DesignCount]]) -> float:
    """Seconds of the CFAs of a scene, each with its designs."""
    return max((work.shared for work, _ in works), default=0.0) + sum(work.of(designs) for work, designs in works)


def estimated_work(view: View, methods: Methods) -> Work:
    """What a scene takes, estimated."""
    channels, signals = len(view.mosaic.channels), len(view.lights.photons)
    load = Load(units=float(channels), nodes=view.grid.size)
    for effect in _WORKING:
        load = effect.work(view, methods, load)
    changed = load.units * len(view.modified) / channels
    lights = load.cases * signals
    # Pixels see the light in few functions, and the fixed ones are counted with what reads them (`sampling`).
    apart = load.units > channels
    products = 0.0 if apart else lights * load.units * channels * view.grid.size * MULTIPLICATION_S
    table, tabled_s = lights * changed * (min(load.knots, MOST_FUNCTIONS) if apart else load.nodes), 0.0
    if 0 < table <= KEPT and not apart:
        tabled_s = lights * changed * view.grid.size * (TABLED_S if load.nodes == view.grid.size else FOLDED_S)
    values = load.scales * lights
    always_s = values * (channels * signals / 2 * MULTIPLICATION_S) + load.search_s + ROW_S
    each = always_s + values * load.units * load.value_s
    own = BOX_S + load.own_s + products + tabled_s
    unrounded_s = UNROUNDED_S if methods.quantization == "skip" else 0.0
    by_edges = always_s + values * (changed * load.value_s + unrounded_s)
    return Work(load.shared_s, own, each, table * MULTIPLICATION_S, by_edges)
