"""What every method of every effect changes in a CSD, at most, and what it costs, for the designs of a scene.

Effects are switched from the reference to their method one after the other; each promise bounds what that step changes
in any CSD, for every design of the scene. So the sum bounds the whole. The readout's effects come first: once it is
straight, what the optics change passes through it unchanged. Where it still bends, a promise of the optics is the
smaller one of two bounds: what they move pixel by pixel (`pixelwise`), and what they change in a straight
readout, with as much as both distances may differ from that. Where the light may fall anywhere, the promise of `phase`
already holds the latter: its extremes are those of the straight response, so that is all that the optics change.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property, lru_cache

import numpy as np

from ..effects.base import (
    Effect,
    FilterEffect,
    KernelChange,
    KernelEffect,
    LightEffect,
    LinearEffect,
    Part,
    ReadoutEffect,
    Stage,
)
from ..effects.image_height import all_heights_count
from ..field import over_field
from ..kernel import colorless
from ..methods import REFERENCE, Methods
from ..registry import EFFECTS
from .bounds import Box, Reach
from .filters import at_any_height
from .pixelwise import Moves
from .scene_kernels import SceneKernels
from .steps import Step, Steps
from .work import COMPARED_S, LINEAR_S, QUICK_S, REACH_S, READOUT_S, Work, estimated_work

_OF_READOUT = tuple(name for name, effect in EFFECTS.items() if effect.stage is Stage.READOUT)


@lru_cache(maxsize=4096)
def _seen(name: str, before: Methods, after: Methods) -> tuple[Methods, Methods]:
    """The methods before and after the change of a linear effect, those without influence on it as in the reference."""
    others = {e.name: e.reference for e in EFFECTS.values() if e.name != name and _is_unseen(e, after)}
    return replace(before, **others), replace(after, **others)


def _is_unseen(effect: Effect, methods: Methods) -> bool:
    """Whether what the optics change does not depend on the method of an effect."""
    if effect.stage is Stage.READOUT:
        return methods.straight and not effect.bends
    return not isinstance(effect, KernelEffect | LightEffect | FilterEffect)


class Promises:
    """One box of designs: what each step changes in it, remembered."""

    def __init__(self, box: Box, kernels: SceneKernels) -> None:
        """`kernels`: of the box's view. `spent_s`: seconds that all bounds took, counted, but for the kernels."""
        self.box = box
        self.view = box.view
        self.reach = Reach(box)
        self._kernels = kernels
        self._steps = Steps(self.view, self.reach, self._kernels)
        self._promises: dict[tuple[str, Methods, Methods], float] = {}
        self._quick: dict[tuple[str, Methods, Methods], float] = {}
        self._ranges: dict[tuple[str, ...], float] = {}
        self._readouts: dict[tuple[str, ...], float] = {}
        self._moves = Moves(self.view, self.reach)
        self._works = kernels.works(self.view)
        self.spent_s = REACH_S

    def promise(self, name: str, before: Methods, after: Methods) -> float:
        """What switching the effect of a name from its reference changes in any CSD, DN."""
        effect = EFFECTS[name]
        if effect.is_limit and effect.all_count(self.view, after):
            within_dn = effect.limit_dn(getattr(after, name)) or 0.0
            return min(within_dn + 2 * self._as_read(after), self._longest(after))
        if effect.is_limit and not effect.all_count(self.view, before):
            return 0.0
        if getattr(before, name) == getattr(after, name):
            return 0.0
        if isinstance(effect, ReadoutEffect):
            return self._readout_promise(effect, after)
        if not isinstance(effect, LinearEffect):
            return math.inf  # named places of the sensor say nothing of those between them
        key = (name, *_seen(name, before, after))
        if key not in self._promises:
            self.spent_s += self.linear_s
            self._promises[key] = self._linear_promise(effect, *key[1:])
        return self._promises[key]

    def quick_promise(self, name: str, before: Methods, after: Methods) -> float | None:
        """`promise` of wavelengths between which kernels are interpolated, without a kernel; None of any other change.

        All pairs of signals count, and not only those that can be the smallest.
        """
        effect = EFFECTS[name]
        if not isinstance(effect, KernelEffect) or getattr(before, name) == getattr(after, name):
            return None
        what = effect.change(self.view, getattr(before, name), getattr(after, name), self.reach, straight=True)
        if not isinstance(what, KernelChange) or what.knots is None:
            return None
        key = (name, *_seen(name, before, after))
        if key not in self._quick:
            self.spent_s += QUICK_S
            found = self._kernels.gap(after, what.knots) * self._steps.most(before)
            bent = found > 0 and not after.straight and not self._kernels.anywhere(after)
            self._quick[key] = found + 2 * self._as_read(after) * bent
        return self._quick[key]

    def _readout_promise(self, effect: ReadoutEffect, after: Methods) -> float:
        """Ranges of the change in each channel, put together over the channels."""
        key = (effect.name, *(getattr(after, name) for name in _OF_READOUT))
        if key not in self._ranges:
            self.spent_s += READOUT_S
            each = [effect.range_dn(self.view, float(top), after) for top in self.reach.brightest_pixels_dn]
            self._ranges[key] = float(np.linalg.norm(each))
        return self._ranges[key]

    @property
    def brightest_dn(self) -> float:
        """Of all pixels."""
        return float(self.reach.brightest_pixels_dn.max())

    def why_exact(self, effect: Effect, signals_dn: float) -> str | None:
        """Why an effect's cheapest method changes nothing; `signals_dn`: the brightest signal of all boxes."""
        return effect.exact(self.view) or effect.never_reached(self.view, self.brightest_dn, signals_dn)

    def _as_read(self, methods: Methods) -> float:
        """By how much a distance of the readout may differ from that of a straight one at the same place, DN.

        The extremes over all places are looked for in the straight response, and read out where they are. Its smallest
        distance is off by this much, and so is the readout there.
        """
        key = tuple(getattr(methods, name) for name in _OF_READOUT)
        if key not in self._readouts:
            self._readouts[key] = self._readout_promises(methods)
        return self._readouts[key]

    def _readout_promises(self, methods: Methods) -> float:
        """Of all that a straight readout leaves out."""
        promised = 0.0
        for name, effect in EFFECTS.items():
            after = replace(methods, **{name: effect.methods[0]})
            if isinstance(effect, ReadoutEffect) and after != methods and effect.exact(self.view) is None:
                promised += self._readout_promise(effect, after)
                methods = after
        return promised

    def _longest(self, methods: Methods) -> float:
        """The longest distance that a readout which clips can have, DN; two of them differ by no more."""
        if methods.straight:
            return np.inf
        return math.sqrt(len(self.view.mosaic.channels)) * self.reach.span_dn(rounds=methods.quantization == "round")

    def _linear_promise(self, effect: LinearEffect, before: Methods, after: Methods) -> float:
        """In a straight readout, and what a readout that is not adds to that."""
        step, found = self._steps.step(effect, before, after, straight=True), 0.0
        if step.remainder != 0 or step.change.any():
            found = self._largest_change(step, before, after)
        if isinstance(step.what, KernelChange) and step.what.part is Part.PLACES:
            return min(found + 2 * self._as_read(after), self._longest(after))
        if after.straight or self._kernels.anywhere(after):
            return found
        return self._bent_promise(effect, before, after, found)

    def _largest_change(self, step: Step, before: Methods, after: Methods) -> float:
        """Of a straight readout."""
        between = self._kernels.spread(step.what, before, after, step.change, step.left, step.scale)
        changes = (step.changed, step.change, step.remainder, step.base, step.left)
        return self.reach.largest_change(*changes, between=between)

    def _bent_promise(self, effect: LinearEffect, before: Methods, after: Methods, found: float) -> float:
        """See the head of this file; `found`: of a straight readout."""
        clips, rounds = after.saturation == "clip", after.quantization == "round"
        hard = rounds and self.view.scenario.noise is None
        step = self._steps.step(effect, before, after, straight=False)
        compared = not isinstance(step.what, KernelChange) or step.what.part is not Part.PIXELS
        # A step of rounding is as high as it is, however little a pixel moves; without pixels none can be compared.
        if not compared or (hard and found > 0):
            return found + 2 * self._as_read(after)
        wanted = self._kernels.wanted(before), self._kernels.wanted(after)
        moved = self._moves.of(step.what, *wanted, step.changed, step.background) * step.scale
        moved += step.remainder * step.changed.most_each.sum(axis=1)[:, None]
        if not moved.any():
            return 0.0
        as_read = found + 2 * self._as_read(after)
        if hard:
            return as_read
        every = 0.0
        if not clips:
            changes = (step.changed, step.change, step.remainder, step.base, step.left)
            every = self.reach.largest_change(*changes, every=True)
        return min(as_read, self._moves.promise(every, moved, clips=clips, rounds=rounds))

    @property
    def everywhere(self) -> bool:
        """Whether all places of the sensor count."""
        return all_heights_count(self.view)

    def is_anywhere(self, methods: Methods) -> bool:
        """Whether the light may fall anywhere, and more than a lattice of places is looked at."""
        return self._kernels.anywhere(methods)

    def work_of(self, methods: Methods) -> Work:
        """Estimated seconds."""
        if methods not in self._works:
            self._works[methods] = estimated_work(self.view, methods)
        return self._works[methods]

    @cached_property
    def linear_s(self) -> float:
        """Seconds of a bound of the optics, counted."""
        corners = 1 if not self._kernels.anywhere(REFERENCE) else self._kernels.corners.size
        return LINEAR_S + COMPARED_S * corners * len(self.view.mosaic.channels) * len(self.reach.first)


def promises_of(boxes: Sequence[Box], kernels: dict[tuple[tuple[int, ...], ...], SceneKernels]) -> list[Promises]:
    """Those of each box; boxes whose CFAs have the same tile share their kernels, which `kernels` takes."""
    found = []
    for box in boxes:
        if (tile := box.view.mosaic.tile) not in kernels:
            kernels[tile] = SceneKernels(colorless(over_field(box.view)[0]))
        # Each named place of the field sees a scene of its own; the worst changes by no more than any of them.
        everywhere = all_heights_count(box.view)
        own = [at_any_height(box)] if everywhere else [replace(box, view=place) for place in over_field(box.view)]
        found += [Promises(one, kernels[tile]) for one in own]
    return found
