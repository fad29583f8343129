"""The kernels of a scene that promises compare: at a few wavelengths, and at all places of the light or a lattice."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ...base.types import FloatArray, IndexArray
from ..effects import blur, phase, sampling
from ..effects.base import Change, KernelChange, KernelEffect, Part
from ..kernel import make_kernel
from ..kernel_size import pixels_per_place
from ..methods import REFERENCE, Methods
from ..registry import EFFECTS, WHOLE_LIGHT
from ..view import View
from .bounds import Spread
from .work import KERNEL_S, Work

if TYPE_CHECKING:
    from ..between import Deviation


class SceneKernels:
    """Kernels of a scene's methods at the wavelengths at which plans compare them, remembered."""

    def __init__(self, view: View) -> None:
        """`view`: `colorless`. `spent_s`: seconds that the kernels took, counted."""
        self._view, self._knots_nm = view, blur.knots(view.grid.nodes_nm, blur.COARSE)
        self._wanted: dict[Methods, Methods] = {}
        self._kernels: dict[Methods, FloatArray] = {}
        self._deviations: dict[Methods, Deviation] = {}
        self._gaps: dict[tuple[str, float], float] = {}
        self._works: dict[tuple[object, ...], dict[Methods, Work]] = {}
        self.spent_s = 0.0

    def works(self, view: View) -> dict[Methods, Work]:
        """`estimated_work` as far as it is known: of all views of this tile with equally many changed channels."""
        key = (len(view.modified), len(view.mosaic.channels), view.technologies, view.scenario)
        return self._works.setdefault(key, {})

    def anywhere(self, methods: Methods) -> bool:
        """Whether the light may fall anywhere, and more than a lattice of places is looked at."""
        return phase.all_count(self._view, methods)

    @cached_property
    def _cells(self) -> phase.Cells:
        """Cells of places; their corners stand for all places, with what may lie between them."""
        return phase.whole(self._view.mosaic)

    @cached_property
    def corners(self) -> tuple[phase.Cases, IndexArray]:
        """The corners of the cells, each once, and those of each cell."""
        return self._cells.shared_corners(self._view)

    def wanted(self, methods: Methods) -> Methods:
        """What the kernel depends on, all light being left."""
        if methods not in self._wanted:
            own = {name: effect for name, effect in EFFECTS.items() if isinstance(effect, KernelEffect)}
            kept = {name: effect.kernel_method(getattr(methods, name)) for name, effect in own.items()}
            wanted = replace(REFERENCE, **kept, **WHOLE_LIGHT)
            self._wanted[methods] = replace(wanted, phase=REFERENCE.phase) if self.anywhere(wanted) else wanted
        return self._wanted[methods]

    def of(self, methods: Methods) -> FloatArray:
        """The kernel at the knots, of all light: [cases, channels, channels, knots].

        The cases are the places of the lattice, or the corners of cells where the light may fall anywhere.
        """
        wanted, nodes = self.wanted(methods), self._knots_nm
        if wanted not in self._kernels:
            self.spent_s += self._seconds(wanted)
            if phase.one_is_enough(self._view) is None and wanted.sampling != "skip":
                from ..place_kernels import PlaceKernels  # noqa: PLC0415  (compiled: kept off the start-up path)

                cases = self.corners[0] if self.anywhere(wanted) else phase.cases(self._view, wanted.phase)
                made = PlaceKernels(self._view, wanted, nodes)
                light = made.at(cases, Counter())[0] @ made.shares
            else:
                light = make_kernel(self._view, wanted, nodes, by_pixel=False, work=Counter()).light
            self._kernels[wanted] = np.ascontiguousarray(np.broadcast_to(light, (*light.shape[:3], nodes.size)))
        return self._kernels[wanted]

    def _seconds(self, wanted: Methods) -> float:
        """Of a kernel, counted."""
        if self._view.scenario.target is None or wanted.sampling == "skip":
            return 0.0
        n_cases = len(self.corners[0].places_px) if self.anywhere(wanted) else phase.n_places(self._view, wanted.phase)
        functions = pixels_per_place(self._view) * self._knots_nm.size
        return KERNEL_S + n_cases * (sampling.PLACE_S + sampling.PLACE_PIXEL_S * functions)

    def nearest(self, methods: Methods) -> FloatArray:
        """The kernel at the place of a lattice that is nearest to the center of each cell."""
        lattice = phase.places_px(self._view, methods.phase)
        return self.of(methods)[phase.nearest_places(self._view, self._cells.centers, lattice)]

    def _deviation(self, methods: Methods) -> Deviation:
        """How far the kernel in cells may be from a mean of that at the corners: [cells, channels, channels, 1]."""
        from ..between import Between, Deviation  # noqa: PLC0415  (compiled: kept off the start-up path)

        wanted = self.wanted(methods)
        if wanted not in self._deviations:
            between, cells = Between(self._view, wanted, self._knots_nm), self._cells
            ranges = between.ranges(self.of(wanted))[:, self.corners[1]]
            found = between.of_cells(cells.centers, cells.half, cells.homes, ranges)
            # At any wavelength: that of the middle one, and what differs from it.
            largest = found.kernel[..., :1] + found.kernel[..., 1:].max(axis=3, initial=0.0, keepdims=True)
            self._deviations[wanted] = Deviation(largest, found.tilt)
        return self._deviations[wanted]

    def gap(self, methods: Methods, method: str) -> float:
        """How far a kernel may be from its interpolation between the wavelengths of a method of blur."""
        view, target = self._view, self._view.scenario.target
        knots_nm = blur.knots(view.grid.nodes_nm, method)
        if target is None or knots_nm.size == view.grid.size:
            return 0.0
        aperture = 0.0 if methods.sampling == "skip" else view.pixel.fill_factor**0.5 * view.pixel.pitch_um
        if (method, aperture) not in self._gaps:
            radius = sampling.radii_px(view, target)[0] * view.pixel.pitch_um
            optics = view.scenario.optics.f_number, blur.defocus_um(view.scenario, view.pixel.pitch_um)
            self._gaps[method, aperture] = blur.interpolation_bound(radius, aperture, tuple(knots_nm * 1e-3), *optics)
        return self._gaps[method, aperture]

    def spread(
        self, what: Change, before: Methods, after: Methods, change: FloatArray, left: FloatArray, scale: float
    ) -> Spread | None:
        """What lies between the corners of the cells, of a change of the kernel and what is left; None for a lattice.

        `scale`: of a change that is this share of the kernel.
        """
        if not self.anywhere(before):
            return None
        here = self._deviation(before)
        nothing = here._replace(kernel=np.zeros_like(here.kernel))
        there = self._deviation(after) if self.anywhere(after) else nothing
        sizes = here.kernel * scale
        part = what.part if isinstance(what, KernelChange) else None
        if part in (Part.WEIGHTS, Part.LIGHT):
            sizes = (here.kernel + there.kernel) * bool(change.any())
        corners = self.corners[1]
        if part is Part.PLACES:  # what is left is that of another place in each cell
            corners = np.arange(len(change)).reshape(corners.shape)
        changes, lefts = change[corners], left[corners]  # [cells, corners, ...]
        tilt, wide = here.tilt[:, :, None] / 2, np.ptp(lefts, axis=1)
        changed = sizes[..., 0] + tilt * np.ptp(changes, axis=1).max(axis=3)
        return Spread(corners, changed, there.kernel[..., 0] + tilt * wide.max(axis=3), wide)
