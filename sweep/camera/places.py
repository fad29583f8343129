"""The smallest and the largest color separation distance over all real places of a light on the mosaic.

The tile is divided into cells. In each, all distances are bounded from the responses at its four corners and from what
may lie between them (`between`); cells that may hold a smaller or a larger distance than those found, by more
than the method of `phase` leaves open, are divided. The readout is taken as straight.
"""

from __future__ import annotations

import hashlib
import pickle
import threading
from collections import Counter
from dataclasses import dataclass, replace

import numpy as np

from ..cache import Cache
from ..curves.hats import hats
from ..curves.lights import Pair, class_pairs
from ..types import FloatArray, IndexArray
from .between import Between, Deviation
from .effects import blur, phase
from .effects.base import KernelEffect
from .kernel import colorless, make_kernel
from .methods import REFERENCE
from .registry import EFFECTS, WHOLE_LIGHT, factor_of_light
from .view import View

_UNIT_PX = 2.0**-40
"""Places are told apart in this unit."""
_MOST_CELLS = 400_000
"""Cells of one design, after which the search gives up."""
_KEPT_BYTES = 200e6
_AT_ONCE = 2_000_000
"""Values of pair distances that are held at once."""


@dataclass(frozen=True)
class Extremes:
    """Of one pair of types, over all places: smallest and largest distance, DN, and where.

    `at_smallest`, `at_largest`: ndarray[2, 2], the place and the pixel read out, each (column, row) in pixels.
    """

    smallest: float
    largest: float
    at_smallest: FloatArray
    at_largest: FloatArray


class _Geometry:
    """Kernels at places and in cells of places, kept: what designs, spaces and tolerances of one scene share."""

    def __init__(self, view: View) -> None:
        self._view, wave = view, view.grid.nodes_nm
        self.knots_nm = wave if view.methods.blur == "skip" else blur.knots(wave, view.methods.blur)
        self.between = Between(view, view.methods, self.knots_nm)
        self._kernels: dict[tuple[int, ...], FloatArray] = {}
        self._deviations: dict[tuple[int, ...], tuple[FloatArray, FloatArray]] = {}
        self._one_at_a_time = threading.Lock()

    def of_cells(self, cells: phase.Cells, work: Counter[str]) -> tuple[FloatArray, Deviation]:
        """The kernel at the corners of cells, and how far it may be from that in them."""
        with self._one_at_a_time:
            kernels = self._kernels_at(cells, work)
            return kernels, self._deviations_in(cells, kernels, work)

    def _named(self, places: FloatArray, homes: FloatArray) -> list[tuple[int, ...]]:
        """A name for each place (ndarray[n, 2]), with the pixel that is read out there, where one is."""
        target = self._view.scenario.target
        assert target is not None
        names = np.rint(places / _UNIT_PX).astype(np.int64)
        if target.readout == "center":
            names = np.concatenate([names, homes.astype(np.int64)], axis=1)
        return [tuple(name) for name in names.tolist()]

    def _kernels_at(self, cells: phase.Cells, work: Counter[str]) -> FloatArray:
        """Kernel at the corners of cells, ndarray[n_cells, 4, n_channels, n_channels, n_knots]."""
        corners = cells.corners
        names = self._named(corners.places_px, corners.home_px)
        if sum(kernel.nbytes for kernel in self._kernels.values()) > _KEPT_BYTES:
            self._kernels.clear()
        new = {name: at for at, name in enumerate(names) if name not in self._kernels}
        if new:
            cases, methods = corners.some(np.array(list(new.values()))), self._view.methods
            made = make_kernel(self._view, methods, self.knots_nm, by_pixel=False, work=work, cases=cases)
            work["places"] += len(new)
            whole = np.broadcast_to(made.light, (*made.light.shape[:3], self.knots_nm.size))
            self._kernels |= dict(zip(new, whole, strict=True))
        found = np.stack([self._kernels[name] for name in names])
        return found.reshape(len(cells.centers), len(phase.CORNERS), *found.shape[1:])

    def _deviations_in(self, cells: phase.Cells, kernels: FloatArray, work: Counter[str]) -> Deviation:
        """How far the kernel may be from that at the corners."""
        names = [(*name, int(cells.half / _UNIT_PX)) for name in self._named(cells.centers, cells.homes)]
        if len(self._deviations) * kernels[0, 0, :, :, 0].size * self.between.n_parts * 8 > _KEPT_BYTES:
            self._deviations.clear()
        new = [at for at, name in enumerate(names) if name not in self._deviations]
        if new:
            made = self.between.of_cells(cells.centers[new], cells.half, cells.homes[new], kernels[new])
            work["cells"] += len(new)
            self._deviations |= {names[at]: both for at, both in zip(new, zip(*made, strict=True), strict=True)}
        return Deviation(*(np.stack(parts) for parts in zip(*(self._deviations[n] for n in names), strict=True)))


