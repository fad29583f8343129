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

from ...types import FloatArray
from ..effects import phase, quantization
from ..kernel import Kernel, make_kernel, pixels_per_place, readout_of
from ..view import Methods, Setup
from .bounds import Amounts, Reach

_AT_ONCE = 4_000_000
"""Values of pixels, knots and channels, or signals, of a block of places that are compared at once."""


class Moves:
    """What a step of the optics moves in a scene, remembered."""

    def __init__(self, setup: Setup, reach: Reach) -> None:
        self._setup, self._reach = setup, reach
        self._found: dict[tuple[object, ...], FloatArray] = {}

    def of(self, effect: str, before: Methods, after: Methods, light: Amounts, falls: float) -> FloatArray:
        """Bound on the change of each channel's value, DN, ndarray[n_cases, n_signals, n_channels].

        `light`: what changes of the signals, where the step changes them and not the kernel. `falls`: the share of the
        light that comes so far off the axis; of a background, too. What the kernel is between the knots comes on top.
        """
        digest = hashlib.sha256(light.middle.tobytes() + light.half_each.tobytes()).digest()
        key = (effect, before, after, falls, digest)
        if key not in self._found:
            setup = self._setup
            cases = phase.cases(setup, before.phase)
            n_channels = len(setup.mosaic.channels)
            per_pixel = max(n_channels * self._reach.knots_nm.size, len(light.middle))
            step = max(1, _AT_ONCE // (pixels_per_place(setup) * per_pixel))
            blocks = [cases.some(slice(at, at + step)) for at in range(0, len(cases.places_px), step)]
            background = [falls * part for part in self._reach.background]
            parts = [self._of_block(effect, before, after, light, background, block) for block in blocks]
            self._found[key] = np.concatenate(parts)
        return self._found[key]

    def promise(self, every: float, moved: FloatArray, *, clips: bool, rounds: bool) -> float:
        """Largest change of a distance, DN, of channels that move by up to `moved`; any rounding is that under noise.

        `every`: the largest change in a straight readout. A rounded mean under noise is steeper than the readout
        before it by s = `quantization.steepness` - 1 at most. So where nothing clips, s times what the pixels move
        comes on top of a straight readout's change. What clips has no values outside its range.
        """
        steep = quantization.steepness(self._setup) if rounds else 1.0
        if not clips:
            return every + (steep - 1) * self._reach.largest_move(moved)
        return self._reach.largest_move(np.minimum(moved * steep, self._reach.span_dn(rounds=rounds)))

    def _kernel(self, methods: Methods, cases: phase.Cases) -> Kernel:
        """Pixel by pixel, at all knots."""
        nodes = self._reach.knots_nm
        made = make_kernel(self._setup, methods, nodes, by_pixel=True, work=Counter(), cases=cases)
        if self._setup.scenario.target is None and made.light.shape[1] == len(self._setup.mosaic.channels):
            channel = self._setup.mosaic.indices.ravel()  # without crosstalk one pixel of a channel stands for all
            own = np.eye(made.light.shape[1])[channel] / self._setup.mosaic.counts
            made = Kernel(made.light[:, channel], made.uniform[:, channel], own[None], own[None] ** 2)
        return replace(made, light=np.broadcast_to(made.light, (*made.light.shape[:3], nodes.size)))

    def _of_block(
        self,
        effect: str,
        before: Methods,
        after: Methods,
        light: Amounts,
        background: list[FloatArray],
        cases: phase.Cases,
    ) -> FloatArray:
        now = self._kernel(before, cases)
        if effect == "demosaic":
            other = readout_of(self._setup, after, cases, like=before)
            return self._of_weights(now, other, light, background)
        change, uniform = now.light, np.zeros_like(now.uniform)
        if effect in ("blur", "crosstalk") and before == after:  # compared at the knots, where both are the same
            change = np.zeros_like(now.light)
        elif effect in ("blur", "crosstalk"):
            then = self._kernel(after, cases)
            change, uniform = now.light - then.light, now.uniform - then.uniform
        elif effect == "illumination":
            uniform = now.uniform
        return _summed(now.readout, change, uniform, light, background)

    @staticmethod
    def _of_weights(now: Kernel, other: FloatArray, light: Amounts, background: list[FloatArray]) -> FloatArray:
        """Of weights that change to `other`."""
        found = []
        for channel in range(other.shape[2]):
            own = other[..., channel]
            change = now.light - np.einsum("np,npck->nck", own, now.light)[:, None]
            uniform = now.uniform - np.einsum("np,npc->nc", own, now.uniform)[:, None]
            weights = np.abs(now.readout[..., channel] - own)[..., None]
            found.append(_summed(weights, change, uniform, light, background))
        return np.concatenate(found, axis=2)


def _summed(
    weights: FloatArray, change: FloatArray, uniform: FloatArray, light: Amounts, background: list[FloatArray]
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
