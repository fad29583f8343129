"""What switching one effect of the sampling or the optics changes, as the bounds take it."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, replace

import numpy as np

from ...base.types import FloatArray
from ..effects import blur
from ..effects.base import Change, CurveChange, FilterChange, KernelChange, LightChange, LinearEffect, Part, ShareChange
from ..methods import Methods
from ..registry import factor_of_light
from ..view import View
from .bounds import Amounts, Reach
from .filters import amounts_of_filters, background_of_filters
from .scene_kernels import SceneKernels


@dataclass(frozen=True)
class Step:
    """One step. `what`: of the effect itself.

    `change`: ndarray[n_cases, n_values, n_channels, n_knots], of the kernel that multiplies `changed`, exact up to
    `remainder` between the knots; `base`, `left`: the responses and the kernel after it. `scale`: the share of the
    kernel that `change` is. `background`: what the kernel's change multiplies of the background, DN, middle and half
    width, ndarray[n_channels] each; of a change that is none of the kernel, by how much the background changes.
    """

    what: Change
    changed: Amounts
    change: FloatArray
    remainder: float
    base: Amounts
    left: FloatArray
    scale: float
    background: tuple[FloatArray, FloatArray]


class Steps:
    """The steps of one box of designs; sums are remembered."""

    def __init__(self, view: View, reach: Reach, kernels: SceneKernels) -> None:
        self._view, self._reach, self._kernels = view, reach, kernels
        self._amounts: dict[bytes, Amounts] = {}
        self._most: dict[bytes, float] = {}

    def step(self, effect: LinearEffect, before: Methods, after: Methods, *, straight: bool) -> Step:
        """What switching an effect changes; `straight`: as seen by a straight readout."""
        reach, (own, other) = self._reach, (getattr(methods, effect.name) for methods in (before, after))
        what = effect.change(self._view, own, other, reach, straight=straight)
        light, dimmed = self._factors(before)
        low, high = reach.seen(before.angle)
        base = changed = self._sums(light, low, high)
        background = reach.background(dimmed, low, high)
        now, remainder = self._kernels.of(before), self._between_knots(before)
        change, left, scale = now, now, 1.0
        match what:
            case KernelChange():
                now, left = self._kernels_of(what, before, after)
                change = now - left
                remainder = self._remainder(what, before, after, changes=bool(change.any()))
            case ShareChange():
                scale = abs(what.lost)
                change, remainder = now * what.lost, remainder * scale
            case LightChange():
                rest, rest_dimmed = self._factors(replace(before, **{effect.name: effect.off}))
                lost = what.before - what.after
                changed = self._sums(lost * rest, low, high)
                base = self._sums(what.after * rest, low, high)
                background = reach.background(lost * rest_dimmed, low, high)
            case CurveChange():
                changed = self._sums(light, *reach.as_seen(before.angle, what.low, what.high))
            case FilterChange():
                changed = amounts_of_filters(reach, light, what)
                base = self._sums(light, *reach.seen(after.angle))
                background = background_of_filters(reach, dimmed, what)
        left = np.broadcast_to(left, change.shape)
        return Step(what, changed, change, remainder, base, left, scale, background)

    def most(self, methods: Methods) -> float:
        """How much the distance of any pair changes at most, DN, for each unit by which kernels change everywhere."""
        light = self._factors(methods)[0]
        key = light.tobytes() + methods.angle.encode()
        if key not in self._most:
            most = self._reach.most_apart(light, *self._reach.seen(methods.angle))
            self._most[key] = most * len(self._view.mosaic.channels) ** 0.5
        return self._most[key]

    def _factors(self, methods: Methods) -> tuple[FloatArray, FloatArray]:
        """What is left of a signal's light and of the background at every wavelength, ndarray[n_wavelengths] each."""
        nodes = self._view.grid.nodes_nm
        light, background = (factor_of_light(self._view, methods, nodes, background=b) for b in (False, True))
        return light, background

    def _kernels_of(self, what: KernelChange, before: Methods, after: Methods) -> tuple[FloatArray, FloatArray]:
        """The kernels before and after."""
        now = self._kernels.of(before)
        if what.part is not Part.PLACES:
            return now, self._kernels.of(after)
        # The places that are nearest to those in a cell are compared at all of its corners.
        corners = self._kernels.corners
        return now[corners.ravel()], np.repeat(self._kernels.nearest(after), corners.shape[1], axis=0)

    def _remainder(self, what: KernelChange, before: Methods, after: Methods, *, changes: bool) -> float:
        """How far the change may be from its interpolation between the knots of the comparison."""
        if what.knots is not None:
            return self._kernels.gap(after, what.knots)
        # What is interpolated in both kernels; nothing where they are the same.
        return (self._between_knots(before) + self._between_knots(after)) * changes

    def _between_knots(self, methods: Methods) -> float:
        """How far the kernel of some methods may be from its interpolation between the knots of the comparison."""
        if methods.blur in ("skip", blur.COARSE):
            return 0.0
        return self._kernels.gap(methods, blur.COARSE) + self._kernels.gap(methods, methods.blur)

    def _sums(self, factor: FloatArray, low: FloatArray, high: FloatArray) -> Amounts:
        """`Reach.amounts`, remembered."""
        key = factor.tobytes() + low.tobytes() + high.tobytes()
        digest = hashlib.sha256(key).digest()
        if digest not in self._amounts:
            self._amounts[digest] = self._reach.amounts(factor, low, high)
        return self._amounts[digest]