_geometries: Cache[bytes, _Geometry] = Cache(4)


def forget_geometries() -> None:
    """Let the next scene compute its kernels anew, as one that is the first."""
    _geometries.clear()


def _geometry_of(view: View) -> _Geometry:
    """The geometry of a scene: filters, noise and the light's way to the lens have no part in it."""
    own = [name for name, effect in EFFECTS.items() if isinstance(effect, KernelEffect) and not effect.is_limit]
    kept = {name: getattr(view.methods, name) for name in own}
    methods = replace(REFERENCE, **kept, **WHOLE_LIGHT)
    bare = replace(colorless(view), methods=methods)
    return _geometries.get(hashlib.sha256(pickle.dumps(bare)).digest(), lambda: _Geometry(bare))


class AnyPlace:
    """A scene in which the light may fall anywhere, ready for designs.

    `work` counts the places and cells that are computed; those of other designs of the scene are kept.
    """

    def __init__(self, view: View, work: Counter[str]) -> None:
        within_dn, wave = phase.within_dn(view.methods.phase), view.grid.nodes_nm
        if within_dn is None:
            raise ValueError(f"{view.methods.phase!r} looks at a lattice of places")
        self.within_dn, self.members = within_dn, view.members
        self._mosaic, self._work, self._geometry = view.mosaic, work, _geometry_of(view)
        self._hats = hats(wave, self._geometry.knots_nm)
        self._dimmed = factor_of_light(view, view.methods, wave)

    @property
    def n_knots(self) -> int:
        """Wavelengths of the kernels."""
        return self._geometry.knots_nm.size

    def extremes(self, light_dn: FloatArray) -> dict[Pair, Extremes | None]:
        """Extremes of every pair of types; None where too many cells would be needed.

        `light_dn`: what each signal gives in each channel at each wavelength where its image is whole, DN,
        ndarray[n_signals, n_channels, n_wavelengths].
        """
        light = light_dn * self._dimmed
        pairs = class_pairs(list(self.members))
        return {(a, b): _Search(self, light[self.members[a]], light[self.members[b]]).run() for a, b in pairs}

    def whole(self) -> phase.Cells:
        """The cells to begin with."""
        return phase.whole(self._mosaic)

    @property
    def values_per_cell(self) -> int:
        """Values of the kernels at a cell's corners."""
        return len(phase.CORNERS) * len(self._mosaic.channels) ** 2 * self.n_knots

    def at_knots(self, light: FloatArray) -> FloatArray:
        """Light on the wavelengths of the kernel, ndarray[..., n_wavelengths] -> ndarray[..., n_knots]."""
        return np.asarray(light @ self._hats.T, dtype=float)

    def amounts(self, light: FloatArray) -> FloatArray:
        """`Between.amounts` of a light."""
        return self._geometry.between.amounts(light)

    def of_cells(self, cells: phase.Cells) -> tuple[FloatArray, Deviation]:
        """The kernel at the corners of cells, and how far it may be from that in them."""
        return self._geometry.of_cells(cells, self._work)


