"""What every method of every effect changes in a CSD, at most, and what it costs, for the designs of a scene.

Effects are switched from the reference to their method one after the other; each promise bounds what that step changes
in any CSD, for every design of the scene. So the sum bounds the whole. The readout's effects come first: once it is
straight, what the optics change passes through it unchanged. Where it still bends, a promise of the optics is the
smaller one of two bounds: what they move pixel by pixel (`pixelwise`), and what they change in a straight
readout, with as much as both distances may differ from that. Where the light may fall anywhere, the promise of `phase`
already holds the latter: its extremes are those of the straight response, so that is all that the optics change.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping
from dataclasses import replace
from types import ModuleType

import numpy as np

from ...types import FloatArray
from ..effects import (
    blur,
    crosstalk,
    demosaic,
    extinction,
    flicker,
    illumination,
    noise,
    pedestal,
    phase,
    quadrature,
    quantization,
    sampling,
    saturation,
)
from ..view import REFERENCE, Methods
from .bounds import Amounts, Box, Reach, Step
from .pixelwise import Moves
from .scene_kernels import SceneKernels
from .work import estimated_work

EFFECTS: Mapping[str, ModuleType] = {
    "noise": noise,
    "quantization": quantization,
    "saturation": saturation,
    "pedestal": pedestal,
    "quadrature": quadrature,
    "sampling": sampling,
    "phase": phase,
    "demosaic": demosaic,
    "blur": blur,
    "crosstalk": crosstalk,
    "illumination": illumination,
    "extinction": extinction,
    "flicker": flicker,
}
"""Every effect in the order in which it is switched to its method; methods go from the cheapest to the reference."""
READOUT = ("noise", "quantization", "saturation", "pedestal")


class Promises:
    """One box of designs: what each step changes in it, remembered."""

    def __init__(self, box: Box) -> None:
        self.box = box
        self.setup = box.setup
        self.reach = Reach(box)
        self.spectrum = extinction.transmittance(self.setup, "spectral", self.setup.grid.nodes_nm)
        self._kernels = SceneKernels(self.setup, self.reach.knots_nm)
        self._amounts: dict[bytes, Amounts] = {}
        self._gaps: dict[tuple[str, float], float] = {}
        self._promises: dict[tuple[str, Methods, Methods], float] = {}
        self._moves = Moves(self.setup, self.reach)

    def promise(self, effect: str, before: Methods, after: Methods) -> float:
        """What switching `effect` from its reference changes in any CSD, DN."""
        if effect == "phase" and self._kernels.anywhere(after):
            within_dn = float(phase.within_dn(after.phase) or 0.0)
            return min(within_dn + 2 * self._as_read(after), self._longest(after))
        if effect == "phase" and not self._kernels.anywhere(before):
            return 0.0
        if getattr(before, effect) == getattr(after, effect):
            return 0.0
        if effect in READOUT:
            return self._readout_promise(effect, after)
        # What optics change does not depend on these.
        same = ("noise", "pedestal", "quadrature") if self._is_straight(after) else ("quadrature",)
        others = {e: getattr(REFERENCE, e) for e in same if e != effect}
        key = (effect, replace(before, **others), replace(after, **others))
        if key not in self._promises:
            self._promises[key] = self._linear_promise(*key)
        return self._promises[key]

    @staticmethod
    def _is_straight(methods: Methods) -> bool:
        return methods.saturation == "skip" and methods.quantization == "skip"

    def _readout_promise(self, effect: str, after: Methods) -> float:
        """Ranges of the change in each channel, put together over the channels."""
        pixel = self.setup.pixel
        others = self.setup.pixel.dark_e_per_s * self.reach.longest_s * pixel.dn_per_e + self.reach.background_dn
        tops = self.reach.brightest_dn + others
        if pixel.crosstalk:
            tops = np.full(tops.size, tops.max())
        if effect == "noise":
            each = [noise.promise(self.setup, top / pixel.dn_per_e) for top in tops]
        elif effect == "quantization":
            each = [quantization.promise(self.setup, top / pixel.dn_per_e) for top in tops]
        elif effect == "saturation":
            each = [saturation.promise(self.setup, top / pixel.dn_per_e, after) for top in tops]
        else:
            each = [pedestal.promise(self.setup, top, after) for top in tops]
        return float(np.linalg.norm(each))

    def _as_read(self, methods: Methods) -> float:
        """By how much a distance of the readout may differ from that of a straight one at the same place, DN.

        The extremes over all places are looked for in the straight response, and read out where they are. Its smallest
        distance is off by this much, and so is the readout there.
        """
        promised = 0.0
        for effect in READOUT:
            after = replace(methods, **{effect: "skip"})
            if after != methods and EFFECTS[effect].skip_is_exact(self.setup) is None:
                promised += self._readout_promise(effect, after)
                methods = after
        return promised

    def _longest(self, methods: Methods) -> float:
        """The longest distance that a readout which clips can have, DN; two of them differ by no more."""
        if self._is_straight(methods):
            return np.inf
        return math.sqrt(len(self.setup.mosaic.channels)) * self.reach.span_dn(rounds=methods.quantization == "round")

    def _gap(self, methods: Methods, method: str) -> float:
        """How far a kernel may be from its interpolation between the wavelengths of a method of blur."""
        setup, target = self.setup, self.setup.scenario.target
        knots_nm = blur.knots(setup.grid.nodes_nm, method)
        if target is None or knots_nm.size == setup.grid.size:
            return 0.0
        aperture = 0.0 if methods.sampling == "skip" else setup.pixel.fill_factor**0.5 * setup.pixel.pitch_um
        if (method, aperture) not in self._gaps:
            radius = sampling.radii_px(setup, target)[0] * setup.pixel.pitch_um
            w20_um = blur.defocus_um(setup.scenario, setup.pixel.pitch_um)
            f_number = setup.scenario.optics.f_number
            bound = blur.interpolation_bound(radius, aperture, knots_nm * 1e-3, f_number, w20_um)
            self._gaps[method, aperture] = bound
        return self._gaps[method, aperture]

    def _between_knots(self, methods: Methods) -> float:
        """How far the kernel of some methods may be from its interpolation between the knots of the comparison."""
        if methods.blur in ("skip", blur.COARSE):
            return 0.0
        return self._gap(methods, blur.COARSE) + self._gap(methods, methods.blur)

    def _sums(self, factor: FloatArray, low: FloatArray, high: FloatArray) -> Amounts:
        """`Reach.amounts`, remembered."""
        key = factor.tobytes() + low.tobytes() + high.tobytes()
        digest = hashlib.sha256(key).digest()
        if digest not in self._amounts:
            self._amounts[digest] = self.reach.amounts(factor, low, high)
        return self._amounts[digest]

    def _step(self, effect: str, before: Methods, after: Methods, *, straight: bool) -> Step:
        """What switching an effect of the optics changes; `straight`: as seen by a straight readout."""
        box, setup = self.box, self.setup
        scale = 1.0
        falls = illumination.factor(setup, after.illumination if effect != "illumination" else before.illumination)
        base = changed = self._sums(self.spectrum * falls, box.low, box.high)
        now = self._kernels.of(before)
        if effect == "phase":  # the places that are nearest to those in a cell are compared at all of its corners
            now, then = (
                now[self._kernels.corners[1].ravel()],
                np.repeat(self._kernels.nearest(after), len(phase.CORNERS), axis=0),
            )
        else:
            then = self._kernels.of(after)
        left, remainder = then, self._between_knots(before)
        if effect == "quadrature":
            kept = quadrature.nodes(setup.grid.size, after.quadrature)
            middle, half = quadrature.deviation(box.low, box.high, kept)
            changed, change = self._sums(self.spectrum * falls, middle - half, middle + half), now
        elif effect == "illumination":
            lost = 1 - illumination.factor(setup, after.illumination) / falls
            scale = abs(lost)
            change, remainder = now * lost, remainder * scale
        elif effect == "extinction":
            other = extinction.transmittance(setup, after.extinction, setup.grid.nodes_nm)
            changed = self._sums((self.spectrum - other) * falls, box.low, box.high)
            base, change = self._sums(other * falls, box.low, box.high), now
        elif effect == "flicker":
            scale = flicker.missed(after.flicker, self.reach.least_light, self.reach.most_light, straight=straight)
            change, remainder = now * scale, remainder * scale
        else:
            change = now - then
            if effect != "blur":  # what is interpolated in both kernels; nothing where they are the same
                remainder = (remainder + self._between_knots(after)) * bool(change.any())
            elif after.blur != "skip":
                remainder = self._gap(after, after.blur)
        return Step(changed, change, remainder, base, np.broadcast_to(left, change.shape), scale, falls)

    def _linear_promise(self, effect: str, before: Methods, after: Methods) -> float:
        """Of an effect of the optics: in a straight readout, and what a readout that is not adds to that."""
        step, found = self._step(effect, before, after, straight=True), 0.0
        if step.remainder != 0 or step.change.any():
            between = self._kernels.spread(effect, before, after, step.change, step.left, step.scale)
            found = self.reach.largest_change(*step[:5], between=between)
        if effect == "phase":
            return min(found + 2 * self._as_read(after), self._longest(after))
        if self._is_straight(after) or self._kernels.anywhere(after):
            return found
        return self._bent_promise(effect, before, after, found)

    def _bent_promise(self, effect: str, before: Methods, after: Methods, found: float) -> float:
        """See the head of this file; `found`: of a straight readout."""
        clips, rounds = after.saturation == "clip", after.quantization == "round"
        hard = rounds and self.setup.scenario.noise is None
        # A step of rounding is as high as it is, however little a pixel moves; without pixels none can be compared.
        if effect == "sampling" or (hard and found > 0):
            return found + 2 * self._as_read(after)
        step = self._step(effect, before, after, straight=False)
        wanted = self._kernels.wanted(before), self._kernels.wanted(after)
        moved = self._moves.of(effect, *wanted, step.changed, step.falls) * step.scale
        moved += step.remainder * step.changed.most_each.sum(axis=1)[:, None]
        if not moved.any():
            return 0.0
        as_read = found + 2 * self._as_read(after)
        if hard:
            return as_read
        every = 0.0 if clips else self.reach.largest_change(*step[:5], every=True)
        return min(as_read, self._moves.promise(every, moved, clips=clips, rounds=rounds))

    def work_of(self, methods: Methods) -> float:
        """Estimated operations of a run of all designs."""
        return estimated_work(self.setup, self.box.n_designs, methods)
