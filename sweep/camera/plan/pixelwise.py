"""What the optics move in each channel's value behind a readout that is not straight: at most the sum over its pixels.

A pixel's readout f never falls and rises by at most as much as its signal x. So where a channel's value is the sum of
w f(x) over its pixels, it changes by at most the sum of w |x - x'|: absolute changes, which do not cancel between the
pixels as they do in a straight readout. Two pixels that go from (1, 1) to (0, 2), clipped at 1, change their mean by
1/2.
Where the weights change and not the signals (demosaicking), both sets of them sum to 1, so that f(r) of any one signal
r cancels: the sum of (w - w') f(x) is that of (w - w') (f(x) - f(r)), at most the sum of |w - w'| |x - r|. For r the
mean signal under the weights w' is taken.

A signal is linear in QE and kernel, and so is its bound for a box of designs: |sum of K M| for the middle of the box
and the sum of |K| H for half its width. All signals are those of the longest exposure in the brightest moment of a
pulse: a shorter exposure makes all changes smaller by the same factor. A uniform background, which cancels in the
difference of two straight responses, counts here.
"""

from __future__ import annotations

import hashlib
from collections import Counter
from dataclasses import replace

import numpy as np

from ...base.types import FloatArray
from ..effects import phase, quantization
from ..effects.base import Change, FilterChange, KernelChange, LightChange, Part, ShareChange
from ..kernel import Kernel, make_kernel, pixels_of_tile, readout_of
from ..kernel_size import pixels_per_place
from ..methods import Methods
from ..view import View
from .bounds import Amounts, Reach

_AT_ONCE = 4_000_000
"""Values of pixels, knots and channels, or signals, of a block of places that are compared at once."""


class Moves:
    """What a step of the optics moves in a scene, remembered."""

    def __init__(self, view: View, reach: Reach) -> None:
        self._view, self._reach = view, reach
        self._found: dict[tuple[object, ...], FloatArray] = {}

    def of(
        self, what: Change, before: Methods, after: Methods, light: Amounts, background: tuple[FloatArray, FloatArray]
    ) -> FloatArray:
        """Bound on the change of each channel's value, DN, ndarray[n_cases, n_signals, n_channels].

        `light`, `background`: what changes of them, where the step changes them and not the kernel; see `Step`. What
        the kernel is between the knots comes on top.
        """
        numbers = [light.middle, light.half_each, *background]
        digest = hashlib.sha256(b"".join(values.tobytes() for values in numbers)).digest()
        kind = what.part if isinstance(what, KernelChange) else type(what)
        key = (kind, _moves_background(what), before, after, digest)
        if key not in self._found:
            view = self._view
            cases = phase.cases(view, before.phase)
            n_channels = len(view.mosaic.channels)
            per_pixel = max(n_channels * self._reach.knots_nm.size, len(light.middle))
            step = max(1, _AT_ONCE // (pixels_per_place(view) * per_pixel))
            blocks = [cases.some(slice(at, at + step)) for at in range(0, len(cases.places_px), step)]
            parts = [self._of_block(what, before, after, light, background, block) for block in blocks]
            self._found[key] = np.concatenate(parts)
        return self._found[key]

    def promise(self, every: float, moved: FloatArray, *, clips: bool, rounds: bool) -> float:
        """Largest change of a distance, DN, of channels that move by up to `moved`; any rounding is that under noise.

        `every`: the largest change in a straight readout. A rounded mean under noise is steeper than the readout
        before it by s = `quantization.steepness` - 1 at most. So where nothing clips, s times what the pixels move
        comes on top of a straight readout's change. What clips has no values outside its range.
        """
        steep = quantization.steepness(self._view.pixel) if rounds else 1.0
        if not clips:
            return every + (steep - 1) * self._reach.largest_move(moved)
        return self._reach.largest_move(np.minimum(moved * steep, self._reach.span_dn(rounds=rounds)))

    def _kernel(self, methods: Methods, cases: phase.Cases) -> Kernel:
        """Pixel by pixel, at all knots."""
        nodes = self._reach.knots_nm
        made = make_kernel(self._view, methods, nodes, by_pixel=True, work=Counter(), cases=cases)
        if made.by_channel:  # without crosstalk one pixel of a channel stands for all
            made = pixels_of_tile(made, self._view.mosaic)
        return replace(made, source=np.broadcast_to(made.light, (*made.light.shape[:3], nodes.size)))

    def _of_block(
        self,
        what: Change,
        before: Methods,
        after: Methods,
        light: Amounts,
        background: tuple[FloatArray, FloatArray],
        cases: phase.Cases,
    ) -> FloatArray:
        now = self._kernel(before, cases)
        if isinstance(what, KernelChange):
            if what.part is Part.WEIGHTS:
                other = readout_of(self._view, after, cases, like=before)
                return self._of_weights(now, other, light, background)
            # Compared at the knots, where both may be the same.
            then = now if before == after else self._kernel(after, cases)
            change, uniform = now.light - then.light, now.uniform - then.uniform
        else:
            change, uniform = now.light, now.uniform if _moves_background(what) else np.zeros_like(now.uniform)
        return _summed(now.readout, change, uniform, light, background)

    @staticmethod
    def _of_weights(
        now: Kernel, other: FloatArray, light: Amounts, background: tuple[FloatArray, FloatArray]
    ) -> FloatArray:
        """Of weights that change to `other`."""
        found = []
        for channel in range(other.shape[2]):
            own = other[..., channel]
            change = now.light - np.einsum("np,npck->nck", own, now.light)[:, None]
            uniform = now.uniform - np.einsum("np,npc->nc", own, now.uniform)[:, None]
            weights = np.abs(now.readout[..., channel] - own)[..., None]
            found.append(_summed(weights, change, uniform, light, background))
        return np.concatenate(found, axis=2)


def _moves_background(what: Change) -> bool:
    """Whether a change that is none of the kernel changes the background, too."""
    if isinstance(what, FilterChange):
        return True
    return isinstance(what, LightChange | ShareChange) and what.of_background


def _summed(
    weights: FloatArray,
    change: FloatArray,
    uniform: FloatArray,
    light: Amounts,
    background: tuple[FloatArray, FloatArray],
) -> FloatArray:
    """Weights times absolute changes of the pixels' signals, ndarray[n_cases, n_signals, n_values].

    `weights`: ndarray[n_cases, n_pixels, n_values]; `change`, `uniform`: of the kernel for the light, ndarray[n_cases,
    n_pixels, n_channels, n_knots], and for the background, ndarray[n_cases, n_pixels, n_channels].
    """
    flat = change.reshape(*change.shape[:2], -1)
    middle, half = (values.reshape(len(values), -1) for values in (light.middle, light.half_each))
    sums = np.swapaxes(weights, 1, 2)
    found = np.abs(flat @ middle.T)
    found = sums @ found  # [n_cases, n_values, n_signals]
    if half.any():
        found += (sums @ np.abs(flat)) @ half.T
    beside = np.abs(uniform @ background[0]) + np.abs(uniform) @ background[1]
    found += sums @ beside[..., None]
    return np.asarray(np.swapaxes(found, 1, 2), dtype=float)
