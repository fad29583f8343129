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
    from .places_between import PlacesBetween


class SceneKernels:
    """Kernels of a scene's methods at the wavelengths at which plans compare them, remembered."""

    def __init__(self, view: View) -> None:
        """`view`: `colorless`. `spent_s`: seconds that the kernels took, counted."""
        self._view, self._knots_nm = view, blur.knots(view.grid.nodes_nm, blur.COARSE)
        self._wanted: dict[Methods, Methods] = {}
        self._kernels: dict[Methods, FloatArray] = {}
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
    def _places(self) -> PlacesBetween:
        from .places_between import PlacesBetween  # noqa: PLC0415  (compiled: kept off the start-up path)

        return PlacesBetween(self._view, self._knots_nm)

    @property
    def corners(self) -> IndexArray:
        """The cases at the corners of each cell of places, ndarray[n_cells, 4]."""
        return self._places.corners

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
            if self.anywhere(wanted):
                light = self._places.at_corners(wanted)
            elif phase.one_is_enough(self._view) is None and wanted.sampling != "skip":
                from ..place_kernels import PlaceKernels  # noqa: PLC0415  (compiled: kept off the start-up path)

                made = PlaceKernels(self._view, wanted, nodes)
                light = made.at(phase.cases(self._view, wanted.phase), Counter())[0] @ made.shares
            else:
                light = make_kernel(self._view, wanted, nodes, by_pixel=False, work=Counter()).light
            self._kernels[wanted] = np.ascontiguousarray(np.broadcast_to(light, (*light.shape[:3], nodes.size)))
        return self._kernels[wanted]

    def _in_cells(self, methods: Methods) -> tuple[FloatArray, FloatArray]:
        """The kernel at the nodes of cells, or, where it is that of a lattice, the same in all of them; how far it may
        be from its interpolation.
        """
        if self.anywhere(methods):
            return self._places.of(self.wanted(methods))
        found = self.of(methods)
        return found[:1, None], np.zeros(found.shape[1:3])

    def missing_s(self, *methods: Methods) -> float:
        """Seconds of the kernels that are not made yet, counted."""
        return sum(self._seconds(wanted) for wanted in {self.wanted(one) for one in methods} - set(self._kernels))

    def _seconds(self, wanted: Methods) -> float:
        """Of a kernel, counted."""
        if self._view.scenario.target is None or wanted.sampling == "skip":
            return 0.0
        functions, begun_s = pixels_per_place(self._view) * self._knots_nm.size, KERNEL_S
        n_cases = phase.n_places(self._view, wanted.phase)
        if self.anywhere(wanted):
            n_cases, begun_s = self._places.n_nodes, sampling.SEARCHED_S + sampling.SEARCHED_PIXEL_S * functions
        return begun_s + n_cases * (sampling.PLACE_S + sampling.PLACE_PIXEL_S * functions)

    def nearest(self, methods: Methods) -> FloatArray:
        """The kernel at the place of a lattice that is nearest to the center of each cell."""
        lattice = phase.places_px(self._view, methods.phase)
        return self.of(methods)[phase.nearest_places(self._view, self._places.cells.centers, lattice)]

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
        """What lies between the corners of cells, of a change of the kernel and what is left; None for a lattice.

        `scale`: of a change that is this share of the kernel.
        """
        if not self.anywhere(before):
            return None
        from .places_between import beside_corners  # noqa: PLC0415  (compiled: kept off the start-up path)

        part = what.part if isinstance(what, KernelChange) else None
        corners, (here, off) = self.corners, self._in_cells(before)
        there, off_there = self._in_cells(after)
        changed, off_changed = scale * here, scale * off
        if part is Part.PLACES:  # what is left is that of another place in each cell
            corners = np.arange(len(change)).reshape(corners.shape)
            there, off_there = np.zeros_like(here), np.zeros_like(off)
        elif part is not None:
            changed, off_changed = here - there, (off + off_there) * bool(change.any())
        moved = off_changed + beside_corners(changed)
        beside = off_there + beside_corners(np.broadcast_to(there, here.shape))
        return Spread(corners, moved, beside, np.ptp(left[corners], axis=1))
