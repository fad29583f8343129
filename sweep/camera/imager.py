"""The image chain of a scene: light on the pixels, electrons, full well, readout, for a block of designs.

In the physical order: optics blur, pixel aperture and mosaic sampling with crosstalk (the kernel), photon noise, full
well, read noise, pedestal, ADC, readout. Only what `View.methods` names is computed.
"""

from __future__ import annotations

import hashlib
import pickle
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import DTypeLike

from ..base.cache import Cache
from ..base.errors import Fault, SweepError
from ..base.types import FloatArray
from ..designs.block import Block
from .effects import phase
from .electrons import Changing, Electrons
from .field import over_field
from .kernel import Kernel, kept_kernel, make_kernel
from .kernel_size import blocks
from .noisy_readout import NoisyReadout
from .readout import Readout
from .scene_light import SceneLight
from .view import View

if TYPE_CHECKING:
    from .places import AnyPlace

_Found = TypeVar("_Found")
_BLOCK = 2_000_000
"""Values of a block of pixels that are held at once."""


class Imager:
    """A scene, ready for designs. `work` counts what is computed, by effect; the kernel is made once it is asked for.

    `light`: the scene's; `electrons`: what the designs give on the units of the kernel; `readout`: how these are read.
    Of places at which pixels are read one by one, those that see the same as another one are left out.
    """

    all_apart = False
    """Whether all places are kept."""

    def __init__(
        self,
        view: View,
        work: Counter[str] | None = None,
        dtype: DTypeLike = np.float64,
        cases: phase.Cases | None = None,
        *,
        once: bool = False,
    ) -> None:
        """`dtype`: of the product of curves and scene, where the scene's table is small enough to be kept. `once`: for
        a single use, so that no table is made. `cases`: places of the light instead of those of the method of `phase`.
        """
        self.view = view
        self.work: Counter[str] = Counter() if work is None else work
        self._dtype, self._once = dtype, once
        by_pixel, targeted = not view.methods.straight, view.scenario.target is not None
        self._others: list[phase.Cases] = []
        if by_pixel and targeted and view.methods.sampling != "skip":
            if cases is None:
                every = phase.cases(view, view.methods.phase)
                cases = every if self.all_apart else phase.different_places(view, every)[0]
            # Where the kernels of all places would be too large to hold, those of the others are made as they are read.
            cases, *self._others = blocks(view, cases)
        self._cases = cases
        self._latest: dict[str, tuple[bytes, Any]] = {}

    @cached_property
    def light(self) -> SceneLight:
        """What there is without a kernel."""
        return SceneLight(self.view, self.work)

    @cached_property
    def _kernel(self) -> Kernel:
        view, by_pixel = self.view, not self.view.methods.straight
        if self._cases is None:
            return kept_kernel(view, by_pixel=by_pixel, work=self.work)
        wave = view.grid.nodes_nm
        return make_kernel(view, view.methods, wave, by_pixel=by_pixel, work=self.work, cases=self._cases)

    @cached_property
    def electrons(self) -> Electrons:
        """What designs give."""
        return Electrons(self.light, self._kernel, self.work, self._dtype, once=self._once)

    @cached_property
    def readout(self) -> Readout:
        """How it is read."""
        return Readout(self.view, self._kernel, self.work)

    @property
    def n_cases(self) -> int:
        """Places whose kernels are held."""
        return self._kernel.shape[0]

    @property
    def n_places(self) -> int:
        """All places, those of the sensor's field times those of the light."""
        return self.n_cases + len(over_field(self.view)) * sum(len(block.places_px) for block in self._others)

    def read_changing(self, block: Block) -> Changing | None:
        """`Electrons.changing` as read, DN; None, too, where a channel is read from several units."""
        found = self.electrons.changing(block) if self.readout.by_channel else None
        if found is None:
            return None
        transfer, electrons, by_edges = self.readout.transfer, found, found.by_edges
        if by_edges is not None:
            line = self.readout.line(len(by_edges.uniform) * by_edges.fixed.size)
            by_edges = None if line is None else by_edges._replace(line=line)

        def make(part: slice) -> FloatArray:
            return transfer(electrons.make(part))

        return replace(found, fixed=transfer(found.fixed), make=make, by_edges=by_edges)

    @cached_property
    def anywhere(self) -> AnyPlace | None:
        """The scene with the light at any place, where that is asked for and more than a lattice of places counts."""
        if not phase.all_count(self.view, self.view.methods):
            return None
        from .places import AnyPlace  # noqa: PLC0415  (compiled: kept off the start-up path)

        return AnyPlace(self.view, self.work)

    def read(self, curves: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The readout, DN, ndarray[n_designs, n_cases, n_signals, n_channels], and exposure, s, ndarray[n_designs]."""
        return self._read_once("read", curves, self._read)

    def _read(self, curves: FloatArray) -> tuple[FloatArray, FloatArray]:
        exposure_s = self.light.exposure_s(curves)
        own = np.concatenate([self.readout.folded(self.readout.transfer(e)) for e in self._blocks(curves, exposure_s)])
        return np.concatenate([own, *(other.read(curves)[0] for other in self._rest())], axis=1), exposure_s

    def _read_once(self, how: str, curves: FloatArray, read: Callable[[FloatArray], _Found]) -> _Found:
        """What `read` gives; of one design, of which several tables are made one after the other, not made again."""
        if len(curves) != 1 or self._others:
            return read(curves)
        asked = curves.tobytes()
        kept = self._latest.get(how)
        if kept is None or kept[0] != asked:
            kept = self._latest[how] = asked, read(curves)
        found: _Found = kept[1]
        return found

    def _rest(self) -> Iterator[Imager]:
        """The places whose kernels are not held, block by block."""
        return (Imager(self.view, self.work, cases=block) for block in self._others)

    def read_with_noise(self, curves: FloatArray) -> NoisyReadout:
        """The readout as from `read`, with its variance and what errors need to know of it.

        Pixels are read one by one, so saturation and quantization must be among the view's methods.
        """
        return self._read_once("noise", curves, self._read_with_noise)

    def _read_with_noise(self, curves: FloatArray) -> NoisyReadout:
        exposure_s = self.light.exposure_s(curves)
        parts = [self.readout.with_noise(electrons) for electrons in self._blocks(curves, exposure_s)]
        found = [tuple(np.concatenate(values) for values in zip(*parts, strict=True))]
        for other in self._rest():
            more = other.read_with_noise(curves)
            found.append((more.mean, more.variance, more.gaussian, more.reach_dn))
        mean, variance, gaussian, reach = (np.concatenate(values, axis=1) for values in zip(*found, strict=True))
        return NoisyReadout(mean, variance, gaussian, reach, exposure_s)

    def _blocks(self, curves: FloatArray, exposure_s: FloatArray) -> Iterator[FloatArray]:
        """`Electrons.expected` of blocks of designs."""
        scales = self.light.scales(exposure_s)
        step = max(1, _BLOCK // (self.n_cases * scales.shape[1] * len(self.light.signals) * self._kernel.shape[1]))
        for start in range(0, len(curves), step):
            block = slice(start, start + step)
            yield self.electrons.expected(curves[block], scales[block], exposure_s[block])

    def pixel_electrons(self, curves: FloatArray) -> FloatArray:
        """Expected electrons of the pixels that are read, ndarray[n_designs, n_cases, n_signals, n_pixels].

        Of a light that fills the field, the pixels of one tile, row by row. Raises SweepError where the pixels of all
        places do not fit into memory.
        """
        if self._others:
            most = f"at most those of {self.n_cases} places: a smaller light, or a named place"
            raise SweepError(Fault("too many pixels to draw", value=f"{self.n_places} places", allowed=most))
        exposure_s = self.light.exposure_s(curves)
        found = self.electrons.expected(curves, self.light.scales(exposure_s), exposure_s)
        if self.readout.by_channel and self.view.scenario.target is None:
            return found[..., self.view.mosaic.indices.ravel()]
        return found


class AllApart(Imager):
    """An imager of all places, for what tells a place from its mirror image: pixels that are drawn one by one."""

    all_apart = True


_imagers: Cache[tuple[type[Imager], bytes], Imager] = Cache(16)
_known: Cache[tuple[type[Imager], int], tuple[View, Imager]] = Cache(4)
"""Those of the views of the last blocks, by the views themselves, which nobody changes."""


def imager_of(view: View, kind: type[Imager] = Imager) -> Imager:
    """The imager of a view; the latest ones are kept, so that a kernel is made once in a process."""

    def made() -> tuple[View, Imager]:
        return view, _imagers.get((kind, hashlib.sha256(pickle.dumps(view)).digest()), lambda: kind(view))

    return _known.get((kind, id(view)), made)[1]