class _Search:
    """The extremes of one pair of types, for one design."""

    def __init__(self, scene: AnyPlace, first: FloatArray, second: FloatArray) -> None:
        """`first`, `second`: light of the signals of each type, DN, ndarray[n_signals, n_channels, n_wavelengths]."""
        self._scene = scene
        self._light = [scene.at_knots(light) for light in (first, second)]
        self._one, self._other = np.indices((len(first), len(second))).reshape(2, -1)
        self._amounts = np.concatenate([scene.amounts(light - second) for light in first])

    def run(self) -> Extremes | None:
        """The extremes; None when too many cells would be needed."""
        cells, pairs, counted = self._scene.whole(), np.arange(len(self._one)), 0
        nowhere = np.full((2, 2), np.nan)
        least, most = (np.inf, nowhere), (-np.inf, nowhere)
        while counted < _MOST_CELLS:
            counted += len(cells.centers)
            step = max(1, _AT_ONCE // max(16 * len(pairs), self._scene.values_per_cell))
            blocks = [cells.some(slice(at, at + step)) for at in range(0, len(cells.centers), step)]
            parts = [self._bounds(block, pairs) for block in blocks]
            low, high, corners = (np.concatenate(part) for part in zip(*parts, strict=True))
            values = corners.min(axis=2)  # [n_cells, corners]
            for at, (found, sign) in enumerate(((least, 1.0), (most, -1.0))):
                cell, corner = np.unravel_index((sign * values).argmin(), values.shape)
                if sign * values[cell, corner] < sign * found[0]:
                    place = cells.centers[cell] + cells.half * phase.CORNERS[corner]
                    better = (float(values[cell, corner]), np.stack([place, cells.homes[cell]]))
                    least, most = (better, most) if at == 0 else (least, better)
            nearest = high.min(axis=1)
            undecided = low.min(axis=1) < least[0] - self._scene.within_dn
            undecided |= nearest > most[0] + self._scene.within_dn
            if not undecided.any():
                return Extremes(least[0], most[0], least[1], most[1])
            pairs = pairs[(low[undecided] <= nearest[undecided, None]).any(axis=0)]
            cells = cells.divided(undecided)
        return None

    def _bounds(self, cells: phase.Cells, pairs: IndexArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Of cells and pairs of signals: the distance's lower and upper bound (ndarray[n_cells, n_pairs] each), and the
        distances at the corners (ndarray[n_cells, 4, n_pairs]), DN.

        The difference of two signals' responses is within `rest` of a mean of those at the corners, in each channel.
        So the distance is at most the largest at a corner and what is left, and at least how far all corners lie to one
        side of a plane, less what is left.
        """
        kernels, deviation = self._scene.of_cells(cells)
        flat = kernels.reshape(*kernels.shape[:3], -1)
        first, second = (
            flat @ light.reshape(len(light), -1).T for light in self._light
        )  # [cells, corners, c, signals]
        apart = np.moveaxis(first[..., self._one[pairs]] - second[..., self._other[pairs]], 2, 3)
        rest = np.einsum("mudb,pdb->mpu", deviation.kernel, self._amounts[pairs], optimize=True)
        rest += deviation.tilt[:, None] * (apart.max(axis=1) - apart.min(axis=1)) / 2
        corners = _norm(apart)
        high = corners.max(axis=1) + _norm(rest)
        towards = apart.mean(axis=1)
        length = _norm(towards)[..., None]
        towards = np.divide(towards, length, out=np.zeros_like(towards), where=length > 0)
        beyond = np.einsum("mjpu,mpu->mjp", apart, towards).min(axis=1)
        low = np.maximum(beyond - (np.abs(towards) * rest).sum(axis=2), 0.0)
        return low, high, corners


def _norm(vectors: FloatArray) -> FloatArray:
    return np.asarray(np.sqrt((vectors**2).sum(axis=-1)), dtype=float)
